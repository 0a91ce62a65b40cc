"""
Pushing a cylinder
==================

A cylinder that stands a little off the middle slips off a robot that drives straight on. A robot that turns
towards the front sensor which sees more of it keeps it, and pushes it to the wall.
"""

import kiks

for name, gain in (("straight", 0.0), ("steering", 0.004)):
    sim = kiks.Simulation(kiks.Arena.box(800, 300), seed=1)
    sim.place(1, 80, 150, 0.0)
    cylinder = sim.add_cylinder(160, 158)
    robot = kiks.Khepera(sim.port(1))
    with sim.record(f"{name}.mcap"):
        while sim.time_s < 12:
            _, _, left, right, *_ = robot.proximity()
            turn = gain * (left - right)
            robot.set_speed(round(8 - turn), round(8 + turn))
        robot.stop()
    x_mm = sim.bodies()["x_mm"][0]
    print(f"{name}: pushed by {x_mm - 160:.0f} mm")
    kiks.Recording(f"{name}.mcap").export(f"pushing_{name}.png")

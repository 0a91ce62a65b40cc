"""
Looking back
============

A robot drives into a wall. The recording says when, and ``world_at`` gives the world of two seconds earlier.
There another program takes over: what would have happened if the robot had turned?
"""

import matplotlib.pyplot as plt

import kiks

sim = kiks.Simulation(kiks.Arena.load("pillars"), seed=1)
robot = kiks.Khepera(sim.port(1))
sim.record_paths(0.05)
with sim.record("look_back.mcap"):
    robot.set_speed(10, 9)
    while not sim.contacts(1):
        robot.pause(0.1)
    robot.pause(2)

recording = kiks.Recording("look_back.mcap")
events = recording.table("events")
hit_s = events[events["kind"] == "contact"]["time_s"][0]
print(f"The robot met the wall after {hit_s:.2f} s.")

world = recording.world_at(hit_s - 2)
world.record_paths(0.05)
other = kiks.Khepera(world.port(1))
while world.time_s < hit_s + 10:
    other.set_speed(*((6, -6) if max(other.proximity()[1:5]) > 150 else (10, 9)))
print(f"Contacts of the other program until {world.time_s:.0f} s: {world.contacts(1) - sim.contacts(1) + 1}")

figure, axes = plt.subplots(figsize=(6.4, 6), layout="constrained")
axes.imshow(sim.arena.brightness > 0, origin="lower", extent=(0, 600, 0, 600), cmap="Greys")
axes.plot(*sim.paths()[0].T[1:3], color="tab:red", linewidth=2, label="what happened")
axes.plot(*world.paths()[0].T[1:3], color="tab:green", linewidth=2, label="what would have happened")
axes.set(xlabel="x [mm]", ylabel="y [mm]")
axes.legend(loc="upper left")
figure.savefig("look_back.png", dpi=150)

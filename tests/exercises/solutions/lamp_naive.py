"""Turn to the brighter side, and away from a wall that the robot almost touches: in the dark it only bumps about."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    while True:
        light, near = robot.ambient(), robot.proximity()
        if max(near[1:5]) > 1000:
            robot.set_speed(5, -5)
        else:
            turn = max(-4, min(4, (sum(light[:3]) - sum(light[3:6])) // 40))
            robot.set_speed(4 + turn, 4 - turn)

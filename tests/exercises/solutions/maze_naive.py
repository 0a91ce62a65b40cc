"""Drive to the light and turn away from walls: a dead end that lies towards the lamp has no way out."""

import kiks

with kiks.Khepera("/dev/ttyUSB0") as robot:
    while True:
        light, near = robot.ambient(), robot.proximity()
        if max(near[1:5]) > 300:
            robot.set_speed(5, -5)
        else:
            turn = max(-4, min(4, (sum(light[:3]) - sum(light[3:6])) // 40))
            robot.set_speed(4 + turn, 4 - turn)

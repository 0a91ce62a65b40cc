"""Keep the wall on the left: in a maze without islands that leads past every place."""

import kiks

CRUISE, WANTED, LIMIT = 6, 350, 10

with kiks.Khepera("/dev/ttyUSB0") as robot:
    while True:
        left, front_left, ahead_left, ahead_right, *_ = robot.proximity()
        nearest = max(left, front_left)
        turn = max(-3.2, min(5.0, (nearest - WANTED) / 50))
        turn += (max(0, front_left - WANTED) + max(ahead_left, ahead_right)) / 5
        robot.set_speed(max(-6, min(LIMIT, CRUISE + turn)), max(-6, min(LIMIT, CRUISE - turn)))

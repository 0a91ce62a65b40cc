"""Drive to what is seen and push it until that is a wall, then back off and turn by an angle that differs each time.

A cylinder fits between the two diagonal sensors, a wall does not: that tells them apart.
"""

import kiks

CRUISE, WALL, BLOCKED_STEPS, BACK = 36, 700, 8, 1000

with kiks.Khepera("/dev/ttyUSB0") as robot:
    robot.set_profile(40, 128)
    slow = turns = 0
    while True:
        left, diagonal_left, front_left, front_right, diagonal_right, right, *_ = robot.proximity()
        slow = slow + 1 if sum(robot.speed()) < CRUISE else 0
        if min(diagonal_left, diagonal_right) > WALL or slow > BLOCKED_STEPS:
            slow, turns = 0, turns + 1
            robot.stop()
            robot.pause(0.1)
            robot.set_encoders(0, 0)
            robot.move_to(-BACK, -BACK, wait=True)
            turn = 625 + round(830 * (turns * 0.618 % 1))
            robot.move_to(-BACK + turn, -BACK - turn, wait=True)
            continue
        steer = (right + diagonal_right + front_right - left - diagonal_left - front_left) / 100
        steer = max(-CRUISE, min(CRUISE, steer))
        robot.set_speed(CRUISE + steer, CRUISE - steer)

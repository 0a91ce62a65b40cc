"""Search straight on with turns of many sizes, drive to the lighter side, and stand still where it is lightest."""

import kiks

DARK, NEAR_LAMP, NEAR = 440, 66, 150


def lightest(robot: kiks.Khepera) -> tuple[float, int]:
    """Return how much lighter the left side is than the right one, and the lowest reading."""
    left, front_left, ahead_left, ahead_right, front_right, right, *behind = robot.ambient()
    return (right + front_right + ahead_right) - (left + front_left + ahead_left), min(
        left, front_left, ahead_left, ahead_right, front_right, right, *behind
    )


with kiks.Khepera("/dev/ttyUSB0") as robot:
    side, turns = 1, 0
    while True:
        near = robot.proximity()
        lighter, lowest = lightest(robot)
        if lowest < NEAR_LAMP:
            robot.stop()
            robot.pause(0.5)
            continue
        ahead = max(near[1:5])
        if ahead > NEAR:
            turns += 1
            side = 1 if near[3] + near[4] > near[1] + near[2] else -1
            robot.set_speed(-6 * side, 6 * side)
            robot.pause(0.15 + 0.9 * (turns * 0.618 % 1) * (turns % 3 == 0))
        elif lowest > DARK - 25:
            robot.set_speed(10, 10)
        else:
            turn = max(-5, min(5, lighter / 30))
            robot.set_speed(5 - turn, 5 + turn)

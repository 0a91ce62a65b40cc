"""Follow the wall by one rule, with left and right exchanged where the wall is on the right."""

import kiks

CRUISE, WANTED, LIMIT = 5, 400, 9


def sides(robot: kiks.Khepera) -> tuple[list[int], list[int]]:
    """Return the readings from the left side to straight ahead, and from the right side."""
    left, front_left, ahead_left, ahead_right, front_right, right, *_ = robot.proximity()
    return [left, front_left, ahead_left, ahead_right], [right, front_right, ahead_right, ahead_left]


with kiks.Khepera("/dev/ttyUSB0") as robot:
    robot.set_speed(CRUISE, CRUISE)
    while max(max(each) for each in sides(robot)) < 60:
        pass
    on_left, on_right = sides(robot)
    is_left = max(on_left[:2]) >= max(on_right[:2])
    print("The wall is on the", "left." if is_left else "right.")
    while True:
        side, front_side, ahead, ahead_far = sides(robot)[0 if is_left else 1]
        nearest = max(side, front_side)
        # Away from a wall that is too near, towards one that is too far, and hard away from one ahead.
        turn = max(-2.8, min(5.0, (nearest - WANTED) / 50)) + (max(0, front_side - WANTED) + max(ahead, ahead_far)) / 5
        outer, inner = max(-6, min(LIMIT, CRUISE + turn)), max(-6, min(LIMIT, CRUISE - turn))
        robot.set_speed(*((outer, inner) if is_left else (inner, outer)))

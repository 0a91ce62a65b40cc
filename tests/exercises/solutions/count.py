"""Count how often something begins, with two thresholds, so that noise counts nothing twice, and back to its middle."""

import kiks

SEEN, GONE = 150, 40


def passed_posts(robot: kiks.Khepera) -> tuple[int, int]:
    """Drive past the next post; return where its reading began and ended [pulses]."""
    while robot.proximity()[0] < SEEN:
        pass
    begin = robot.encoders()[0]
    low = 0
    while low < 3:
        low = low + 1 if robot.proximity()[0] < GONE else 0
    return begin, robot.encoders()[0]


with kiks.Khepera("/dev/ttyUSB0") as robot:
    robot.set_encoders(0, 0)
    robot.set_speed(6, 6)
    for number in range(1, 5):
        begin, end = passed_posts(robot)
        print("Post", number, "from", begin, "to", end)
    robot.stop()
    robot.pause(0.3)
    robot.move_to((begin + end) // 2, (begin + end) // 2, wait=True)
    robot.pause(1)

"""Measure the way with the counters of the wheels, and drive the more slowly the less is left."""

import math

import kiks

PULSE_MM, BASE_MM = 0.08, 53.0


def drive(robot: kiks.Khepera, left_mm: float, right_mm: float) -> None:
    robot.set_encoders(0, 0)
    wanted = left_mm / PULSE_MM, right_mm / PULSE_MM
    while True:
        rest = [goal - done for goal, done in zip(wanted, robot.encoders(), strict=True)]
        if max(map(abs, rest)) < 8:
            break
        robot.set_speed(*(max(-10, min(10, round(each / 25) or (each > 3) - (each < -3))) for each in rest))
    robot.stop()


with kiks.Khepera("/dev/ttyUSB0") as robot:
    quarter_mm = math.pi / 2 * BASE_MM / 2
    for _ in range(4):
        drive(robot, 200, 200)
        drive(robot, -quarter_mm, quarter_mm)
    robot.pause(2)

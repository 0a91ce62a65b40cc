"""Find the distance from how the reading grows on the way, for a wall of any colour.

A reading follows from brightness / (distance + 13.5 mm)^2 alone. So the same reading comes from a darker wall at a
distance + 13.5 mm that is smaller by a factor, the same for all readings. So the way driven is a straight line over
the distance at which a white wall gives the same reading, and where it meets zero, the wall is.
"""

import numpy as np

import kiks

PULSE_MM, BEHIND_MM, WANTED_MM = 0.08, 13.5, 20.0

# Measured before a white wall: what sensor 2 reads at a distance [mm].
COUNTS = [64, 110, 180, 260, 350, 455, 560, 675, 790, 910]
WHITE_MM = [30.0, 28.6, 27.0, 25.5, 24.1, 22.6, 21.3, 19.8, 18.6, 17.5]


def reading(robot: kiks.Khepera, count: int) -> float:
    return sum(robot.proximity()[2] for _ in range(count)) / count


def move(robot: kiks.Khepera, way_mm: float) -> None:
    robot.move_to(round(way_mm / PULSE_MM), round(way_mm / PULSE_MM), wait=True)


with kiks.Khepera("/dev/ttyUSB0") as robot:
    robot.set_encoders(0, 0)
    robot.set_speed(3, 3)
    while reading(robot, 3) < 40:
        pass
    robot.stop()
    robot.pause(0.3)
    ways_mm, counts = [], []
    while not counts or counts[-1] < COUNTS[-1]:
        ways_mm.append(robot.encoders()[0] * PULSE_MM)
        counts.append(reading(robot, 12))
        move(robot, ways_mm[-1] + 0.6)
    seen = [COUNTS[0] < each < COUNTS[-1] for each in counts]
    white_mm = np.interp(np.array(counts)[seen], COUNTS, WHITE_MM)
    slope, wall_mm = np.polyfit(white_mm + BEHIND_MM, np.array(ways_mm)[seen], 1)
    print(f"The wall is {wall_mm - BEHIND_MM - ways_mm[-1]:.0f} mm ahead; of white it sends back {slope**2:.2f}.")
    move(robot, wall_mm - BEHIND_MM - WANTED_MM)
    robot.pause(1)

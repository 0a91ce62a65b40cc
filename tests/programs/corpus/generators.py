"""Behaviours as generators that a small scheduler of one's own takes forward in turn, with numpy for the weights."""

import sys
import time
from dataclasses import dataclass, field

import numpy as np
import serial

WEIGHTS = np.array([[2, 4, 6, -6, -4, -2, 1, 1], [-2, -4, -6, 6, 4, 2, 1, 1]]) / 1500


@dataclass
class Robot:
    port: serial.Serial
    counts: dict = field(default_factory=dict)

    def ask(self, command):
        self.counts[command[0]] = self.counts.get(command[0], 0) + 1
        self.port.write(f"{command}\n".encode("ascii"))
        return np.array(self.port.readline().decode().strip().split(",")[1:], dtype=int)


def avoid(robot, base):
    while True:
        speeds = np.clip(base + WEIGHTS @ robot.ask("N"), -10, 10).astype(int)
        robot.ask("D,%d,%d" % tuple(speeds))
        yield 0.1


def measure(robot, times):
    travelled = 0.0
    robot.ask("G,0,0")
    for _ in range(times):
        yield 0.25
        travelled = np.abs(robot.ask("H")).mean() * 0.08
    return travelled


def run(behaviours):
    due = [(time.monotonic(), number, each) for number, each in enumerate(behaviours)]
    while True:
        due.sort()
        at, number, behaviour = due.pop(0)
        time.sleep(max(at - time.monotonic(), 0))
        try:
            due.append((time.monotonic() + next(behaviour), number, behaviour))
        except StopIteration as end:
            return end.value


with serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0", 38400, timeout=1) as port:
    robot = Robot(port)
    way_mm = run([avoid(robot, 3), measure(robot, 6)])
    robot.ask("D,0,0")
print("moved:", way_mm > 10, "measured:", robot.counts["H"], "avoided:", robot.counts["N"] >= 10)

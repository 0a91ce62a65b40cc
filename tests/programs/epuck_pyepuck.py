"""An e-puck as a class with actuators and sensors that a step carries out, by Bluetooth as pyePuck does.

Arguments: the way, and the number of bytes of the floor sensors. It resets the robot, drives up to a wall by steps, and
closes; what it sends to actuators has no closing zero (epuck-protocol.md 7).
"""

import struct
import sys
import time

from epuck_line import Line

SENSORS = {
    "acceleration": (0x9F, "3h"),
    "proximity": (0xB2, "8h"),
    "floor": (0xB3, f"{int(sys.argv[2]) // 2}h"),
    "steps": (0xAF, "2h"),
    "light": (0xB1, "8h"),
    "microphones": (0x8B, "3h"),
    "speeds": (0xBB, "2h"),
}


class Robot:
    def __init__(self, way):
        self.line, self.values, self.todo = Line(way, 0.5), {}, []

    def connect(self):
        for _ in range(4):
            self.line.send(b"R\n")
            text = self.line.lines(2).replace(b"z,Command not found\r\n", b"")
            if text.count(b"\n") >= 2:
                self.line.until_silence()
                return True
        return False

    def ask(self, text, line_count=1):
        for _ in range(4):
            self.line.send(text.encode() + b"\n")
            answer = self.line.lines(line_count).replace(b"z,Command not found\r\n", b"").decode()
            if answer.startswith(text[0].lower()):
                return answer.strip()
        raise OSError(f"no answer to {text}")

    def set_speed(self, left, right):
        self.todo.append(struct.pack("<bhh", -ord("D"), left, right))

    def set_led(self, number, action):
        self.todo.append(struct.pack("<bbb", -ord("L"), number, action))

    def set_steps(self, left, right):
        self.todo.append(struct.pack("<bhh", -ord("P"), left, right))

    def step(self):
        for command in self.todo:
            self.line.send(command)
        self.todo = []
        for name, (code, form) in SENSORS.items():
            self.line.send(bytes((code, 0)))
            data = self.line.exactly(struct.calcsize("<" + form))
            if len(data) != struct.calcsize("<" + form):
                raise OSError(f"{name}: {len(data)} bytes")
            self.values[name] = struct.unpack("<" + form, data)

    def image(self):
        self.line.send(b"\xb7\x00")
        mode, width, height = self.line.exactly(3)
        return mode, width, height, self.line.exactly(width * height * (2 if mode else 1))


robot = Robot(sys.argv[1])
print("connected" if robot.connect() else "not connected")
print(robot.ask("V", 2))
print(robot.ask("I"), robot.ask("J,0,40,20,8"), robot.ask("I"))
robot.set_steps(0, 0)
robot.set_led(3, 1)
for count in range(200):  # noqa: B007
    robot.set_speed(400, 400)
    robot.step()
    if max(robot.values["proximity"]) > 600:
        break
robot.set_speed(0, 0)
robot.step()
print(count, "steps of a loop,", time.time())
for name, values in robot.values.items():
    print(name, *values)
mode, width, height, pixels = robot.image()
print(mode, width, height, len(pixels), sum(pixels))
robot.line.send(b"c\n")
print(robot.line.lines(1))
robot.line.send(b"S\n")
print(robot.line.lines(1))
robot.line.close()

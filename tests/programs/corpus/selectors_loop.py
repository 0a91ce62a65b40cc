"""An event loop of one's own with `selectors`: the robot's port, and a pipe by which a timer thread wakes it."""

import os
import selectors
import sys
import threading

import serial


class Loop:
    def __init__(self, port):
        self.port = port
        self.selector = selectors.DefaultSelector()
        self.woken, self.waker = os.pipe()
        self.selector.register(port, selectors.EVENT_READ, self.on_serial)
        self.selector.register(self.woken, selectors.EVENT_READ, self.on_wake)
        self.buffer = bytearray()
        self.log = []
        self.is_over = False

    def on_serial(self):
        self.buffer += self.port.read(self.port.in_waiting or 1)
        while (end := self.buffer.find(b"\n")) >= 0:
            line = bytes(self.buffer[:end]).decode().strip()
            del self.buffer[: end + 1]
            self.log.append(line[0])
            if line[0] == "n":
                self.port.write(b"O\n")
            elif line[0] == "o":
                self.port.write(b"N\n")

    def on_wake(self):
        self.is_over = os.read(self.woken, 1) == b"x"

    def run(self):
        self.port.write(b"D,3,3\nN\n")
        while not self.is_over:
            for key, _ in self.selector.select(timeout=1):
                key.data()
        self.selector.close()


port = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "COM2", 38400, timeout=0.5)
loop = Loop(port)
threading.Timer(1.2, os.write, (loop.waker, b"x")).start()
loop.run()
text = "".join(loop.log)
print("began with:", text[:3], "took turns:", "nn" not in text and "oo" not in text, "often:", len(text) > 20)
port.timeout = 0.3
port.readline()
port.write(b"D,0,0\n")
print(port.readline())
port.close()

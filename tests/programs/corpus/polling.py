"""Polls `in_waiting` and reads what is there, character by character, beside a main loop that never stops."""

import sys
from time import monotonic, sleep

import serial

ser = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyAMA0", 19200)


class Link:
    def __init__(self, port):
        self.port = port
        self.text = ""

    def poll(self):
        """Yield the lines that are whole."""
        while self.port.in_waiting > 0:
            character = self.port.read().decode("latin-1")
            if character == "\n":
                yield self.text.rstrip("\r")
                self.text = ""
            else:
                self.text += character


link = Link(ser)
asked, answered, busy = 0, 0, 0
next_time = monotonic()
ser.write(b"D,3,-3\n")
end = monotonic() + 1.5
while monotonic() < end:
    if monotonic() >= next_time:
        ser.write(b"N\n")
        asked += 1
        next_time += 0.1
    for line in link.poll():
        answered += line.startswith("n,")
    busy += 1
    sleep(0.005)
ser.write(b"D,0,0\n")
sleep(0.3)
rest = list(link.poll())
answered += sum(line.startswith("n,") for line in rest)
last = rest[-1]
print(
    "asked ten times a second:",
    14 <= asked <= 16,
    "answered:",
    answered == asked,
    "meanwhile busy:",
    busy > 2 * asked,
)
print("last:", last)
ser.close()

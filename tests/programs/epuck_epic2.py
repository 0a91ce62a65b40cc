"""A panel that asks for all in one request ten times a second, as ePic2 does: three words of the floor.

Argument: the way. It sets the counters until a line comes, flushes before it writes, and counts the bytes of each
letter itself (epuck-protocol.md 7).
"""

import struct
import sys
import time

from epuck_line import Line

line = Line(sys.argv[1], 1.0)


def write(data):
    if sys.argv[1] == "serial":
        line.port.reset_input_buffer()
    line.send(data)


for _ in range(2):
    write(b"P,0,0\n")
    print(line.lines(1))
speeds = 300, 500
for count in range(30):
    request = bytes((0xB2, 0xB1, 0x9F, 0xAF, 0x8B, 0xB3, 0xA9))
    request += struct.pack("<bhh", -ord("D"), *speeds) + bytes((0xBB,))
    request += b"".join(bytes((0xB4, led, led % 2)) for led in range(8)) + b"\0"
    write(request)
    data = line.exactly(16 + 16 + 6 + 4 + 6 + 6 + 4)
    if count % 10 == 0:
        print(struct.unpack("<8h8h3h2h3h3h2h", data), time.time())
    time.sleep(0.1)
write(b"J,0,30,20,4\n")
time.sleep(0.05)
print(line.lines(1))
write(b"\xb7\x00")
time.sleep(0.1)
mode, width, height = line.exactly(3)
pixels = line.exactly(width * height)
print(mode, width, height, len(pixels), min(pixels), max(pixels))
line.close()

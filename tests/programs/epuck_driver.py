"""A node that reads all its robot has in one binary request for each loop, as the driver of ROS does.

Argument: the way. At first it sends a carriage return and V, and reads until there is silence (epuck-protocol.md 7).
"""

import struct
import sys
import time

from epuck_line import Line

line = Line(sys.argv[1], 0.5)
for first in (b"\r", b"V\r", b"J,1,20,20,8,240,160\r"):
    line.send(first)
    print(line.until_silence())
line.close()

line = Line(sys.argv[1], 10.0)
REQUEST = bytes((0x9F, 0xBB, 0xB3, 0xB2, 0xAF, 0x8B, 0))
FORM = struct.Struct("<3h2h5h8h2h3h")
line.send(struct.pack("<bhhb", -ord("P"), 0, 0, 0))
failures, near = 0, 0
for count in range(400):
    line.send(REQUEST)
    data = line.exactly(FORM.size)
    if len(data) < FORM.size:
        failures += 1
        if failures == 3:
            sys.exit("the robot does not answer")
        continue
    failures = 0
    values = FORM.unpack(data)
    proximity, steps = values[10:18], values[18:20]
    near = max(near, max(proximity[0], proximity[7]))
    speeds = (600, 600) if max(proximity[0], proximity[7]) < 500 else (-300, 300)
    line.send(struct.pack("<bhhb", -ord("D"), *speeds, 0))
    line.send(b"".join(struct.pack("<bbb", -ord("L"), led, count >> led & 1) for led in range(10)) + b"\0")
    if count % 100 == 0:
        line.send(b"\xb7\x00")
        picture = line.exactly(3 + 800)
        print(values, tuple(picture[:3]), len(picture), time.time())
print(near, steps, values[3:5], time.time())
line.close()

"""A simulator's window onto a real robot: one packet for each of its steps of 64 ms, as Webots sends it.

Argument: the way. It believes the version of the robot's program, and tries each packet three times
(epuck-protocol.md 7).
"""

import struct
import sys
import time

from epuck_line import Line

line = Line(sys.argv[1], 1.0)
line.send(b"V\n")
line.until_silence()
line.send(b"V\n\0")
version = line.lines(2).decode()
if "1.5.3 November 2016 (Webots)" not in version and "Version 2." not in version:
    sys.exit(f"not the right program: {version}")
line.send(b"S\n\0")
print(version.split(), line.lines(1))
line.send(b"J,1,16,12,8\n\0")
print(line.lines(1))
speeds = None
for count in range(40):
    wanted = (200, -200) if 15 < count < 25 else (500, 500)
    packet = b""
    if wanted != speeds:
        packet += struct.pack("<bhh", -ord("D"), *wanted)
        speeds = wanted
    packet += bytes((0xB4, count % 8, 1, 0xB4, (count + 4) % 8, 0))
    packet += bytes((0x9F, 0xB3, 0xB2, 0xB1, 0xAF, 0xB7, 0))
    for _ in range(3):
        line.send(packet)
        answer = line.exactly(6 + 6 + 16 + 16 + 4 + 3 + 2 * 16 * 12)
        if len(answer) == 6 + 6 + 16 + 16 + 4 + 3 + 2 * 16 * 12:
            break
    else:
        sys.exit("no answer")
    if count % 13 == 0:
        print(struct.unpack_from("<3h3h8h8h2h3B", answer), sum(answer[51:]), time.time())
    time.sleep(max(0.0, 0.064 - time.time() % 0.064))
line.send(b"S\n\0")
print(line.lines(1), time.time())
line.close()

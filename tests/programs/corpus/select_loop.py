"""The loop of somebody who comes from C: `select` on the port's descriptor, `os.read` and `os.write`."""

import os
import select
import sys
import time

import serial

port = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyS1", 19200, timeout=0)
fd = port.fileno()

buffer = b""
timeouts = 0
replies = []
deadline = time.monotonic() + 1.5
os.write(fd, b"D,4,-4\n")
while time.monotonic() < deadline:
    readable, _, broken = select.select([fd], [], [fd], 0.2)
    assert not broken
    if not readable:
        # It is quiet: ask again.
        timeouts += 1
        os.write(fd, b"H\n")
        continue
    buffer += os.read(fd, 64)
    *lines, buffer = buffer.split(b"\n")
    replies += [line.strip().decode() for line in lines]

os.write(fd, b"D,0,0\n")
while not replies or replies[-1] != "d" or len(replies) == 1:
    if select.select([port], [], [], 1)[0]:
        buffer += port.read(64)
        *lines, buffer = buffer.split(b"\n")
        replies += [line.strip().decode() for line in lines]
print("quiet about every fifth of a second:", 6 <= timeouts <= 9)
print(replies[0], {reply[0] for reply in replies[1:-1]}, replies[-1])
print("nothing half:", buffer)
port.close()

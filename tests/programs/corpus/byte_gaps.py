"""`inter_byte_timeout`: on Windows a silent line ends a read; on Linux the time limit does."""

import sys
import time

import serial

s = serial.Serial(
    sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyS0", 9600, timeout=0.4, inter_byte_timeout=0.1, xonxoff=False
)
print(s.inter_byte_timeout)
for command, least in ((b"B\n", 5), (b"N\n", 18), (b"H\nH\n", 12)):
    began = time.monotonic()
    s.write(command)
    block = b""
    while not block.endswith(b"\n") or block.count(b"\n") < command.count(b"\n"):
        block += s.read(200)
    took = time.monotonic() - began
    print(command, block.count(b"\n"), len(block) >= least, "limit kept:", took < 20)
s.inter_byte_timeout = None
s.timeout = 0.2
s.write(b"D,0,0\n")
print(s.read(200))
s.close()

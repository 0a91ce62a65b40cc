"""Time limits of reads: none at all, no waiting, a short one; and changes between them while the port is open."""

import sys
import time

import serial

ser = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "COM1", 9600, timeout=0)

# 0: what is there at once.
print(ser.read(100), ser.readline())
ser.write(b"B\n")
polls = 0
line = b""
while not line.endswith(b"\n"):
    line += ser.read(1)
    polls += 1
    time.sleep(0.001)
print("polled:", line[:2], polls > 1)

# None: however long it takes.
ser.timeout = None
ser.write(b"H\n")
print(ser.readline()[:2], ser.timeout)

# A short one: half a line is possible.
ser.timeout = 0.05
before = time.perf_counter()
print(ser.read(10), "waited:", 0.03 < time.perf_counter() - before < 10)
ser.write(b"N\n")
line = b""
while b"\n" not in line:
    line += ser.readline()
print("in pieces:", line.count(b","))

ser.timeout = 2
before = time.perf_counter()
ser.write(b"D,3,3\n")
print(ser.read(3), "at once:", time.perf_counter() - before < 1.9)
before = time.perf_counter()
print(ser.read(1), "two seconds:", 1.9 < time.perf_counter() - before < 20)
ser.write(b"D,0,0\n")
print(ser.readline())
ser.close()

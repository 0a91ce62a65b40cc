"""Two objects on one port, one for each direction; and `exclusive`, which keeps a second one away."""

import sys
import threading

import serial

NAME = sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0"

writer = serial.Serial(NAME, 9600)
reader = serial.Serial(NAME, 9600, timeout=1)
lines = []


def read():
    while len(lines) < 12:
        line = reader.readline()
        if line:
            lines.append(line[:1])


thread = threading.Thread(target=read)
thread.start()
writer.write(b"D,2,2\n")
for _ in range(10):
    writer.write(b"N\n")
writer.write(b"D,0,0\n")
thread.join()
print(b"".join(lines).decode())
reader.close()
writer.write(b"B\n")
print(writer.readline()[:2])
writer.close()

first = serial.Serial(NAME, 9600, timeout=1, exclusive=True)
try:
    serial.Serial(NAME, 9600, exclusive=True)
    print("let in twice")
except serial.SerialException:
    print("only one at a time")
first.close()
second = serial.Serial(NAME, 9600, timeout=1, exclusive=True)
second.write(b"H\n")
print(second.readline()[:2])
second.close()

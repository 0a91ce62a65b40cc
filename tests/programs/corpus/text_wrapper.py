"""Text in and out, as the documentation of pyserial suggests: `io.TextIOWrapper` around `io.BufferedRWPair`."""

import io
import sys

import serial

ser = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "COM1", 9600, timeout=0.5)
sio = io.TextIOWrapper(io.BufferedRWPair(ser, ser, 1), encoding="ascii", newline=None)


def command(text):
    sio.write(text + "\n")
    sio.flush()
    return sio.readline()


print(repr(command("D,2,2")))
for name in ("N", "O"):
    letter, *values = command(name).split(",")
    print(letter, len(values), all(value.strip().isdigit() for value in values))
sio.write("H\nB\n")
sio.flush()
print([line[0] for line in (sio.readline(), sio.readline())])
print(repr(command("D,0,0")))
print(repr(sio.readline()))
ser.close()

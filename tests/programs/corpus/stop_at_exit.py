"""`atexit` stops the robot whatever happens: here the program leaves by `sys.exit` in the midst of driving."""

import atexit
import sys
import time

import serial

port = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0", 9600, timeout=1)


@atexit.register
def close():
    port.close()
    print("closed:", not port.is_open)


def stop(reason):
    port.reset_input_buffer()
    port.write(b"D,0,0\n")
    print("stopped,", reason, port.readline())


atexit.register(stop, reason="as always")


port.write(b"D,6,6\n")
port.readline()
end = time.time() + 1
while True:
    port.write(b"H\n")
    left, right = map(int, port.readline().decode().strip().split(",")[1:])
    if time.time() > end:
        print("on its way:", left > 300 and right > 300)
        sys.exit(0)

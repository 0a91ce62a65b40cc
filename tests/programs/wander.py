"""A program as students write them for the real robot: pyserial, sleeps, clocks, no word of KiKS."""

import sys
import time

import serial

ser = serial.Serial("/dev/ttyUSB0", 9600, stopbits=serial.STOPBITS_TWO, timeout=1)


def ask(command):
    ser.write((command + "\n").encode())
    return ser.readline().decode().strip()


started = time.time()
print(ask("B"))
ask("G,0,0")
while time.time() - started < 20:
    values = [int(v) for v in ask("N").split(",")[1:]]
    if max(values[1:5]) > 300:
        ask("D,4,-4")
    else:
        ask("D,6,6")
    time.sleep(0.05)
ask("D,0,0")
time.sleep(0.5)
print(ask("H"))
ser.close()
if len(sys.argv) > 1:
    sys.exit(int(sys.argv[1]))

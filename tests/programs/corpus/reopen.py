"""Closes and opens the port again: the robot drives on meanwhile, and what nobody read is gone."""

import sys
import time

import serial

port = serial.Serial()
port.port = sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyS0"
port.baudrate = 19200
port.timeout = 0.5
print("open before:", port.is_open)
port.open()
port.write(b"G,0,0\n")
print(port.readline())
port.write(b"D,5,5\n")
print(port.readline())
port.write(b"N\n")
port.flush()
time.sleep(0.2)
port.close()
print("closed:", not port.is_open)
time.sleep(0.5)

port.open()
print("nothing old:", port.in_waiting, port.read(1))
port.write(b"H\n")
driven = int(port.readline().split(b",")[1])
print("it drove on:", driven > 200)
port.close()
port.close()

with port:
    print("open in a with:", port.is_open)
    port.write(b"D,0,0\n")
    print(port.readline())
print("and closed again:", port.is_open)
try:
    port.open()
    port.open()
except serial.SerialException as error:
    print(type(error).__name__)
port.close()

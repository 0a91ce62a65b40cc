"""Drives about and prints everything it is answered. Arguments: port, loops, speed of the left wheel, of the right."""

import sys

import serial

name, loops, left, right = sys.argv[1], *map(int, sys.argv[2:5])
if "://" in name:
    port = serial.serial_for_url(name, baudrate=9600, timeout=20)
else:
    port = serial.Serial(name, 9600, stopbits=serial.STOPBITS_TWO, timeout=20)
for loop in range(loops):
    for command in ("N", f"D,{left},{right - loop % 4}", "E"):
        port.write(command.encode() + b"\n")
        print(port.readline().decode().strip())
port.close()

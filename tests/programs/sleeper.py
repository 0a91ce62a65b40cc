"""Sleeps most of the time, looks at the clock, and reads with time-outs that are too short. Argument: loops."""

import sys
import time

import serial

port = serial.Serial("COM1", 9600, stopbits=serial.STOPBITS_TWO, timeout=0.004)
for loop in range(int(sys.argv[1])):
    time.sleep(0.1 + 0.01 * loop)
    port.write(b"D,%d,3\nN\n" % loop)
    heard = b""
    while not heard.endswith(b"\r\n") or heard.count(b"\n") < 2:
        heard += port.readline()
    print(time.time(), heard)
    port.write(b"H\n")
    while port.in_waiting < 5:
        pass
    print(time.monotonic(), port.read(port.in_waiting))
    port.reset_input_buffer()

"""Toggles DTR and RTS, as one does to reset boards or to power adapters; a Khepera does not care."""

import sys
import time

import serial

port = serial.serial_for_url(sys.argv[1] if len(sys.argv) > 1 else "COM1", do_not_open=True)
port.baudrate = 9600
port.timeout = 1
port.dtr = False
port.rts = False
port.open()
print("as set before:", port.dtr, port.rts)

for state in (True, False, True):
    port.dtr = state
    port.rts = not state
    time.sleep(0.1)
port.setDTR(True)
port.setRTS(True)
print("as set now:", port.dtr, port.rts)
port.send_break(0.1)
time.sleep(0.2)
port.reset_input_buffer()

port.write(b"D,2,2\n")
print(port.readline())
port.write(b"D,0,0\n")
print(port.readline())
port.close()

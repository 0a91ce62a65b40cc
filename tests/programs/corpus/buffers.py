"""Buffers: flush, in_waiting, out_waiting, and replies that are thrown away by reset_input_buffer."""

import sys
import time

import serial

ser = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyS0", 19200, timeout=0.5)
ser.reset_input_buffer()
ser.reset_output_buffer()
print("empty:", ser.in_waiting, ser.out_waiting)

for _ in range(5):
    ser.write(b"B\n")
ser.flush()
time.sleep(0.5)
print("five replies wait:", ser.in_waiting == 5 * len("b,5.02,5.01\r\n"))
first = ser.readline()
ser.reset_input_buffer()
print("one was read, the others are gone:", first[:2], ser.in_waiting, ser.read(5))

# A robot that is in the middle of a line: throw it away, then ask for something definite.
ser.write(b"N\nN\n")
time.sleep(0.01)
ser.reset_input_buffer()
time.sleep(0.4)
ser.reset_input_buffer()
ser.write(b"H\n")
print("in step again:", ser.readline()[:2])

ser.write(b"D,1,")
time.sleep(0.2)
print("half a command has no reply:", ser.read(1))
ser.write(b"1\nD,0,0\n")
print("the other half:", ser.readline(), ser.readline())
ser.close()

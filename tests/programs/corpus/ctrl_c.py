"""Ends as with Ctrl-C: KeyboardInterrupt in the main loop, `finally` stops the robot. A timer presses the keys."""

import _thread
import sys
import threading
import time

import serial

ser = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyS0", 9600, timeout=1)
threading.Timer(1.0, _thread.interrupt_main).start()
rounds = 0
began = time.monotonic()
try:
    ser.write(b"D,3,3\n")
    ser.readline()
    print("driving, Ctrl-C ends")
    while True:
        ser.write(b"N\n")
        ser.readline()
        rounds += 1
        time.sleep(0.05)
except KeyboardInterrupt:
    print("Ctrl-C")
finally:
    # A reply may have been cut off.
    time.sleep(0.2)
    ser.reset_input_buffer()
    ser.write(b"D,0,0\n")
    print("stopped:", ser.readline())
    ser.close()
print("rounds:", rounds > 2, "time enough:", time.monotonic() - began > 0.9)

"""`write_timeout`, writes of different size, and a port object that is handed around with `apply_settings`."""

import sys
import time

import serial

ser = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "COM6", 38400, timeout=1, write_timeout=2)
saved = ser.get_settings()
print(saved["write_timeout"], saved["baudrate"])
print(ser.write(b""), ser.write(b"D,3,3\n"), ser.readline())

# A burst of commands goes out in one piece; the replies come one after the other.
try:
    sent = ser.write(b"H\n" * 20)
    replies = [ser.readline() for _ in range(20)]
    print(sent, len(replies), all(reply.startswith(b"h,") for reply in replies))
except serial.SerialTimeoutException:
    print("the port is stuck")

for text in (None, "D,0,0\n"):
    try:
        ser.write(text)
    except TypeError as error:
        print("no bytes:", type(error).__name__)

ser.timeout = 0.1
ser.write_timeout = 0
ser.apply_settings(saved)
print(ser.timeout, ser.write_timeout)
began = time.monotonic()
ser.write(b"D,0,0\n")
print(ser.readline(), time.monotonic() - began < 10)
ser.close()

"""A watchdog by signals, as under Unix: `alarm` stops a read that would last for ever."""

import signal
import sys

import serial


class Overtime(Exception):
    pass


def on_alarm(signum, frame):
    raise Overtime(signal.Signals(signum).name)


port = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyS0", 19200)

port.write(b"D,4,4\n")
print(port.readline())

signal.signal(signal.SIGALRM, on_alarm)
signal.alarm(1)
try:
    # No time limit, and nobody has asked anything.
    print("never:", port.readline())
except Overtime as reason:
    print("gave up after", reason)
print("left of the alarm:", signal.alarm(0))

port.write(b"D,0,0\n")
print(port.readline())
port.close()

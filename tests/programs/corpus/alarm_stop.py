"""A watchdog by signals, as under Unix: `alarm` stops a read that would last for ever, `setitimer` beats time."""

import signal
import sys

import serial


class Overtime(Exception):
    pass


def on_alarm(signum, frame):
    raise Overtime(signal.Signals(signum).name)


ticks = []
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

signal.signal(signal.SIGALRM, lambda *_: ticks.append(len(ticks)))
signal.setitimer(signal.ITIMER_REAL, 0.1, 0.1)
replies = 0
while len(ticks) < 8:
    port.write(b"N\n")
    replies += port.readline().startswith(b"n,")
signal.setitimer(signal.ITIMER_REAL, 0)
print("ticks:", len(ticks), "asked meanwhile:", replies > 8)
port.write(b"D,0,0\n")
print(port.readline())
port.close()

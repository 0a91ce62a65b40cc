"""The standard library's `sched`: a plan of absolute and relative events, with priorities, and one taken off."""

import sched
import sys
import time

import serial

robot = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyS0", 9600, timeout=1)
plan = sched.scheduler(time.monotonic, time.sleep)
start = time.monotonic()
done = []


def send(name, command):
    robot.write(command)
    reply = robot.readline().strip().decode()
    done.append(name)
    print(f"{name:8} at {time.monotonic() - start:.0f} s: {reply[:1]}")


def every(seconds, left):
    robot.write(b"N\n")
    assert robot.readline().count(b",") == 8
    if left:
        plan.enter(seconds, 5, every, (seconds, left - 1))
    else:
        done.append("watched")


plan.enter(0.0, 1, send, ("forward", b"D,4,4\n"))
plan.enterabs(start + 1.0, 2, send, ("second", b"H\n"))
plan.enterabs(start + 1.0, 1, send, ("first", b"D,4,-4\n"))
never = plan.enter(1.5, 1, send, ("never", b"D,9,9\n"))
plan.enter(2.0, 1, send, argument=("stop", b"D,0,0\n"))
plan.enter(0.1, 5, every, (0.1, 10))
plan.cancel(never)
plan.run()
print(done, plan.empty())
robot.close()

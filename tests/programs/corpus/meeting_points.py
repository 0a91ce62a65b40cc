"""Condition, Semaphore, Barrier and Event between threads: sense, think and act in step, round by round."""

import sys
import threading

import serial

ROUNDS = 12
port = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0", 19200, timeout=1)
line = threading.BoundedSemaphore(1)
fresh = threading.Condition()
step = threading.Barrier(3, action=lambda: trace.append("|"))
halt = threading.Event()
trace, reading, speeds = [], [], []


def ask(command):
    with line:
        port.write(command)
        return port.readline().strip().split(b",")


def sense():
    for _ in range(ROUNDS):
        values = [int(word) for word in ask(b"N\n")[1:]]
        with fresh:
            reading[:] = values
            trace.append("s")
            fresh.notify_all()
        step.wait()
    halt.set()


def think():
    for _ in range(ROUNDS):
        with fresh:
            assert fresh.wait_for(lambda: len(reading) == 8, timeout=5)
            speeds.append((2, 2) if max(reading[1:5]) < 900 else (-2, 2))
            reading.clear()
            trace.append("t")
            fresh.notify_all()
        step.wait(timeout=5)


def act():
    for number in range(ROUNDS):
        with fresh:
            fresh.wait_for(lambda: len(speeds) > number)
        ask(b"D,%d,%d\n" % speeds[number])
        trace.append("a")
        step.wait()


threads = [threading.Thread(target=job, name=job.__name__) for job in (act, think, sense)]
for thread in threads:
    thread.start()
print("halted:", halt.wait(timeout=20))
for thread in threads:
    thread.join()
print("in step:", "".join(trace) == "sta|" * ROUNDS, len(speeds))
print(ask(b"D,0,0\n"))
port.close()

"""`threading.Timer`: one stops the robot after a while, one was cancelled, one starts itself again and again."""

import sys
import threading

import serial

port = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "COM1", timeout=1)
guard = threading.RLock()
stopped = threading.Event()
samples = []


def ask(command):
    with guard:
        port.write(command)
        return port.readline().rstrip()


def stop(reason):
    print("stopping:", reason, ask(b"D,0,0\n"))
    stopped.set()


def sample():
    if stopped.is_set():
        return
    samples.append(ask(b"H\n"))
    again = threading.Timer(0.2, sample)
    again.daemon = True
    again.start()


print(ask(b"D,5,5\n"))
late = threading.Timer(1.3, stop, args=["time is up"])
early = threading.Timer(0.5, stop, kwargs={"reason": "too early"})
late.start()
early.start()
sample()
early.cancel()
print("waited:", stopped.wait(10), "early is over:", early.join() is None and not early.is_alive())
print("samples:", 5 <= len(samples) <= 7, "all different:", len(set(samples)) >= len(samples) - 1)
late.join()
port.close()

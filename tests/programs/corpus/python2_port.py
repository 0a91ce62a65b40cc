"""A program of 2006 that 2to3 has translated: old names of pyserial, `_thread`, string formatting, no classes."""

import _thread
import sys
import time

import serial

if len(sys.argv) > 1:
    device = sys.argv[1]
else:
    device = 0
    device = "/dev/ttyS%d" % device
ser = serial.Serial(device, 9600, timeout=1)
ser.flushInput()
ser.flushOutput()
lock = _thread.allocate_lock()
finished = _thread.allocate_lock()
finished.acquire()
log = {}


def talk(cmd):
    lock.acquire()
    try:
        ser.write((cmd + "\n").encode())
        return ser.readline().decode().strip()
    finally:
        lock.release()


def watcher(name, n):
    for i in range(n):
        rep = talk("N")
        vals = list(map(int, rep.split(",")[1:]))
        log[name, i] = vals
        time.sleep(0.05)
    finished.release()


_thread.start_new_thread(watcher, ("ir", 12))
print("%s %d" % (talk("D,3,3"), ser.isOpen()))
turns = 0
while not finished.acquire(0):
    if "h" in talk("H"):
        turns = turns + 1
    time.sleep(0.05)
print(talk("D,0,0"))
keys = list(log.keys())
keys.sort()
print("%d readings of %s, asked meanwhile: %s" % (len(keys), keys[0][0], turns > 3))
print("in buffer: %d" % ser.inWaiting())
ser.close()

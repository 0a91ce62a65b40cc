"""Does with its port whatever a program may do, as a seed has it, and prints what comes of it. Argument: the seed."""

import random
import sys
import time

import serial

chance = random.Random(int(sys.argv[1]))
port = serial.Serial("/dev/ttyS3", 9600, timeout=0.5)


COMMANDS = (b"N\n", b"D,3,2\n", b"D,8,2\n", b"H\r\n", b"\n", b"K", b"serial 38400\n", b"serial 9600\n")


def some(*values):
    return chance.choice(values)


def read() -> None:
    port.timeout = some(0, 0.001, 0.02, 0.5)
    print(port.read(chance.randrange(40)))


def read_line() -> None:
    port.timeout = some(0, 0.003, 0.2)
    print(port.readline(), port.read_until(b",", chance.randrange(1, 9)))


WHAT = {
    lambda: port.write(b"".join(chance.choices(COMMANDS, k=some(1, 1, 2, 30)))): 6,
    read: 5,
    read_line: 5,
    lambda: print(port.in_waiting, time.time(), time.monotonic_ns()): 6,
    lambda: time.sleep(some(0, 1e-6, 0.003, 0.3)): 2,
    lambda: some(port.flush, port.reset_input_buffer)(): 1,
    lambda: setattr(port, "baudrate", some(9600, 19200, 115200)): 1,
    lambda: (port.close(), port.open()): 0.3,
    lambda: port.write(b"x" * some(100, 5000, 9000)): 0.3,
}
for what in chance.choices(list(WHAT), list(WHAT.values()), k=300):
    what()
time.sleep(20)
print(time.time(), len(port.read(10_000)))

"""Does with its port whatever a program may do, as a seed has it, and prints what comes of it. Argument: the seed."""

import random
import sys
import time

import serial

chance = random.Random(int(sys.argv[1]))
port = serial.Serial("/dev/ttyS3", 9600, timeout=0.5)


def write() -> None:
    commands = [b"N\n", b"D,%d,2\n" % chance.randrange(9), b"H\r\n", b"\n", b"K", b"serial 38400\n", b"serial 9600\n"]
    port.write(b"".join(chance.choices(commands, k=chance.choice((1, 1, 2, 30)))))


def flood() -> None:
    port.write(b"x" * chance.choice((100, 5000, 9000)))


def read() -> None:
    port.timeout = chance.choice((0, 0.001, 0.02, 0.5))
    print(port.read(chance.randrange(40)))


def read_line() -> None:
    port.timeout = chance.choice((0, 0.003, 0.2))
    print(port.readline(), port.read_until(b",", chance.randrange(1, 9)))


def look() -> None:
    print(port.in_waiting, time.time(), time.monotonic_ns())


def rest() -> None:
    time.sleep(chance.choice((0, 1e-6, 0.003, 0.3)))


def reset() -> None:
    chance.choice((port.flush, port.reset_input_buffer))()


def change() -> None:
    port.baudrate = chance.choice((9600, 19200, 115200))


def hang_up() -> None:
    port.close()
    port.open()


WHAT = {write: 6, read: 5, read_line: 5, look: 6, rest: 2, reset: 1, change: 1, hang_up: 0.3, flood: 0.3}
for what in chance.choices(list(WHAT), list(WHAT.values()), k=300):
    what()
time.sleep(20)
print(time.time(), len(port.read(10_000)))

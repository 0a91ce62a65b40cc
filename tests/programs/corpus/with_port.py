"""`with serial.Serial(...)`, and each way to read a line: readline, read_until, read, iread_until and `for`."""

import sys

import serial

with serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "COM1", baudrate=9600, timeout=1) as s:
    print(s.is_open, s.baudrate, s.bytesize, s.parity, s.stopbits)
    s.write(b"G,100,200\n")
    print(s.readline())
    s.write(b"H\n")
    print(s.read_until(b","), s.read_until(expected=b"\n", size=4), s.read_until(b"\n"))
    s.write(b"H\nH\n")
    print(s.read(len("h,100,200\r\n")), s.readlines(1))
    s.write(b"N\n" * 5)
    print([line.count(b",") for line, _ in zip(s.iread_until(b"\n"), range(5))])
    s.write(b"B\n" * 3)
    answers = 0
    for line in s:
        answers += line.startswith(b"b,")
        if answers == 3:
            break
    print(answers)
    s.write(bytearray(b"D,2,2\n"))
    into = bytearray(3)
    print(s.readinto(into), bytes(into))
    s.write(memoryview(b"D,0,0\n"))
    print(s.readall())
print(s.is_open)
try:
    s.write(b"H\n")
except serial.SerialException as error:
    print(type(error).__name__)

"""A script of a user of pyserial, with its ways to read: lines, what waits, up to a text, pauses, and numpy."""

import struct
import time

import numpy as np
import serial

port = serial.Serial("COM7", baudrate=115200, bytesize=8, parity="N", stopbits=1, timeout=1, write_timeout=1)
port.write(b"\r\n")
time.sleep(0.2)
port.flushInput()
port.write(b"V\r\n")
print(port.readline(), port.readline())
port.write(b"D,300,-300\n")
print(port.read_until(b"\r\n"))
for _ in range(5):
    time.sleep(0.1)
    port.write(b"Q\n")
    time.sleep(0.05)
    print(port.in_waiting, port.read(port.in_waiting).decode().strip())
port.reset_input_buffer()
port.reset_output_buffer()
port.write(b"D,0,0\nE\nC\n")
port.flush()
print(port.read_until(expected=b"c,").splitlines(), port.read(9))
port.write(struct.pack("<bbbb", -ord("N"), -ord("Q"), -ord("a"), 0))
print(struct.unpack("<8h2h3h", port.read(26)))
port.timeout, port.inter_byte_timeout = 2, 0.05
port.write(b"J,1,40,30,8\n")
print(port.read(100))
port.write(b"\xb7\x00")
data = port.read(5000)
picture = np.frombuffer(data[3:], ">u2").reshape(data[2], data[1])
colours = np.stack([picture >> 11 << 3, (picture >> 5 & 63) << 2, (picture & 31) << 3], axis=-1).astype(np.uint8)
print(tuple(data[:3]), len(data), colours.shape, colours.mean().round(1), time.time())
port.inter_byte_timeout = None
port.write(b"K\n")
print(port.readlines(), time.time())
for line in iter(lambda: (port.write(b"N\n"), port.readline())[1], None):
    values = np.fromstring(line[2:].decode(), int, sep=",") if hasattr(np, "fromstring") else None
    print(values)
    break
port.timeout = 0
port.write(b"H\n")
text = b""
while not text.endswith(b"\n") or port.in_waiting:
    text += port.read(64)
    time.sleep(0.01)
print(len(text.splitlines()), time.time())
port.close()

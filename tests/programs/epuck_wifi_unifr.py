"""One command, one packet: the exchange of `unifr_api_epuck` (epuck2-wifi.md 7)."""

import socket
import struct
import time

UNIT = 7.536
command = bytearray(21)
command[0], command[1] = 0x80, 2
sensors = bytearray(104)


def receive(size):
    data = b""
    while len(data) < size:
        more = sock.recv(size - len(data))
        if not more:
            raise ConnectionError("closed")
        data += more
    return data


def go_on():
    """Send the command and read a packet; return whether the robot is to go on."""
    sock.sendall(command)
    command[2] = command[20] = 0
    kind = receive(1)[0]
    if kind == 1:
        pictures.append(receive(38400))
    elif kind == 2:
        sensors[:] = receive(104)
    return kind != 3


for _ in range(5):
    try:
        sock = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        sock.settimeout(10)
        sock.connect(("192.168.1.22", 1000))
        break
    except OSError:
        time.sleep(1)
pictures = []
go_on()
zeros = [0] * 8
for _ in range(75):
    go_on()
    zeros = [zero + value / 75 for zero, value in zip(zeros, struct.unpack_from("<8H", sensors, 37), strict=True)]
print([round(zero) for zero in zeros], time.time())
command[7], command[20] = 0b110000, 1
nearest = 0
for _ in range(300):
    proximity = [
        max(value - zero, 0) for value, zero in zip(struct.unpack_from("<8H", sensors, 37), zeros, strict=True)
    ]
    nearest = max(nearest, proximity[0], proximity[7])
    is_free = max(proximity[0], proximity[7], proximity[1], proximity[6]) < 100
    struct.pack_into("<hh", command, 3, *(int(speed * UNIT) for speed in ((70, 70) if is_free else (40, -40))))
    go_on()
print(round(nearest), struct.unpack_from("<hh", sensors, 79), struct.unpack_from("<3h", sensors), time.time())
command[1] = 3
while len(pictures) < 2:
    go_on()
print(len(pictures), sum(pictures[1]), time.time())
command[1:5] = bytes(4)
left = 50
for _ in range(50):
    left -= not go_on()
print(left, time.time())
sock.close()

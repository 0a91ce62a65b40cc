"""Reads the stream, and sends only when there is something to change (epuck2-wifi.md 7)."""

import select
import socket
import struct
import time

sock = socket.create_connection(("192.168.1.30", 1000), timeout=3)
sock.settimeout(1.0)


def command(request=2, left=0, right=0, leds=0, sound=0, settings=0):
    sock.send(struct.pack("<BBBhhB12sB", 0x80, request, settings, left, right, leds, bytes((0, 50, 100) * 4), sound))


def packet():
    kind = sock.recv(1)[0]
    return kind, sock.recv({1: 38400, 2: 104, 3: 0}[kind], socket.MSG_WAITALL) if kind != 3 else b""


try:
    print(sock.recv(1))
except TimeoutError:
    print("silent before the first command", time.time())
command(left=500, right=500)
for count in range(100):
    kind, data = packet()
    if count == 50:
        command(left=-200, right=200, leds=0x3F, sound=2)
print(kind, struct.unpack_from("<2h", data, 79), data[89], time.time())
command(request=3)
print([packet()[0] for _ in range(9)], time.time())
command(request=0)
while (kind := packet()[0]) != 3:
    pass
print(kind, [packet()[0] for _ in range(3)], time.time())
sock.settimeout(10)
command(request=2, settings=1)
command(request=2)
print([packet()[0] for _ in range(3)], time.time())
command(request=2, settings=4, left=1000, right=-1000)
command(request=2)
time.sleep(0.5)

# Another manner: take whatever has come, keep the last packet.
buffer = b""
while select.select([sock], [], [], 0.05)[0] and len(buffer) < 40_000:
    buffer += sock.recv(4096)
    if time.time() > 6.5:
        break
last = buffer[len(buffer) // 105 * 105 - 105 :][:105]
print(last[0], struct.unpack_from("<2h", last, 80), len(buffer) // 105 > 10, time.time())
sock.close()

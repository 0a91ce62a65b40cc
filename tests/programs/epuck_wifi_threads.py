"""A thread for each of two robots, which connect again when the connection is gone (epuck2-wifi.md 7)."""

import socket
import struct
import threading
import time

lock = threading.Lock()


class Robot(threading.Thread):
    def __init__(self, address):
        super().__init__(name=address)
        self.address, self.sock = address, None
        self.command = bytearray((0x80, 2, *[0] * 19))
        self.said, self.trouble = [], 0

    def connect(self):
        for _ in range(5):
            try:
                self.sock = socket.socket()
                self.sock.settimeout(10)
                self.sock.connect((self.address, 1000))
                self.sock.settimeout(None)
                return
            except OSError:
                time.sleep(0.5)
        raise SystemExit("cannot connect")

    def packet(self):
        self.sock.sendall(self.command)
        kind = self.sock.recv(1)
        if kind == b"\x02":
            data = bytearray(104)
            view = memoryview(data)
            while view:
                view = view[self.sock.recv_into(view) :]
            return data
        self.said.append(("unexpected", kind))
        return None

    def run(self):
        self.connect()
        for count in range(120):
            try:
                data = self.packet()
            except OSError:
                self.trouble += 1
                self.sock.close()
                self.connect()
                continue
            if data is None:
                continue
            proximity = struct.unpack_from("<8H", data, 37)
            self.command[7] = 0x10 if max(proximity) >= 200 else 0
            struct.pack_into("<hh", self.command, 3, 300, 300 if count < 60 else -300)
            if count % 40 == 39:
                self.said.append((max(proximity), struct.unpack_from("<2h", data, 79), round(time.time(), 3)))
            if count == 60:
                self.sock.shutdown(socket.SHUT_RDWR)
        self.command[3:7] = bytes(4)
        self.packet()
        self.sock.close()


robots = [Robot(f"192.168.1.{host}") for host in (20, 21)]
for robot in robots:
    robot.start()
for robot in robots:
    robot.join()
for robot in robots:
    print(robot.name, robot.trouble, *robot.said)
print(time.time())

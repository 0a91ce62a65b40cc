"""A line to an e-puck as the programs beside this one open it: a serial port, Bluetooth, or TCP."""

import socket

import bluetooth
import serial

PLACES = {"serial": "/dev/rfcomm0", "bluetooth": "10:00:E8:6C:A2:B6", "tcp": ("192.168.1.2", 1000)}


class Line:
    """Sends bytes and gets those that have come, or none after a time."""

    def __init__(self, way, timeout_s):
        self.port = getattr(self, way)(PLACES[way], timeout_s)

    def serial(self, name, timeout_s):
        port = serial.Serial(name, 115200, timeout=timeout_s)
        self.send, self.close = port.write, port.close
        self.receive = lambda size: self.from_serial(port, size)
        return port

    @staticmethod
    def from_serial(port, size):
        first = port.read(1)
        return first + port.read(min(port.in_waiting, size - 1)) if first else b""

    def bluetooth(self, address, timeout_s):
        sock = bluetooth.BluetoothSocket(bluetooth.RFCOMM)
        sock.connect((address, 1))
        return self.of_socket(sock, timeout_s)

    def tcp(self, place, timeout_s):
        return self.of_socket(socket.create_connection(place, timeout_s), timeout_s)

    def of_socket(self, sock, timeout_s):
        sock.settimeout(timeout_s)
        self.send, self.close = sock.send, sock.close
        self.receive = lambda size: self.from_socket(sock, size)
        return sock

    @staticmethod
    def from_socket(sock, size):
        try:
            return sock.recv(size)
        except OSError as error:
            if "timed out" not in str(error):
                raise
            return b""

    def exactly(self, size):
        """Read so many bytes, or fewer if they do not come."""
        data = b""
        while len(data) < size and (more := self.receive(size - len(data))):
            data += more
        return data

    def lines(self, count):
        """Read up to the end of so many lines."""
        data = b""
        while data.count(b"\n") < count and (more := self.receive(1)):
            data += more
        return data

    def until_silence(self):
        """Read until nothing has come for the timeout."""
        data = b""
        while more := self.receive(4096):
            data += more
        return data

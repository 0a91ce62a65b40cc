"""Drives its robot by a line of any kind, as a seed has it, and prints what comes of it. Arguments: way and seed."""

import random
import socket
import sys
import time

import bluetooth
import serial

ADDRESS, PLACE = "10:00:E8:6C:A2:B6", ("192.168.1.2", 1000)


def by_serial():
    port = serial.Serial("/dev/ttyUSB0", 9600, timeout=0.5)
    return port, port.write, port.read


def by_pybluez():
    port = bluetooth.BluetoothSocket(bluetooth.RFCOMM)
    port.connect((ADDRESS, 1))
    port.settimeout(0.5)
    return port, port.send, port.recv


def by_bluetooth():
    port = socket.socket(socket.AF_BLUETOOTH, socket.SOCK_STREAM, socket.BTPROTO_RFCOMM)
    port.settimeout(0.5)
    port.connect((ADDRESS, 1))
    return port, port.sendall, port.recv


def by_tcp():
    port = socket.create_connection(PLACE, timeout=0.5)
    port.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return port, port.sendall, port.recv


port, send, receive = globals()[f"by_{sys.argv[1]}"]()
chance = random.Random(int(sys.argv[2]))


def ask() -> None:
    send(chance.choice((b"N\n", b"D,%d,2\n" % chance.randrange(9), b"H\r\n", b"B\n")))
    line = b""
    while not line.endswith(b"\n"):
        # No reply is shorter.
        line += receive(1 if line else chance.randrange(1, 4))
    print(line, time.time())


def wait_in_vain() -> None:
    try:
        print(receive(1))
    except OSError as error:
        print(b"", *["wrong"] * (str(error) != "timed out"))


for what in chance.choices((ask, lambda: time.sleep(chance.random()), wait_in_vain), (8, 2, 1), k=60):
    what()
port.close()

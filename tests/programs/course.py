"""Drives a short course, as a program for a real Khepera does, and prints the encoder counts. Argument: the port."""

import sys

import serial

port = serial.serial_for_url(sys.argv[1], baudrate=9600, stopbits=serial.STOPBITS_TWO, timeout=10)


def ask(command: str) -> str:
    port.write(command.encode() + b"\n")
    reply = port.readline()
    if not reply.startswith(command[0].lower().encode()):
        raise SystemExit(f"{command!r} was answered {reply!r}")
    return reply.decode().strip()


ask("D,8,5")
for _ in range(40):
    ask("N")
ask("D,0,0")
ask("C,400,300")
for _ in range(60):
    ask("E")
print(ask("H"))
port.close()

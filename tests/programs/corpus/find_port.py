"""Looks for the robot with `serial.tools.list_ports`, unless somebody says where it is."""

import sys

import serial
from serial.tools import list_ports


def find_robot():
    """Return the first adapter that is made by FTDI, or else whatever says that it is USB."""
    ports = sorted(list_ports.comports())
    for info in ports:
        if info.vid == 0x0403:
            return info.device
    for info in ports:
        if "USB" in info.description or "ttyUSB" in info.device:
            return info.device
    raise SystemExit("no robot found, I see only: " + ", ".join(each.device for each in ports))


name = sys.argv[1] if len(sys.argv) > 1 else find_robot()
ser = serial.Serial(name, 9600, timeout=1)
ser.write(b"B\n")
answer = ser.readline().decode().strip()
if not answer.startswith("b,"):
    sys.exit(f"that is no Khepera: {answer!r}")
print("BIOS", answer[2:])
for command in ("D,5,5", "N", "D,0,0"):
    ser.write(f"{command}\n".encode())
    print(command, "->", ser.readline().decode()[0])
ser.close()

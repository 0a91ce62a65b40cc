"""A panel in the terminal: `curses` with a time limit for keys; q would end it, a count of rounds does."""

import curses
import sys
import time

import serial

ser = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0", 19200, timeout=1)


def ask(command):
    ser.write(command.encode("ascii") + b"\n")
    return ser.readline().decode("ascii").strip()


def panel(screen):
    curses.curs_set(0)
    screen.timeout(100)
    began = time.monotonic()
    keys = 0
    for number in range(12):
        screen.erase()
        screen.addstr(0, 0, f"round {number}")
        for row, value in enumerate(ask("N").split(",")[1:], 2):
            screen.addstr(row, 0, f"{int(value):5} " + "#" * (int(value) // 60))
        screen.refresh()
        key = screen.getch()
        if key == ord("q"):
            break
        keys += key != -1
    return number + 1, keys, time.monotonic() - began


ask("D,2,2")
rounds, keys, seconds = curses.wrapper(panel)
print(ask("D,0,0"), rounds, "rounds,", keys, "keys, time enough:", seconds >= 1.2)
ser.close()

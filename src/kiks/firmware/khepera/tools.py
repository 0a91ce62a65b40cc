"""The tool words: lower-case commands for a person at a terminal (khepera-protocol.md 5). The texts are ours."""

from __future__ import annotations

import re
from collections.abc import Callable

from kiks.firmware.firmware import Firmware
from kiks.firmware.khepera.commands import COMMANDS

PROTOCOL_MODE = "Serial Communication Protocol"

Tool = Callable[[Firmware, list[str]], bytes]
"""Carries a tool out: takes the words behind its name, and returns what the robot prints."""

BAUDS = (9600, 19200, 38400, 57600, 115200)
"""Line speeds that the robots know [bit/s] (khepera-protocol.md section 1)."""


def text(*lines: str) -> bytes:
    """Return lines as the robot prints them."""
    return "".join(f"{line}\r\n" for line in lines).encode()


def banner(robot: Firmware) -> bytes:
    """Return what the robot prints when it starts in protocol mode (khepera-protocol.md 2.4)."""
    firmware = robot.spec.firmware
    return text(f"KiKS, {robot.spec.name}", f"{firmware.banner}, Rev. {firmware.bios_version}", PROTOCOL_MODE)


def run(robot: Firmware, line: bytes) -> bytes | None:
    """Carry out a tool; return what it prints, or None if the first word names none."""
    # Blanks are blanks and tabs: `str.split` would take control characters for blanks, too.
    words = re.split("[ \t]+", line.decode("latin-1").strip(" \t"))
    return TOOLS[words[0]][1](robot, words[1:]) if words[0] in _summary(robot) else None


def _summary(robot: Firmware) -> dict[str, str]:
    """Return the line on each tool that a robot has."""
    has_flash = robot.spec.firmware.has_user_flash
    return {name: line for name, (line, _) in TOOLS.items() if name != "flash" or has_flash}


def _help(robot: Firmware, words: list[str]) -> bytes:
    summary = _summary(robot)
    if not words:
        return text(*summary.values())
    if words[0] in summary:
        return text(summary[words[0]])
    for command in COMMANDS:
        if command.letter == words[0]:
            return text(f"{command.syntax}: {command.name}")
    return text("help: no tool or command of that name")


def _list(robot: Firmware, words: list[str]) -> bytes:
    revision = robot.spec.firmware.bios_version
    rows = [f"PR_{c.letter}  {c.name}, {revision}" for c in COMMANDS]
    rows += [f"TO{number:02d}  {name}, {revision}" for number, name in enumerate(_summary(robot))]
    return text("ID    description, version", *rows, f"FU00  demo, {revision}", f"BI00  BIOS, {revision}")


def _net(robot: Firmware, words: list[str]) -> bytes:
    rows = [f"{t.name}, ID {t.number}, revision {t.revision[0]}.{t.revision[1]}" for t in robot.turrets.values()]
    return text(*(rows or ["No intelligent turret"]))


def _process(robot: Firmware, words: list[str]) -> bytes:
    revision = robot.spec.firmware.bios_version
    running = ["Idle", "Motor control", "Sensor scan", PROTOCOL_MODE]
    if robot.wakes_ns is not None:
        running.append("Demonstration")
    return text(*(f"Process {n}. {n * 1024:08d}  {name}, Rev. {revision}" for n, name in enumerate(running)))


def _memory(robot: Firmware, words: list[str]) -> bytes:
    return text("ROM   16'0001C000, used 87%", "RAM 1 16'00102400, used 14%", "RAM 2 16'00200800, used 02%")


def _k_team(robot: Firmware, words: list[str]) -> bytes:
    return text("The Khepera was made by K-Team, Switzerland; this one is simulated by KiKS")


def _serial(robot: Firmware, words: list[str]) -> bytes:
    if len(words) != 1 or words[0] not in map(str, BAUDS):
        return text(f"serial: one of {', '.join(map(str, BAUDS))}")
    robot.baud = int(words[0])
    return text(f"Line at {robot.baud} baud")


def _restart(robot: Firmware, words: list[str]) -> bytes:
    robot.reset()
    return banner(robot)


def _run(robot: Firmware, words: list[str]) -> bytes:
    if words == ["demo"]:
        robot.wakes_ns = robot.now_ns
        return text("Demonstration: obstacle avoidance; restart ends it")
    if words == ["sloader"]:
        return _load(robot, words)
    if words == ["user-flash"]:
        return text("No user application in flash")
    return text("run: one of demo, sloader, user-flash")


def _load(robot: Firmware, words: list[str]) -> bytes:
    return text("S format Motorola loader mode", "S: this robot loads no code; download terminated")


def _flash(robot: Firmware, words: list[str]) -> bytes:
    if words == ["E"]:
        return text("Flash erased")
    if words == ["W"]:
        return text("Flash written")
    return text("flash: E or W")


TOOLS: dict[str, tuple[str, Tool]] = {
    "help": ("help [name]: this list, or a line on one tool or command letter", _help),
    "list": ("list: the modules in ROM", _list),
    "net": ("net: the intelligent turrets that are fitted", _net),
    "process": ("process: what is running", _process),
    "memory": ("memory: use of ROM and RAM", _memory),
    "k-team": ("k-team: who made the robot", _k_team),
    "serial": ("serial <baud>: change the speed of the line at once", _serial),
    "restart": ("restart: the same as the reset button", _restart),
    "run": ("run <function>: start a function in ROM: demo, sloader, user-flash", _run),
    "sfill": ("sfill: load S-records without starting them", _load),
    "flash": ("flash E | flash W: erase or write the user's flash memory", _flash),
}
"""For each tool the line that `help` prints, and what carries it out."""

"""The e-puck as a kind of robot."""

from __future__ import annotations

from dataclasses import replace

from kiks.firmware.epuck.commands import COMMANDS
from kiks.firmware.epuck.firmware import EPuckFirmware
from kiks.firmware.epuck.looks import lit, looks
from kiks.firmware.robot_kind import RobotKind

_PLACES = [("right", angle) for angle in (17, 50, 90, 150)] + [("left", angle) for angle in (150, 90, 50, 17)]

EPUCK = RobotKind(
    firmware=EPuckFirmware,
    commands=COMMANDS,
    usual="DNQOA",
    speeds=b"D,%d,%d\n",
    speeds_reply=b"d\r\n",
    speed_max=1000,  # epuck-protocol.md 1
    # The zero of the accelerometer differs from program to program, so controllers do without it.
    senses={each.sense: each.letter for each in COMMANDS if each.sense not in ("", "accelerometer")},
    counts_max=4095,  # epuck-protocol.md 6.2
    speed_scale=62.1,  # steps of 0.1288 mm in 8 mm
    sensor_order=(5, 6, 7, 0, 1, 2, 3, 4),
    scales={"proximity": 1023 / 4095, "ambient": 450 / 4000},  # the dark of both robots is 450 for controllers
    sensor_names=tuple(f"{side} {angle}" for side, angle in _PLACES),  # 6.1
    looks=looks,
    lit=lit,
)

EPUCK_BTCOM = replace(EPUCK, senses={name: letter for name, letter in EPUCK.senses.items() if name != "ground"})
"""With an older program, which tells of three floor sensors: a sense has as many readings on each robot."""

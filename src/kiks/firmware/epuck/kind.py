"""The e-puck as a kind of robot."""

from __future__ import annotations

from kiks.firmware.epuck.commands import COMMANDS
from kiks.firmware.epuck.firmware import EPuckFirmware
from kiks.firmware.robot_kind import RobotKind

_PLACES = [("right", angle) for angle in (17, 50, 90, 150)] + [("left", angle) for angle in (150, 90, 50, 17)]

EPUCK = RobotKind(
    firmware=EPuckFirmware,
    commands=COMMANDS,
    usual="DNQOA",
    speeds=b"D,%d,%d\n",
    speeds_reply=b"d\r\n",
    speed_max=1000,  # epuck-protocol.md 1
    senses={command.sense: command.letter for command in COMMANDS if command.sense},
    counts_max=4095,  # epuck-protocol.md 6.2
    speed_scale=8.0 / 0.1288,  # mm a step (epuck-protocol.md 1)
    scales={"proximity": 1023 / 4095, "ambient": 1023 / 4095, "positions": 0.1288 / 0.08},
    sensor_names=tuple(f"{side} {angle}" for side, angle in _PLACES),  # 6.1
)

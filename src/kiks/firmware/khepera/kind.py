"""The Khepera as a kind of robot; the Khepera II speaks the same protocol."""

from __future__ import annotations

from operator import itemgetter

from kiks.engine.physics.motor import SPEED_MAX
from kiks.firmware.khepera.commands import COMMANDS
from kiks.firmware.khepera.firmware import KheperaFirmware
from kiks.firmware.khepera.looks import looks
from kiks.firmware.robot_kind import RobotKind

KHEPERA = RobotKind(
    firmware=KheperaFirmware,
    commands=COMMANDS,
    usual="DNOHL",
    speeds=b"D,%d,%d\n",
    speeds_reply=b"d\r\n",
    speed_max=SPEED_MAX,
    senses={command.sense: command.letter for command in COMMANDS if command.sense}
    | {"camera": "T,2,T", "barrier": "T,1,G", "floor": "T,31,F"},
    counts_max=1023,  # khepera-protocol.md 8.4
    sensor_names=(
        "left 90",
        "left 45",
        "left 10",
        "right 10",
        "right 45",
        "right 90",
        "back right",
        "back left",
    ),  # 7.4
    looks=looks,
    lit=itemgetter("led"),
)

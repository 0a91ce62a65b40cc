"""The kinds of robots that KiKS knows."""

from __future__ import annotations

ROBOT_KINDS = {
    "khepera": "kiks.firmware.khepera.kind:KHEPERA",
    "epuck": "kiks.firmware.epuck.kind:EPUCK",
}
"""For the name of each in robots' files where its `RobotKind` is: `model` knows no firmware."""

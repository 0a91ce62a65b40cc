"""The kinds of robots that KiKS knows."""

from __future__ import annotations

ROBOT_KINDS = {"khepera": "kiks.firmware.khepera.kind:KHEPERA"}
"""For the name of each in robots' files where its `RobotKind` is: `model` knows no firmware."""

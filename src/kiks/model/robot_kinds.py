"""The kinds of robots that KiKS knows."""

from __future__ import annotations

ROBOT_KINDS = {
    "khepera": "kiks.firmware.khepera.kind:KHEPERA",
    "epuck": "kiks.firmware.epuck.kind:EPUCK",
    "epuck_wifi": "kiks.firmware.epuck.wifi:EPUCK_WIFI",
}
"""For the name of each in robots' files where its `RobotKind` is: `model` knows no firmware."""

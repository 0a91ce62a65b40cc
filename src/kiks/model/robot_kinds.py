"""The kinds of robots that KiKS knows, and the names of its robots."""

from __future__ import annotations

from pathlib import Path

ROBOT_KINDS = {
    "khepera": "kiks.firmware.khepera.kind:KHEPERA",
    "epuck": "kiks.firmware.epuck.kind:EPUCK",
    "epuck_btcom": "kiks.firmware.epuck.kind:EPUCK_BTCOM",
    "epuck_wifi": "kiks.firmware.epuck.wifi:EPUCK_WIFI",
}
"""For the name of each in robots' files where its `RobotKind` is: `model` knows no firmware."""

ROBOT_FILES = Path(__file__).with_name("robots")
"""The folder with a file for each robot that comes with KiKS."""

ROBOT_NAMES = tuple(sorted(path.stem for path in ROBOT_FILES.glob("*.toml")))
"""The names of these."""

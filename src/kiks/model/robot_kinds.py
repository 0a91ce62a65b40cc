"""The robots that come with KiKS, and the kinds that it knows."""

from __future__ import annotations

from pathlib import Path

FOLDER = Path(__file__).with_name("robots")

ROBOTS = tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))
"""The names of those that come with KiKS."""

ROBOT_KINDS = {
    "khepera": "kiks.firmware.khepera.kind:KHEPERA",
    "epuck": "kiks.firmware.epuck.kind:EPUCK",
    "epuck_wifi": "kiks.firmware.epuck.wifi:EPUCK_WIFI",
}
"""For the name of each in robots' files where its `RobotKind` is: `model` knows no firmware."""

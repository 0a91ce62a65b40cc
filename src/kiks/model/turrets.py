"""The turrets that come with KiKS."""

from __future__ import annotations

TURRETS = {
    "k213": "kiks.firmware.k213.K213",
    "gripper": "kiks.firmware.gripper.Gripper",
    "radio": "kiks.firmware.radio.Radio",
    "io": "kiks.firmware.general_io.GeneralIO",
    "battle": "kiks.firmware.battle.Battle",
    "floor": "kiks.firmware.floor.Floor",
}
"""For the name of each in files and commands the class that is its firmware (the page "Turrets").

The class stands here as text, as `model` knows no firmware. `kiks.sim.turret_host` imports it.
"""

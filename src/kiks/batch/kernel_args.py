"""The arguments of a batch's kernels: all its worlds, and what the worlds of a block share."""

from __future__ import annotations

from collections import namedtuple
from typing import Any

Worlds: Any = namedtuple(
    "Worlds",
    (
        "scene",
        "lamps",
        "seeds",
        "ticks",
        "begins_ns",
        "watched_ns",
        "sensed_ns",
        "steps",
        "sensors",
        "wheels",
        "memory",
        "parameters",
        "notes",
    ),
)
"""All worlds of a batch.

* scene: the scene (`kiks.engine.scene`);
* lamps: float64 [world, lamp, 4];
* seeds: int64 [world];
* ticks: ticks done, int64 [world];
* begins_ns: when the present loop began [ns], int64 [world];
* watched_ns: when measures were last called [ns], int64 [world];
* sensed_ns: when the last reply of the present loop had arrived [ns], int64 [world];
* steps: loops done, int64 [world];
* sensors: the last readings, float64 [world, robot, sensor];
* wheels: the last sent speeds [pulses/10 ms], float64 [world, robot, 2];
* memory: memory of the controllers, float64 [world, robot, number];
* parameters: parameters of the controllers, float64 [world, robot, number];
* notes: state slots of the measures, float64 [world, robot, note].
"""

CollidingPlace: Any = namedtuple("CollidingPlace", ("ground", "sight", "networks", "line", "sense_codes"))
"""What the worlds of a block share, if things in them may collide.

* ground, sight: the walls as contact and as rays see them (`kiks.sim.world`);
* networks: the tables for the responses of the sensors (`kiks.engine.sensing.thesis_networks`);
* line: the serial lines (`kiks.batch.loop_timing.Line`);
* sense_codes: the senses, `PROXIMITY` or `AMBIENT`, int64 [sense].
"""

LonePlace: Any = namedtuple("LonePlace", ("ground", "sight", "networks", "line", "sense_codes"))
"""What the worlds of a block share, if each holds one robot and nothing else that moves."""

PROXIMITY, AMBIENT = 0, 1
"""Senses in the order of `kiks.control.controller.SENSES`."""

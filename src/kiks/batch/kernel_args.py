"""The arguments of a batch's kernels: all its worlds, and the place of a block of them."""

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
* watched_ns: when measures last looked [ns], int64 [world];
* sensed_ns: when the last reply of the present loop had arrived [ns], int64 [world];
* steps: loops done, int64 [world];
* sensors: what was sensed last, float64 [world, robot, sensor];
* wheels: speeds that were sent last [pulses/10 ms], float64 [world, robot, 2];
* memory: of the controllers, float64 [world, robot, number];
* parameters: of the controllers, float64 [world, robot, number];
* notes: of the measures, float64 [world, robot, note].
"""

Together: Any = namedtuple("Together", ("ground", "sight", "networks", "line", "sense_codes"))
"""The place of a block of worlds in which things may collide.

* ground, sight: the walls as contact and as rays see them (`kiks.sim.world`);
* networks: what responses of the sensors need (`kiks.engine.sensing.thesis_networks`);
* line: the serial lines (`kiks.batch.loop_timing.Line`);
* sense_codes: what is sensed, `PROXIMITY` or `AMBIENT`, int64 [sense].
"""

Alone: Any = namedtuple("Alone", ("ground", "sight", "networks", "line", "sense_codes"))
"""The place of a block of worlds with one robot each and nothing else that moves."""

PROXIMITY, AMBIENT = 0, 1
"""Senses in the order of `kiks.control.controller.SENSES`."""

"""What each model of the sensors answers to the poses of a table of samples: KiKS's own and the published ones.

All of them get the same poses and give counts of the shape [gaps, angles, 8]. The published formulas are kept here as
they were published, with the mounts of khepera-protocol.md 7.4; they serve as competitors and nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from tools.sensors.train_networks import PLACES, fan_of

from kiks.engine.parameters import pack
from kiks.engine.sensing import thesis_networks
from kiks.engine.sensing.responses import respond_all
from kiks.fit.samples import MAXIMUM_COUNTS, Fan, Floats, Samples, meet, nearnesses
from kiks.model.robot import SENSOR_COUNT, RobotSpec
from kiks.model.thesis_networks import BODY_RADIUS_MM, NetworkResponse

Model = Callable[[Samples], Floats]

_CELL_MM = 0.25
_ROOM_MM = 100.0  # what a model may look at around the robot
_PLAN = PLACES["protocol"]


def default(samples: Samples, response: str | None = None) -> Floats:
    """Answer as the simulated robot does: it is put in front of the object in an arena, and its sensors are asked.

    Args:
        samples: The poses.
        response: What makes counts of its rays; that of its file if left out.
    """
    from kiks.model.arena import Arena
    from kiks.sim.simulation import Simulation

    side_mm = 2 * (BODY_RADIUS_MM + float(samples.gap_mm.max()) + _ROOM_MM)
    cells = math.ceil(side_mm / _CELL_MM)
    centre_mm = cells // 2 * _CELL_MM
    # The object stands in the positive x direction, its nearest point in the middle of the arena.
    x = (np.arange(cells) + 0.5) * _CELL_MM - centre_mm
    if math.isinf(samples.radius_mm):
        inside = np.broadcast_to(x >= 0.0, (cells, cells))
    else:
        inside = np.hypot(x - samples.radius_mm, x[:, None]) <= samples.radius_mm
    sim = Simulation(Arena(inside.astype(np.uint8) * 255, _CELL_MM, samples.name), response=response)
    poses = np.empty((*samples.counts.shape[:-1], 3))
    poses[..., 0] = centre_mm - BODY_RADIUS_MM - samples.gap_mm[:, None]
    poses[..., 1] = centre_mm
    poses[..., 2] = np.radians(samples.angle_deg)
    return sim.proximity_at(1, poses.reshape(-1, 3)).reshape(samples.counts.shape)


def thesis(samples: Samples, response: NetworkResponse | None = None) -> Floats:
    """Answer with the thesis's networks; those that come with KiKS if left out."""
    response = response or NetworkResponse.load()
    return _answer("thesis", samples, response, thesis_networks.pack_networks(response))


def fast(samples: Samples) -> Floats:
    """Answer with the thesis's table of 6^7 entries, made from the networks that come with KiKS."""
    return _answer("fast", samples, NetworkResponse.load(), thesis_networks.networks_for("fast"))


def _answer(name: str, samples: Samples, response: NetworkResponse, packed: NDArray[np.void]) -> Floats:
    lengths_mm, cosines = (part.reshape(-1, *part.shape[2:]) for part in meet(samples, fan_of(response)))
    packed.setflags(write=False)  # a kernel that takes arrays of two types is compiled twice
    kind = pack(RobotSpec.load("khepera", response=name))
    kind["range_mm"] = response.range_mm
    counts = np.empty(samples.counts.shape, np.float64)
    respond_all(packed, kind, lengths_mm, cosines, counts.reshape(-1, SENSOR_COUNT))
    return counts


def webots(samples: Samples) -> Floats:
    """Answer with one ray for each sensor: 1023 at 0 mm, falling on a line to 0 at 50 mm (Webots' Khepera)."""
    fan = Fan.spread(*_PLAN, offsets_deg=(0.0,))
    return MAXIMUM_COUNTS * nearnesses(samples, fan)[..., 0]


def enki(samples: Samples) -> Floats:
    """Answer with Enki's three rays: f(x) = (c - a^2) m / (x^2 - 2 a x + c) with m 1200, a -0.9, c 7 and x in cm.

    The rays are added, less twice what one at +-15 degrees would give if the middle one stands upright on a wall.
    Enki's own mounts, which are for a robot with a radius of 26 mm, are kept; readings end at 1023.
    """
    place_mm = np.array(
        [(10, 15), (13, 13), (16, 6), (16, -6), (13, -13), (10, -15), (-15, -10), (-15, 10)], np.float64
    )
    direction = np.radians([90.0, 45.0, 0.0, 0.0, -45.0, -90.0, 180.0, 180.0])
    fan = Fan(place_mm, np.add.outer(direction, np.radians([15.0, 0.0, -15.0])), 100.0)
    length_cm = meet(samples, fan)[0] / 10.0

    def answer(x: Floats) -> Floats:
        return np.where(x < 10.0, 1200.0 * (7.0 - 0.81) / (x * x + 1.8 * x + 7.0), 0.0)

    middle = length_cm[..., 1]
    double = np.where(middle < 10.0, 2.0 * answer(middle / math.cos(math.radians(15.0))), 0.0)
    return np.asarray(np.clip(answer(length_cm).sum(axis=-1) - double, 0.0, MAXIMUM_COUNTS))


def neighbours(samples: Samples) -> Floats:
    """Answer with the mean of the two readings next to each: what is left is about the noise of the data."""
    counts = samples.counts.astype(np.float64)
    return (np.roll(counts, 1, axis=1) + np.roll(counts, -1, axis=1)) / 2


MODELS: dict[str, tuple[str, Model]] = {
    "default": ("KiKS (default)", default),
    "thesis": ("thesis networks", thesis),
    "fast": ("thesis, fast table", fast),
    "webots": ("Webots, one ray", webots),
    "enki": ("Enki, three rays", enki),
    "floor": ("neighbouring samples", neighbours),
}
"""The models on the card: their keys, what people call them, and how they answer."""

"""The delay of a link that is not a cable: a law of chance with a seed."""

from __future__ import annotations

import math

from kiks.clock.serial_timing import Delay
from kiks.engine.scalar_math import exponential, logarithm, power, sin_cos, uniform
from kiks.model.radio_link import RadioLink

STREAM_LINK = 40
"""Random stream of the delays of pieces."""

PACKET_CHARACTERS = 1460
"""Most characters of a packet: those of TCP in a frame of Ethernet."""

SPREAD = 1.6
"""Standard deviation of the logarithm of the jitter, which fits that of Wi-Fi (the page "Time")."""

_NORMAL_95 = 1.6448536269514722  # 95 % of a normal distribution are below so many standard deviations


def delay_of(link: RadioLink, seed: int, robot: int) -> Delay | None:
    """Return the law of a robot's link; None for a cable.

    A piece is what is sent in one go. All of it is late by the latency, a log-normal jitter, and one retry for each
    time that a packet of it is lost. Both RFCOMM and TCP are streams, so nothing is missing, and none overtakes.

    Args:
        link: The link.
        seed: The seed of the world.
        robot: The robot's index.
    """
    if not (link.latency_ms or link.jitter_ms or link.loss):
        return None
    typical_ms = link.jitter_ms * exponential(-_NORMAL_95 * SPREAD)

    def delay_ns(direction: int, count: int, at_ns: int) -> int:
        u, v, w = (uniform(seed, 0, robot, STREAM_LINK, at_ns, 3 * direction + k) for k in range(3))
        normal = math.sqrt(-2.0 * logarithm(1.0 - u)) * sin_cos(2.0 * math.pi * v)[1]  # Box and Muller
        late_ms: float = link.latency_ms + typical_ms * exponential(SPREAD * normal)
        lost = 1.0 - power(1.0 - link.loss, float(-(-count // PACKET_CHARACTERS)))
        while w < lost:
            late_ms += link.retry_ms
            lost *= link.loss
        return round(late_ms * 1e6)

    return delay_ns

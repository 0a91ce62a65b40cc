"""A family of imperfect robots: the same kind, each a little different, as robots from one shelf are."""

from __future__ import annotations

import numpy as np

from kiks.model.checks import check_count, check_number
from kiks.model.robot import SENSOR_COUNT, RobotSpec


def family(
    spec: RobotSpec,
    count: int,
    *,
    seed: int,
    gain_spread: float = 0.2,
    wheel_spread: float = 0.02,
    motor_spread: float = 0.03,
    dead_share: float = 0.0,
) -> list[RobotSpec]:
    """Return robots of a kind that differ at random, for worlds of a `kiks.Batch`.

    What is evolved on a family does not lean on one robot's faults. The defaults are estimates: sensors of one Khepera
    differ by a fifth (the page "Calibrating your own robot"), wheels and motors by a few hundredths.

    Args:
        spec: The kind.
        count: How many robots.
        seed: Seed of the differences.
        gain_spread: By what share the gain of each proximity sensor is larger or smaller at most, evenly spread.
        wheel_spread: The same of the path that a wheel makes for a pulse.
        motor_spread: The same of each motor's gain.
        dead_share: Share of proximity sensors that see nothing.

    Example:
        >>> robots = family(RobotSpec.load("khepera"), 3, seed=1)
        >>> len({robot.body.pulse_mm for robot in robots})
        3
    """
    check_count("count", count, 1)
    shares = {"gain_spread": gain_spread, "wheel_spread": wheel_spread, "motor_spread": motor_spread}
    for name, share in (shares | {"dead_share": dead_share}).items():
        check_number(name, share, 0.0, 0.9)
    rng = np.random.default_rng(seed)

    def spread(share: float, values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple((np.array(values) * (1.0 + share * rng.uniform(-1.0, 1.0, len(values)))).tolist())

    robots = []
    for _ in range(count):
        gains = np.array(spread(gain_spread, spec.proximity.gain))
        gains[rng.random(SENSOR_COUNT) < dead_share] = 0.0
        left_gain, right_gain = spread(motor_spread, (spec.motor.left_gain, spec.motor.right_gain))
        (pulse_mm,) = spread(wheel_spread, (spec.body.pulse_mm,))
        robots.append(
            spec.with_changes(
                proximity__gain=tuple(gains.tolist()),
                body__pulse_mm=pulse_mm,
                motor__left_gain=left_gain,
                motor__right_gain=right_gain,
            )
        )
    return robots

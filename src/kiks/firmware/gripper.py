"""The gripper, turret 1: its answers to orders (khepera-protocol.md 10.2); its physics is in the engine.

The notes leave open, and we chose: power on with the arm upright and the jaws open; the resistivity is 255 with nothing
between the jaws, else as the brightness of what is there, which is all that KiKS knows of a material; the barrier is 0
or 255; no jumper is set. A reset of the robot does not move the gripper.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from kiks.engine.physics.gripper import (
    ARM_MAX,
    ARM_START,
    BARRIER_BROKEN,
    GAP_MM,
    GAP_PER_STEP,
    JAW_LENGTH_MM,
    JAWS_MAX,
)
from kiks.engine.scalar_math import sin_cos
from kiks.firmware.turret import Orders, Shape, Site, Turret, Values

INSULATOR = 255
"""The largest resistivity: that of air."""

PIVOT_MM = -15.0
"""Where the arm turns, behind the robot's centre [mm]: 'near the back of the robot' (khepera-protocol.md 10.2)."""

START_RAD, RAD_PER_STEP = -0.17453292519943295, 3.490658503988659 / ARM_MAX
"""The arm's angle at 0, from straight back, and for each step: -10 degrees and 200 degrees in all (10.2)."""


def _move_jaws(gripper: Gripper, is_closing: int) -> Values | None:
    """D: open (0) or close (1) the jaws."""
    if is_closing not in (0, 1):
        return None
    gripper.site.record["is_closing"] = is_closing
    return ()


def _move_arm(gripper: Gripper, position: int) -> Values:
    """E: move the arm; 255 is down in front, 127 upright, 0 folded back. What is beyond is clamped."""
    gripper.site.record["arm_target"] = min(max(position, 0), int(ARM_MAX))
    return ()


def _read_resistivity(gripper: Gripper) -> Values:
    """F: the resistivity of what is between the jaws."""
    body = gripper.site.held_body()
    return (INSULATOR if body is None else min(int(body["brightness"]), INSULATOR - 1),)


def _read_barrier(gripper: Gripper) -> Values:
    """G: the light barrier between the jaws, 255 if something is there, else 0."""
    return (0 if gripper.site.held_body() is None else BARRIER_BROKEN,)


def _read_position(gripper: Gripper, what: int) -> Values | None:
    """H: the opening of the jaws (0) or the position of the arm (1)."""
    if what not in (0, 1):
        return None
    return (int(gripper.site.record["jaws" if what == 0 else "arm"] + 0.5),)


def _read_jumpers(gripper: Gripper) -> Values:
    """J: the jumpers."""
    return (0,)


class Gripper(Turret):
    """An arm with two jaws."""

    number = 1
    name = "Gripper"
    orders: ClassVar[Orders] = {
        "D": (1, _move_jaws),
        "E": (1, _move_arm),
        "F": (0, _read_resistivity),
        "G": (0, _read_barrier),
        "H": (1, _read_position),
        "J": (0, _read_jumpers),
    }

    def fit(self, site: Site) -> None:
        """Fit the gripper to a robot, upright and open."""
        super().fit(site)
        record = site.record
        record["has_gripper"] = 1
        record["arm"] = record["arm_target"] = ARM_START
        record["jaws"], record["is_closing"] = JAWS_MAX, 0

    def status(self) -> str:
        """Return what it holds."""
        body = self.site.held_body()
        return "holds nothing" if body is None else f"holds body {body['number']}, or has it between its jaws"

    def shapes(self) -> Sequence[Shape]:
        """Return two jaws, drawn as short as the arm's slope makes them from above."""
        record = self.site.record
        _, cosine = sin_cos(START_RAD + RAD_PER_STEP * float(record["arm"]))
        inner = GAP_MM + GAP_PER_STEP * float(record["jaws"])
        rim = self.site.spec.body.radius_mm
        near, far = (PIVOT_MM - (reach - PIVOT_MM) * cosine for reach in (rim, rim + JAW_LENGTH_MM))
        left = ((near, inner), (far, inner), (far, inner + 4.0), (near, inner + 4.0))
        return Shape(left), Shape(tuple((x, -y) for x, y in left))

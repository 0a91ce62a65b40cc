"""Random worlds of a batch against the same worlds on the line: `kiks.verify` finds no difference.

A case draws all at once: arenas with walls, lamps that are switched, zones, balls and cylinders; one to four robots of
one or several kinds, with their faults; starts; period, baud rate and thinking; controllers with their senses, turrets
and actuators, one for all robots or one for each.
"""

from __future__ import annotations

import functools
import random
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from tools.campaigns.runner import Broken, Campaign

import kiks
from kiks.batch.initial_state import random_starts
from kiks.control.senses import SENSES
from kiks.errors import KiksError
from kiks.firmware.khepera.kind import KHEPERA
from kiks.firmware.turret import Turret
from kiks.model.arena import Ball, Cylinder, Lamp, Zone
from kiks.model.arena_objects import LampSwitch
from kiks.model.family import family

CASES = 500


class Tally(Turret):
    """A turret of a user's own, which adds up signed numbers that depend on the robot."""

    number, name, memory_count = 26, "Tally", 2

    @kiks.actuator(command="T,26,A", least=-2000, most=20_000)
    def add(view: Any, value: Any) -> None:  # noqa: N805
        """Add a number."""
        view.memory[1] = (view.memory[1] + value + view.robot) % 30_000

    @kiks.sense(command="T,26,G", least=-30_000, most=30_000, readings=2)
    def total(view: Any, readings: Any) -> None:  # noqa: N805
        """Read the sum, and where the robot heads for [degrees]."""
        readings[0] = view.memory[1] - view.memory[0]
        readings[1] = np.floor(np.degrees(view.heading_rad))

    def fit(self, site: Any) -> None:
        """Begin at a number."""
        super().fit(site)
        site.memory[0] = 7.0

    def note(self, value: int) -> tuple[int, ...]:
        """A: add a number."""
        self.site.memory[1] = (self.site.memory[1] + value + self.site.robot - 1) % 30_000
        return ()

    def tell(self) -> tuple[int, ...]:
        """G: the sum and the heading."""
        return (int(self.site.memory[1] - self.site.memory[0]), int(np.floor(np.degrees(self.site.pose()[2]))))

    orders = {"A": (1, note), "G": (0, tell)}  # noqa: RUF012


def mixed(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Use all readings, as far as they fit into small speeds; send some of the other outputs, and some again."""
    memory[0] += 1.0
    left = right = 0.0
    for k in range(sensors.shape[0]):
        left += parameters[k] * (sensors[k] % 32.0)
        right -= parameters[sensors.shape[0] - 1 - k] * (sensors[k] % 17.0)
    memory[1] = 0.7 * memory[1] + left - right
    wheels[0], wheels[1] = 9.0 + left, 9.0 + right if memory[0] % 20.0 < 12.0 else -8.0 + right
    for k in range(2, wheels.shape[0]):
        wheels[k] = memory[1] * 40.0 if (memory[0] + k) % 3.0 > 0.0 else np.nan


@functools.cache
def _mixed(senses: tuple[Any, ...], actuators: tuple[Any, ...]) -> kiks.Controller:
    size = kiks.controller(senses=senses)(mixed).sensor_count
    return kiks.controller(senses=senses, actuators=actuators, memory=2, parameters=size)(mixed)


KINDS = ("linear", "mlp", "elman", "ctrnn", "graph", "gru", "plastic", "collector")
"""Controllers that come with KiKS."""


@dataclass
class SetUp:
    """A batch, the controllers of its robots, their parameters, and for how long they drive [s]."""

    batch: kiks.Batch
    controller: Any
    parameters: Any
    seconds: float

    def differences(self) -> list[Any]:
        """Return where three of its worlds, at most, differ from the line."""
        worlds = {0, self.batch.world_count // 2, self.batch.world_count - 1}
        return kiks.verify(self.batch, self.controller, self.parameters, seconds=self.seconds, worlds=worlds)


def _arena(rng: random.Random, bodies: tuple[int, int]) -> kiks.Arena:
    """Return an arena with so many balls and cylinders."""
    sides = {"width_mm": rng.randint(600, 1000), "height_mm": rng.randint(600, 1000)}
    if rng.random() < 0.4:
        things = {"walls": rng.randint(0, 3), "pillars": rng.randint(0, 2), "lamps": 0}
        arena = kiks.Arena.room(**sides, **things, seed=rng.getrandbits(30))
    else:
        arena = kiks.Arena.box(**sides, rounded_mm=rng.choice((0, 0, 120)))

    def places(count: int) -> list[Any]:
        free = random_starts(arena, 20, seed=rng.getrandbits(30), radius_mm=35)
        apart: list[Any] = []
        for x_mm, y_mm, _ in free.tolist():
            if len(apart) < count and all(np.hypot(x_mm - x, y_mm - y) > 70 for x, y in apart):
                apart.append((x_mm, y_mm))
        return apart

    balls, cylinders = bodies
    placed = places(balls + cylinders)
    hung = tuple(Lamp(*place, rng.uniform(0.2, 30), rng.random() < 0.8) for place in places(rng.choice((0, 1, 3))))
    switches = tuple(
        LampSwitch(rng.choice((0.0, 1.0, rng.uniform(0, 4))), rng.randint(1, len(hung)), rng.random() < 0.5)
        for _ in range(rng.choice((0, 0, 1, 4)) if hung else 0)
    )
    zones = tuple(
        Zone(disc_mm=place, radius_mm=rng.randint(10, 150), brightness=rng.randint(0, 255))
        for place in places(rng.randint(0, 8))
    )
    return replace(
        arena,
        balls=tuple(Ball(*place) for place in placed[:balls]),
        cylinders=tuple(Cylinder(*place, radius_mm=rng.choice((11.5, 20))) for place in placed[balls:]),
        lamps=hung,
        lamp_switches=switches,
        zones=zones,
    )


CHANGES: dict[str, tuple[Any, ...]] = {
    "firmware__processing_ms": (0.0, 0.3, 7.0),
    "firmware__baud": (19_200,),
    "quirks__d_reply_trailing_comma": (True,),
    "quirks__answer_empty_lines": (True,),
    "body__diameter_mm": (75.0,),
    "ambient__model": ("thesis",),
    "camera__adapts_exposure": (False,),
    "proximity__range_mm": (25.0, 150.0),
}
"""What may differ from a kind of robot that comes with KiKS."""


def _robots(rng: random.Random, worlds: int, robots: int) -> Any:
    """Return the kind of all robots, or one for each: of three kinds, or a family."""
    changes = {name: rng.choice(values) for name, values in CHANGES.items() if rng.random() < 0.15}
    noise = rng.random() < 0.8
    kinds = [kiks.RobotSpec.load(name).with_changes(**changes) for name in ("khepera", "khepera_ii")]
    kinds.append(kinds[0].with_changes(body__diameter_mm=90.0, reset__speed_gains=(3000, 700, 50)))
    kinds = [kind if noise else kind.without_noise() for kind in kinds]
    if (drawn := rng.random()) < 0.4:
        return rng.choice(kinds)
    if drawn < 0.6:
        return [[rng.choice(kinds) for _ in range(robots)] for _ in range(worlds)]
    spec, dead_share = rng.choice(kinds), rng.choice((0.0, 0.2))
    made = family(spec, worlds * robots, seed=rng.getrandbits(30), dead_share=dead_share)
    return [made[world * robots : (world + 1) * robots] for world in range(worlds)]


def _timing(rng: random.Random) -> kiks.Timing:
    period_s = rng.choice((0.0, 0.01, 0.03, 0.1, 0.1, 0.2, rng.uniform(0, 0.3)))
    baud = rng.choice((9600, 9600, 19200, 38400, 57600, 115_200, rng.randint(2400, 200_000)))
    return kiks.Timing(period_s, baud, rng.choice((0.0, 0.01, rng.uniform(0, 0.05), rng.expovariate(1000))))


def _controllers(rng: random.Random, robots: int) -> list[kiks.Controller]:
    """Return a controller for each robot; the senses and actuators of each come first among those of the first."""
    senses = rng.sample([*filter(KHEPERA.senses.get, SENSES), Tally.total], rng.randint(1, 4))
    actuators = ["wheels", *rng.sample(["gripper", Tally.add], rng.choice((0, 0, 1, 2)))]
    if rng.random() < 0.25:
        kind = rng.choice(KINDS)
        given = {} if kind in ("plastic", "collector") else {"senses": tuple(senses)}
        return [getattr(kiks.controllers, kind)(**given)] * robots
    # Which turret's memory lies where follows from all parts: so robots that differ have turrets in the same order.
    most = _mixed(tuple(senses), tuple(actuators))
    fewer = _mixed(tuple(senses[: rng.randint(1, len(senses))]), tuple(actuators[: rng.randint(1, len(actuators))]))
    return [most, *(rng.choice((most, fewer)) for _ in range(robots - 1))]


def set_up(rng: random.Random) -> SetUp:
    """Draw a set-up."""
    worlds, robots = rng.choice((1, 2, 3, 9, 20)), rng.choice((1, 2, 3, 4, 4, 7))
    bodies = rng.choice((0, 0, 1, 3)), rng.choice((0, 0, 1, 3))
    arenas = [_arena(rng, bodies) for _ in range(rng.choice((1, 1, 2)))]
    given: dict[str, Any] = {"robots": robots, "robot": _robots(rng, worlds, robots), "timing": _timing(rng)}
    if rng.random() < 0.3:
        given["starts"] = [
            random_starts(arenas[world % len(arenas)], 1, seed=rng.getrandbits(30), robots=robots, radius_mm=47)[0]
            for world in range(worlds)
        ]
    if rng.random() < 0.2:
        given["response"] = rng.choice(("thesis", "fast"))
    batch = kiks.Batch(arenas, worlds, seed=rng.getrandbits(rng.choice((8, 62))), threads=rng.randint(1, 2), **given)
    if batch.lamps.size and rng.random() < 0.3:
        batch.lamps[:, 0, 0] += rng.choice((20.0, np.nan))
    elif rng.random() < 0.1:
        hung = [(rng.uniform(50, 550), rng.uniform(50, 550), 5.0, 1.0)] * worlds
        batch.lamps = np.concatenate([batch.lamps, np.array(hung)[:, None]], axis=1)
    draw, controllers = np.random.default_rng(rng.getrandbits(40)), _controllers(rng, robots)

    def numbers(each: kiks.Controller, *shape: int) -> Any:
        if each.function is mixed:
            return draw.normal(0.0, rng.choice((0.01, 0.1, 0.1, 3.0)), (*shape, each.parameter_count))
        drawn = kiks.controllers.random_parameters(each, int(np.prod(shape)), seed=rng.getrandbits(30))
        return drawn.reshape(*shape, -1)

    seconds = rng.choice((rng.uniform(1, 8), rng.uniform(1, 8), rng.uniform(1, 40) / robots))
    if len(set(controllers)) == 1 and rng.random() < 0.7:
        return SetUp(batch, controllers[0], numbers(controllers[0], worlds, robots), seconds)
    return SetUp(batch, controllers, [numbers(each, worlds) for each in controllers], seconds)


def _play(rng: random.Random) -> int:
    drawn = set_up(rng)
    try:
        found = drawn.differences()
    except KiksError as error:  # a batch that no program on the line can follow
        raise Broken("lost", str(error), "the line fails") from error
    if found:
        raise Broken("lost", str(found[0]), f"{found[0].quantity} differs")
    return 1


def campaigns() -> Iterator[Campaign]:
    """Yield the only one."""
    yield Campaign("worlds.drawn", CASES, lambda: _play, limit_s=120.0)

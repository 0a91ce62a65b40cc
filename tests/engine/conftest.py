"""Small worlds for the tests of the engine: one robot, driven tick by tick through the kernels that Python may call."""

from __future__ import annotations

import math
from functools import lru_cache, partialmethod

import numpy as np
import pytest

from kiks.engine import step
from kiks.engine.parameters import pack
from kiks.engine.physics import motor
from kiks.engine.scene import Scene
from kiks.engine.sensing.thesis_networks import networks_for
from kiks.engine.state import State
from kiks.model.arena import PAD, Arena
from kiks.model.robot import RobotSpec


class World:
    """One robot on a floor, after a reset, and an oracle that knows walls as what they are drawn as: squares."""

    def __init__(self, arena: Arena, *, seed: int = 0, **changes: object) -> None:
        self.arena = arena
        self.seed = seed
        self.spec = RobotSpec.load("khepera").with_changes(**changes)
        self.kinds = pack(self.spec)
        self.cell = float(arena.mm_per_cell)
        self.state = State.empty(world_count=1, robot_count=1)
        self.robot = self.state.robots[0, 0]
        self.robot["speed_gains"] = self.spec.reset.speed_gains
        self.robot["position_gains"] = self.spec.reset.position_gains
        self.robot["profile_speed"] = self.spec.reset.profile_speed_pulses
        self.robot["profile_acceleration"] = self.spec.reset.profile_acceleration
        networks = networks_for(self.spec.proximity.response)
        self.scene = Scene(self.state, self.kinds, [arena], networks, np.zeros((1, 0, 4)), [seed])
        self.radius = self.spec.body.radius_mm

    def place(self, x_mm: float, y_mm: float, heading_rad: float = 0.0) -> World:
        self.robot["x_mm"], self.robot["y_mm"], self.robot["heading_rad"] = x_mm, y_mm, heading_rad
        self.robot["trail"][:] = (x_mm, y_mm, heading_rad)
        return self

    def command(self, name: str, left: int, right: int, *, ticks: int = 0) -> None:
        """Give a command and let time pass."""
        getattr(motor, name)(self.state.robots, 0, 0, left, right)
        self.tick(ticks)

    speed = partialmethod(command, "set_speed")
    pwm = partialmethod(command, "set_pwm")
    position = partialmethod(command, "set_position")
    set_counters = partialmethod(command, "set_counters")

    def tick(self, count: int = 1) -> None:
        now = self.state.tick_count
        step.advance(self.scene.record, now, count)
        self.state.tick_count = now + count

    @property
    def pose(self) -> tuple[float, float, float]:
        return float(self.robot["x_mm"]), float(self.robot["y_mm"]), float(self.robot["heading_rad"])

    @property
    def counters(self) -> tuple[int, int]:
        """What command H answers."""
        left, right = (self.robot["pulse_count"] + self.robot["counter_offset"] + 2**31) % 2**32 - 2**31
        return int(left), int(right)

    @property
    def status(self) -> tuple[int, ...]:
        """What command K answers: T, M and E of the left motor, then of the right one."""
        error = [int(motor.controller_error(self.state.robots, 0, 0, wheel)) for wheel in (0, 1)]
        on_target, mode = self.robot["on_target"].tolist(), self.robot["motor_mode"].tolist()
        return on_target[0], mode[0], error[0], on_target[1], mode[1], error[1]

    @property
    def asked(self) -> np.ndarray:
        """Paths that the two wheels would have made without walls [pulses]."""
        return self.robot["wheel_pulses"] + self.robot["slip_pulses"]

    def depth_mm(self) -> float:
        """Return how deep the disc is inside the nearest wall square [mm]; negative is free room up to 4 mm."""
        x, y, _ = self.pose
        surface = self.arena.surface
        reach = self.radius + 4.0
        rows, columns = (
            np.arange(max(int((v - reach) / self.cell) + PAD, 0), min(int((v + reach) / self.cell) + PAD + 2, count))
            for v, count in zip((y, x), surface.shape, strict=True)
        )
        near_x = (columns - PAD) * self.cell
        near_y = (rows - PAD) * self.cell
        gap_x = np.maximum(np.maximum(near_x - x, x - near_x - self.cell), 0.0)
        gap_y = np.maximum(np.maximum(near_y - y, y - near_y - self.cell), 0.0)
        wall = surface[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] > 0
        square = (gap_y**2)[:, None] + gap_x**2
        return self.radius - math.sqrt(square[wall].min() if wall.any() else reach**2)


def random_arena(number: int, *, start_room_mm: float = 30.0) -> Arena:
    """Return arena `number`: rectangles, discs, single pixels, staircases, narrow gaps; the same one every time."""
    rng = np.random.default_rng([2001, number])
    mm_per_pixel = (0.5, 1.0, 2.5)[rng.integers(3)]
    while True:
        width, height = (int(v / mm_per_pixel) for v in rng.integers(150, 450, 2))
        picture = np.zeros((height, width), np.uint8)
        rows, columns = np.mgrid[:height, :width]
        for _ in range(rng.integers(2, 9)):
            i, j = int(rng.integers(height)), int(rng.integers(width))
            shade = int(rng.integers(1, 256))
            match rng.integers(5):
                case 0:
                    tall, wide = (int(v / mm_per_pixel) + 1 for v in rng.integers(0, 120, 2))
                    picture[i : i + tall, j : j + wide] = shade
                case 1:
                    size = rng.integers(2, 50) / mm_per_pixel
                    picture[(rows - i) ** 2 + (columns - j) ** 2 <= size**2] = shade
                case 2:
                    picture[i, j] = shade
                case 3:
                    down, length = rng.choice((-1, 1)), int(rng.integers(10, 150) / mm_per_pixel)
                    for k in range(length):
                        if 0 <= i + down * k < height and j + k < width:
                            picture[i + down * k, j + k] = shade
                case 4:
                    gap = int(rng.uniform(50, 62) / mm_per_pixel)
                    picture[i : i + int(20 / mm_per_pixel)] = shade
                    picture[i : i + int(20 / mm_per_pixel), j : j + gap] = 0
        if not picture.any() or picture.all():
            continue
        arena = Arena.from_array(picture, mm_per_pixel=mm_per_pixel, name=f"random {number}")
        if arena.clearance.max() - 0.5 * arena.mm_per_cell > start_room_mm:
            return arena


@pytest.fixture(scope="session")
def make_world() -> type[World]:
    """Return the class of small worlds."""
    return World


@pytest.fixture(scope="session")
def make_random_arena():
    """Return the maker of random arenas."""
    return lru_cache(maxsize=8)(random_arena)

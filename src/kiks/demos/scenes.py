"""The scenes of `kiks demo`."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

import numpy as np

from kiks.demos.avoid import Avoid
from kiks.demos.camera import BAUD as CAMERA_BAUD
from kiks.demos.camera import Camera
from kiks.demos.clean import Clean
from kiks.demos.follow import Follow
from kiks.demos.maze import Maze
from kiks.demos.race import BAUD as RACE_BAUD
from kiks.demos.race import Race
from kiks.demos.scene import Scene
from kiks.demos.swarm import Swarm
from kiks.engine.scalar_math import sin_cos
from kiks.errors import ParameterError
from kiks.model.arena import Arena, Cylinder, Pose


class AvoidScene(Scene):
    """A robot wanders about."""

    def prepare(self) -> None:
        """Start the program."""
        self.avoid = Avoid()

    def step(self) -> None:
        """Let it do a step."""
        self.avoid.step(self.robot)


class FollowScene(Scene):
    """A robot follows the wall."""

    def prepare(self) -> None:
        """Start the program."""
        self.follow = Follow()

    def step(self) -> None:
        """Let it do a step."""
        self.follow.step(self.robot)


class CleanScene(Scene):
    """Twelve cylinders stand about in an empty room, and a robot pushes them to the walls."""

    seconds: ClassVar[float] = 600.0

    CYLINDERS: ClassVar[int] = 12
    GAP_MM: ClassVar[float] = 30.0
    """Least gap between a cylinder and all else at the start [mm]: a robot's radius."""

    TIDY_MM: ClassVar[float] = 100.0
    """How near to a wall the whole of a cylinder must be, its far edge included [mm]."""

    def make_arena(self) -> Arena:
        """Return a room in which most random places are far from a wall."""
        return Arena.box(1000, 1000)

    def prepare(self) -> None:
        """Put the cylinders at random places."""
        radius_mm = Cylinder(0, 0).radius_mm
        for number in range(self.CYLINDERS):
            self.sim.add_cylinder(*self.random_place(number, radius_mm, self.GAP_MM))
        self.tidy_at_start = self.tidy_count()
        self.clean = Clean()

    def step(self) -> None:
        """Let the robot do a step."""
        self.clean.step(self.robot)

    def tidy_count(self) -> int:
        """Return how many cylinders are with all of them near a wall."""
        clearance_mm, bodies = self.sim.arena.clearance_at_mm, self.sim.bodies()
        places = zip(bodies["x_mm"].tolist(), bodies["y_mm"].tolist(), bodies["radius_mm"].tolist(), strict=True)
        return sum(clearance_mm(x, y) + radius_mm <= self.TIDY_MM for x, y, radius_mm in places)

    def result(self) -> str:
        """Return how many are tidied up."""
        total = len(self.sim.bodies())
        return f"{self.tidy_count()} of {total} cylinders at the walls, {self.tidy_at_start} at the start"


class MazeScene(Scene):
    """A robot looks for the way out of a random maze."""

    seconds: ClassVar[float] = 900.0

    def make_arena(self) -> Arena:
        """Return the maze of the seed."""
        return Arena.maze(columns=5, rows=5, seed=self.seed)

    def prepare(self) -> None:
        """Start the program."""
        self.maze = Maze()

    def step(self) -> None:
        """Let the robot do a step."""
        self.maze.step(self.robot)

    @property
    def is_over(self) -> bool:
        """Whether the robot has stopped."""
        return self.maze.has_arrived

    def lamp_mm(self) -> float:
        """Return how far it is to the nearest lamp [mm]; infinitely far if there is none."""
        x_mm, y_mm, _ = self.sim.pose(1)
        return min((math.hypot(lamp[0] - x_mm, lamp[1] - y_mm) for lamp in self.sim.lamps.tolist()), default=math.inf)

    def result(self) -> str:
        """Return whether the robot is out, and where it stands."""
        state = "out" if self.is_over else "not out"
        return f"{state} after {self.sim.time_s:.1f} s, {self.lamp_mm():.0f} mm from the lamp   {self.contacts()}"


class CameraScene(Scene):
    """A hand leads a white ball along an eight between dark cylinders, and a robot watches it."""

    baud: ClassVar[int] = CAMERA_BAUD

    IN_SIGHT_DEG: ClassVar[float] = 18.0
    """Half of the camera's field of view [degrees]."""

    BALL_RAD_S: ClassVar[float] = 0.2
    """How fast the ball goes round [rad/s]: 80 mm/s on average, and 30 s for an eight."""

    def make_arena(self) -> Arena:
        """Return a room with walls so dark that only the ball is bright."""
        return Arena.box(1000, 1000, brightness=30)

    def prepare(self) -> None:
        """Fit the camera, and put up what there is to be seen."""
        arena = self.sim.arena
        for right in (0.15, 0.85):
            for up in (0.15, 0.85):
                self.sim.add_cylinder(right * arena.width_mm, up * arena.height_mm, brightness=60)
        self.angle_rad = 2 * math.pi * self.chance(0)
        self.ball = self.sim.add_ball(*self.ball_place())
        self.sim.fit(1, "k213")
        self.off_deg: list[float] = []
        self.distances_mm: list[float] = []
        self.camera = Camera()
        self.camera.start(self.robot)

    def step(self) -> None:
        """Let the robot do a step."""
        self.camera.step(self.robot)

    def ball_place(self) -> tuple[float, float]:
        """Return where the hand wants the ball [mm]."""
        arena = self.sim.arena
        # The engine's sine and cosine, which are the same on every computer.
        (_, cosine), (double_sine, _) = sin_cos(self.angle_rad), sin_cos(2 * self.angle_rad)
        return arena.width_mm * (0.5 + 0.3 * cosine), arena.height_mm * (0.5 + 0.26 * double_sine)

    def watch(self) -> None:
        """Lead the ball on, and measure how well the robot looks at it."""
        before_rad = self.angle_rad
        self.angle_rad += self.BALL_RAD_S * self.slice_s
        try:
            self.sim.move_body(self.ball, *self.ball_place())
        except ParameterError:
            self.angle_rad = before_rad  # the robot is in the way: the ball waits
        ball, (x_mm, y_mm, heading) = self.sim.bodies()[-1], self.sim.pose(1)
        to_x, to_y = float(ball["x_mm"]) - x_mm, float(ball["y_mm"]) - y_mm
        self.off_deg.append(abs(math.degrees(math.remainder(math.atan2(to_y, to_x) - heading, 2 * math.pi))))
        self.distances_mm.append(math.hypot(to_x, to_y))

    def result(self) -> str:
        """Return how long the ball was in sight, and how well in the middle."""
        if not self.off_deg:
            return "nothing seen yet"
        off, distance = np.array(self.off_deg), np.array(self.distances_mm)
        seen = off < self.IN_SIGHT_DEG
        if not seen.any():
            return "never saw the ball"
        return (
            f"ball in sight {seen.mean():.0%} of the time, {off[seen].mean():.1f} degrees off the middle, "
            f"{distance[seen].mean():.0f} +- {distance[seen].std():.0f} mm away"
        )


class RaceScene(Scene):
    """A robot races round a track."""

    seconds: ClassVar[float] = 60.0
    baud: ClassVar[int] = RACE_BAUD
    slice_s: ClassVar[float] = 0.02

    def make_arena(self) -> Arena:
        """Return the oval of examples/arenas/track.toml, with a robot at its start."""
        return replace(Arena.from_array(oval(), name="Track"), starts=(Pose(300.0, 80.0, 0.0),))

    def prepare(self) -> None:
        """Start the program, and the clock."""
        self.race = Race()
        self.angle = self.start_angle = self.angle_now()
        self.time_s = self.sim.time_s
        self.laps_s: list[float] = []

    def step(self) -> None:
        """Let the robot do a step."""
        self.race.step(self.robot)

    def angle_now(self) -> float:
        """Return where the robot is, seen from the middle of the arena [rad]."""
        x_mm, y_mm, _ = self.sim.pose(1)
        return math.atan2(y_mm - self.sim.arena.height_mm / 2, x_mm - self.sim.arena.width_mm / 2)

    def watch(self) -> None:
        """See how far round the robot is, and at which time it crossed the line."""
        before, before_s, now_s = self.angle, self.time_s, self.sim.time_s
        self.angle += math.remainder(self.angle_now() - before, 2 * math.pi)
        self.time_s = now_s
        line = self.start_angle + 2 * math.pi * (len(self.laps_s) + 1)
        if self.angle >= line:
            crossed_s = before_s + (now_s - before_s) * (line - before) / (self.angle - before)
            self.laps_s.append(crossed_s)

    def best_s(self) -> float:
        """Return the time of the fastest lap [s]."""
        return min(np.diff([0.0, *self.laps_s]).tolist(), default=math.inf)

    def result(self) -> str:
        """Return the laps."""
        best = f", the best in {self.best_s():.2f} s" if self.laps_s else ""
        return f"{len(self.laps_s)} laps{best}   {self.contacts()}"


def oval() -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """Return the picture of the track: white outside, a dark island with a striped kerb inside."""
    rows, columns = np.indices((500, 600))
    distance_mm = np.hypot(np.maximum(np.abs(columns + 0.5 - 300) - 50, 0), rows + 0.5 - 250)
    stripes = (columns // 40 + rows // 40) % 2 == 0
    island = np.where(stripes & (distance_mm > 100), 240, 60)
    return np.where(distance_mm > 230, 255, np.where(distance_mm > 110, 0, island)).astype(np.uint8)


class SwarmScene(Scene):
    """Twenty robots stand in a heap and spread out over the room."""

    seconds: ClassVar[float] = 60.0
    robot_count: ClassVar[int] = 20

    def make_arena(self) -> Arena:
        """Return a room with the robots in its middle, ten millimetres apart, with random headings."""
        spots = [
            Pose(600 + 66 * (column - 2 + row % 2 / 2), 600 + 58 * (row - 1.5), 2 * math.pi * self.chance(row, column))
            for row in range(4)
            for column in range(5)
        ]
        return replace(Arena.box(1200, 1200), starts=tuple(spots))

    def prepare(self) -> None:
        """Start the program."""
        self.swarm = Swarm(self.ports)
        self.apart_at_start_mm = self.apart_mm()

    def step(self) -> None:
        """Let all robots do a step."""
        self.swarm.step()

    def apart_mm(self) -> float:
        """Return how far it is from a robot to the nearest other [mm], on average."""
        places = self.sim.poses()[:, :2]
        distances = np.hypot(*(places[:, None] - places[None, :]).transpose(2, 0, 1))
        np.fill_diagonal(distances, math.inf)
        return float(distances.min(axis=1).mean())

    def result(self) -> str:
        """Return how far they have spread."""
        return (
            f"nearest neighbours {self.apart_mm():.0f} mm apart, {self.apart_at_start_mm:.0f} mm at the start   "
            f"{self.contacts()}"
        )


SCENES: dict[str, type[Scene]] = {
    "avoid": AvoidScene,
    "follow": FollowScene,
    "clean": CleanScene,
    "maze": MazeScene,
    "camera": CameraScene,
    "race": RaceScene,
    "swarm": SwarmScene,
}
"""The scenes by their names."""

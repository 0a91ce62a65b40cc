"""Two champions of a co-evolution in one world."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import ClassVar

import numpy as np

from kiks.client.drive import Driver
from kiks.demos.scene import Scene
from kiks.errors import ParameterError
from kiks.learn import tasks
from kiks.learn.champion import Champion
from kiks.learn.task import Task
from kiks.model import pitch
from kiks.model.arena import Arena, Pose
from kiks.sim.simulation import Simulation

TOUCH_MM = 2.0
"""Gap between two robots at which they touch [mm], as in `pursuit`: steps of the control loop see where robots are."""


class ContestScene(Scene):
    """The champions of both sides drive against each other until their contest ends (`ENDS`).

    Args:
        folder: The folder of a co-evolution, with a champion's file for each side.
        arena: Where they drive; an arena of the contest if left out.
        seed: Seed of the world, and of random starts.
        baud: Speed of the lines [bit/s]; that of the champions if left out.
    """

    seconds: ClassVar[float] = 60.0

    def __init__(
        self, folder: str | Path, arena: Arena | None = None, *, seed: int = 0, baud: int | None = None
    ) -> None:
        self.contest, self.champions = _load(Path(folder))
        self._sides = [side for side in range(2) for _ in range(self.contest.sides[side].robots)]
        self.end, self.open_end = ENDS[self.contest.name]
        self.said = ""
        super().__init__(arena, seed=seed, baud=baud or self.champions[0].baud)

    def make_arena(self) -> Arena:
        """Return an arena of the contest, which its arenas are in turn for one seed after the other."""
        return self.contest.arenas[self.seed % len(self.contest.arenas)]

    def make_simulation(self, arena: Arena | None) -> Simulation:
        """Return a world of the contest, at the start that its evaluation has with this seed."""
        arena = arena or self.make_arena()
        contest = self.contest.with_changes(arenas=(arena,), worlds=1)
        kinds = [self.champions[side].robot for side in self._sides]
        think_s = self.champions[0].timing.think_s
        thinking = f"fixed:{think_s * 1e3:g}" if think_s else "none"
        poses = contest.start_poses(np.array([self.seed]))
        if poses is not None:
            arena = replace(arena, starts=tuple(Pose(*pose) for pose in poses[0].tolist()))
        sim = Simulation(arena, robots=len(kinds), seed=self.seed, robot=kinds, thinking=thinking)
        for number, side in enumerate(self._sides, 1):
            if "camera" in self.champions[side].controller.senses:
                sim.fit(number, "k213")
        return sim

    def prepare(self) -> None:
        """Put the champions at the wheels."""
        drivers = [self.champions[side] for side in self._sides]
        parameters = [list(each.parameters) for each in drivers]
        period_s = self.champions[0].timing.period_s
        self.driver = Driver(self.ports, [each.controller for each in drivers], parameters, period_s=period_s)

    def step(self) -> None:
        """Let them do a loop, and see whether the contest ends."""
        self.driver.step()
        if not self.said and (said := self.end(self)):
            self.said = f"{said} after {self.sim.time_s:.1f} s"

    def touching_sides(self) -> bool:
        """Return whether a robot of one side touches a robot of the other."""
        robots = zip(self._sides, self.sim.poses().tolist(), self.sim.specs, strict=True)
        return any(
            side != other_side
            and math.dist(pose[:2], other_pose[:2]) - spec.body.radius_mm - other_spec.body.radius_mm <= TOUCH_MM
            for (side, pose, spec), (other_side, other_pose, other_spec) in combinations(robots, 2)
        )

    @property
    def is_over(self) -> bool:
        """Whether the contest has ended."""
        return bool(self.said)

    def result(self) -> str:
        """Return how it ended, and when."""
        return self.said or self.open_end


def _scorer(scene: ContestScene) -> str:
    """Return who has scored. The first thing is the ball; an arena of a user's own may have none."""
    places = [pitch.goal_at(float(ball["x_mm"]), float(ball["radius_mm"])) for ball in scene.sim.bodies()[:1]]
    return "left scored" if 1 in places else "right scored" if -1 in places else ""


ENDS: dict[str, tuple[Callable[[ContestScene], str], str]] = {
    "pursuit": (
        lambda scene: "predator and prey touched" if scene.touching_sides() else "",
        "predator and prey have not touched",
    ),
    "football": (_scorer, "no goal"),
}
"""Of each contest: what says how it ended, or nothing while it goes on, and what is said if it does not end."""


def _load(folder: Path) -> tuple[Task, list[Champion]]:
    """Return the contest of a folder, and the champion of each side."""
    found = [tasks.load(name) for name in ENDS]
    for task in found:
        files = [folder / f"{side.name}.toml" for side in task.sides]
        if all(file.is_file() for file in files):
            return task, [Champion.load(file) for file in files]
    wanted = ", or ".join(" and ".join(f"{side.name}.toml" for side in task.sides) for task in found)
    raise ParameterError(
        f"the folder {str(folder)!r} must have {wanted}, but has not. `kiks evolve` of a task of two sides makes one."
    )

"""Run the controller that an evolution has found."""

from __future__ import annotations

from typing import ClassVar

from kiks.demos.scene import Scene
from kiks.learn import tasks
from kiks.learn.champion import Champion
from kiks.model.arena import Arena
from kiks.sim.simulation import Simulation


class ChampionScene(Scene):
    """A robot drives as evolution has taught it.

    Args:
        champion: Its controller.
        arena: Where it drives; if left out, where the champions of its task are examined.
        seed: Seed of the world.
        baud: Speed of the line [bit/s]; the champion's own if left out.

    Raises:
        ArenaError: If the arena has no room for it.
    """

    seconds: ClassVar[float] = 180.0

    def __init__(
        self, champion: Champion, arena: Arena | None = None, *, seed: int = 0, baud: int | None = None
    ) -> None:
        self.champion = champion
        super().__init__(arena, seed=seed, baud=baud or champion.baud)

    def make_arena(self) -> Arena:
        """Return the arena of its task; the classic box if that is a user's own."""
        # Its name alone: what a file calls a task is not to be found elsewhere, and run.
        make_task = tasks.TASKS.get(self.champion.task)
        if make_task is None:
            return Arena.default()
        task = make_task()
        return (task if task.exam is None else task.exam).arenas[0]

    def make_simulation(self, arena: Arena) -> Simulation:
        """Return a world of the champion's kind of robot."""
        return self.champion.simulation(arena, seed=self.seed)[0]

    def prepare(self) -> None:
        """Put the champion at the wheel."""
        self.driver = self.champion.driver(self.ports)

    def step(self) -> None:
        """Let it do a loop."""
        self.driver.step()

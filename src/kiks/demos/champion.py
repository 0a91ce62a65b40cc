"""Run the controller that an evolution has found."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

from kiks.demos.scene import Scene
from kiks.learn.champion import Champion
from kiks.model.arena import Arena
from kiks.sim.simulation import Simulation
from kiks.units import ns_from_s


class ChampionScene(Scene):
    """Robots drive as evolution has taught them.

    Args:
        champion: Their controller.
        arena: Where they drive; the champion's own world if left out.
        seed: Seed of the world; the champion's own, else 0, if left out.
        baud: Speed of the line [bit/s]; the champion's own if left out.
    """

    seconds: ClassVar[float] = 180.0

    def __init__(
        self, champion: Champion, arena: Arena | None = None, *, seed: int | None = None, baud: int | None = None
    ) -> None:
        self.champion = champion
        own_seed = 0 if arena is not None or champion.world is None else champion.world.seed
        super().__init__(arena, seed=own_seed if seed is None else seed, baud=baud or champion.baud)

    def make_simulation(self, arena: Arena | None) -> Simulation:
        """Return the champion's own world, or an arena with a robot of its kind."""
        return self.champion.simulation(arena, seed=self.seed)[0]

    def prepare(self) -> None:
        """Put the champion at the wheel."""
        self.driver = self.champion.driver(self.ports)

    def slices(self, seconds: float | None = None) -> Iterator[None]:
        """Run, and stop for a moment after each slice of time; no loop begins after the end, as in a batch."""
        self._end_ns = ns_from_s(self.seconds if seconds is None else seconds)
        yield from super().slices(seconds)

    @property
    def is_over(self) -> bool:
        """Whether the next loop would begin after the end."""
        return self.driver.begin_ns >= self._end_ns

    def step(self) -> None:
        """Let it do a loop."""
        self.driver.step()

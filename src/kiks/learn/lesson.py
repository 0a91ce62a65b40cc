"""A lesson: what is to be learnt by reward, step by step."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

from kiks.batch.timing import Timing
from kiks.control.controller import SENSES, check_senses
from kiks.control.measure import Measure
from kiks.engine.motor import SPEED_MAX
from kiks.errors import ParameterError, nearest, shown
from kiks.model.arena import Arena
from kiks.model.ranges import check_number
from kiks.model.robot import SENSOR_COUNT


@dataclass(frozen=True, eq=False)
class Lesson:
    """What environments of all kinds are made of: a place, what is sensed there, what is good and when it is over.

    Args:
        name: What it is called.
        arenas: Where it takes place; of several, world k has the one of number k modulo their count.
        reward: A measure whose first note adds up: what it gains in a step is the reward of that step.
        goal: A measure: an episode is over (terminated) once its first note is above zero, for one robot of the world
            at least. None for lessons that have no end of their own.
        senses: What robots sense, of 'proximity' and 'ambient'.
        starts: 'random' for free places anywhere, another for each episode; 'arena' for where the arena puts robots.
        speed_limit: What an action of 1 means [pulses/10 ms].
        timing: The pace of the loop; that of a program on a line of 9600 baud if left out.

    Raises:
        ParameterError: If an argument is out of range.
    """

    name: str
    arenas: tuple[Arena, ...]
    reward: Measure
    goal: Measure | None = None
    senses: tuple[str, ...] = ("proximity",)
    starts: str = "random"
    speed_limit: float = 10.0
    timing: Timing = field(default_factory=Timing)

    def __post_init__(self) -> None:
        arenas: Arena | Sequence[Arena] = self.arenas
        object.__setattr__(self, "arenas", tuple(arenas) if isinstance(arenas, Iterable) else (arenas,))
        if not self.arenas or not all(isinstance(arena, Arena) for arena in self.arenas):
            raise ParameterError(f"arenas must be one or more kiks.Arena, but they were {shown(arenas)}.")
        for name, measure in (("reward", self.reward), ("goal", self.goal)):
            if not (isinstance(measure, Measure) or (name == "goal" and measure is None)):
                raise ParameterError(
                    f"{name} must be a measure, but it was {shown(measure)}. Write @kiks.measure over the function."
                )
        object.__setattr__(self, "senses", check_senses(self.senses))
        if not self.senses:
            raise ParameterError(f"senses must be some of {', '.join(SENSES)}, but there were none.")
        if not isinstance(self.starts, str) or self.starts not in ("random", "arena"):
            raise ParameterError(f"starts must be 'random' or 'arena', but it was {shown(self.starts)}.")
        if not isinstance(self.timing, Timing):
            raise ParameterError(f"timing must be a kiks.Timing, but it was {shown(self.timing)}.")
        if not check_number("speed_limit", self.speed_limit, 0, SPEED_MAX):
            raise ParameterError("speed_limit must be above 0, but it was 0: robots that stand learn nothing.")

    @property
    def sensor_count(self) -> int:
        """How many counts a robot senses."""
        return SENSOR_COUNT * len(self.senses)

    def with_changes(self, **changes: Any) -> Lesson:
        """Return the same lesson with other arguments.

        Raises:
            ParameterError: If one of them is unknown or out of range.
        """
        known = tuple(entry.name for entry in fields(self))
        for name in changes:
            if name not in known:
                raise ParameterError(
                    f"what is changed of a lesson must be one of {', '.join(known)}, but it was {name!r}."
                    f"{nearest(name, known)}"
                )
        return replace(self, **changes)

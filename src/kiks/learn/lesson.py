"""A lesson: what is to be learnt by reward, step by step."""

from __future__ import annotations

from dataclasses import field, replace
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from kiks.batch.beginning import Arenas, Starts
from kiks.batch.timing import Timing
from kiks.control.controller import check_senses
from kiks.control.measure import Measure
from kiks.engine.motor import SPEED_MAX
from kiks.model.data_file import Number, Text, record
from kiks.model.robot import SENSOR_COUNT

_Watch = Annotated[Measure, Field(description="Write @kiks.measure over the function.")]


@record
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

    name: Text
    arenas: Arenas
    reward: _Watch
    goal: _Watch | None = None
    senses: Annotated[tuple[Text, ...], BeforeValidator(check_senses), Field(min_length=1)] = ("proximity",)
    starts: Starts = "random"
    speed_limit: Annotated[Number, Field(gt=0, le=SPEED_MAX)] = 10.0
    timing: Timing = field(default_factory=Timing)

    # Functions cannot be compared: a lesson equals itself alone.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    @property
    def sensor_count(self) -> int:
        """How many counts a robot senses."""
        return SENSOR_COUNT * len(self.senses)

    def with_changes(self, **changes: Any) -> Lesson:
        """Return the same lesson with other arguments.

        Raises:
            ParameterError: If one of them is unknown or out of range.
        """
        return replace(self, **changes)

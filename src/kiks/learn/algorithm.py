"""What an algorithm is, and what it begins with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from kiks.control.controller import Controller
from kiks.learn.task import Axis
from kiks.model.data_file import Number

Floats = NDArray[np.float64]

Share = Annotated[Number, Field(ge=0, le=1)]
Positive = Annotated[Number, Field(gt=0, le=1e6)]


class Algorithm(Protocol):
    """Proposes candidates. `ask` and `tell` alternate; an algorithm of a user's own may do without `favourite`."""

    def ask(self) -> Floats:
        """Return the next generation, float64 [candidate, parameter]."""
        ...

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Take their fitness, float64 [candidate], and their behaviours, float64 [candidate, axis and objective].

        More is better of an objective, so those with a minus before their names are the measures negated.
        """

    def favourite(self) -> Floats | None:
        """Return the best parameters according to the algorithm, float64 [parameter].

        None if it looks for many behaviours and prefers none: then the best one of the evolution's archive counts.
        """
        ...


class Setting(NamedTuple):
    """What an algorithm begins with.

    Attributes:
        parameter_count: Number of parameters of a candidate.
        population: Number of candidates in a generation.
        seed: Seed of its random numbers.
        axes: Axes along which behaviours differ.
        spread: Standard deviation of each parameter at the beginning.
        objectives: Names of the objectives.
        controller: The controller whose parameters evolve.
    """

    parameter_count: int
    population: int
    seed: int
    axes: Sequence[Axis]
    spread: float
    objectives: Sequence[str]
    controller: Controller

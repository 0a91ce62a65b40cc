"""State slots of several measures, and their values."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.batch.callbacks import MEASURE
from kiks.control.measure import Measure
from kiks.control.senses import AnySense, named
from kiks.engine.compiling import address_of
from kiks.errors import ParameterError, shown
from kiks.model.checks import check_kind


class MeasureSlots:
    """Measures that watch the same robots.

    Args:
        measures: The measures.
        senses: Senses of these robots.
        subject: Subject of messages: the object that senses.
        until: A measure that ends the trial of a world when its first note is above zero; it has no value of its own.

    Attributes:
        measures: The measures, with `until` last, unless it is one of them.
        note_count: Number of state slots of all measures together, for each robot.
        until_note: The slot that ends the trial of a world; -1 if none does.
    """

    def __init__(
        self, measures: Sequence[Measure], senses: Sequence[AnySense], subject: str, until: Measure | None = None
    ) -> None:
        if not isinstance(measures, Sequence):
            raise ParameterError(f"measures must be a list of measures, but they were {shown(measures)}.")
        if until is not None:
            check_kind("until", until, Measure, "Make one with @kiks.measure.")
        self._value_count = len(measures)
        self.measures = tuple(measures) if until is None or until in measures else (*measures, until)
        for each in self.measures:
            check_kind("each of measures", each, Measure, "Take some of kiks.measures, or make one with @kiks.measure.")
            if tuple(senses[: len(each.senses)]) != each.senses:
                raise ParameterError(
                    f"the measure {shown(each.name)} must find {named(each.senses)} first among what is sensed, but "
                    f"{subject} senses {named(senses)}. Let it sense that, too."
                )
        self._ends = list(accumulate((each.note_count for each in self.measures), initial=0))
        self.note_count = self._ends[-1]
        self.until_note = -1 if until is None else self._ends[self.measures.index(until)]

    def __getstate__(self) -> dict[str, Any]:
        return {name: part for name, part in vars(self).items() if name != "watchers"}  # which are addresses

    @functools.cached_property
    def watchers(self) -> NDArray[np.int64]:
        """The address of each measure and the range of its notes, int64 [measure, 3]: address, begin, end."""
        addresses = [address_of(each.check(MEASURE)) for each in self.measures]
        return np.array([*zip(addresses, self._ends[:-1], self._ends[1:], strict=True)], np.int64).reshape(-1, 3)

    def values(self, notes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values of the measures for notes [world, robot, note], float64 [world, robot, value]."""
        values = [np.zeros((*notes.shape[:2], 0))]
        for each, (begin, end) in zip(self.measures, pairwise(self._ends[: self._value_count + 1]), strict=False):
            values.append(each.value(notes[:, :, begin:end]).reshape(*notes.shape[:2], -1))
        return np.concatenate(values, axis=2)

"""What the people at a desk may do."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from typing import ClassVar


@dataclass(frozen=True)
class Rights:
    """What the people at a desk may do.

    Attributes:
        owns_world: Whether the world may be replaced; False if a program outside holds it.
        may_run_programs: Whether a browser or a project may start programs other than those the run began with.
        may_edit: Whether they may change a locked exercise, as its lecturer does.
        is_for_others: Whether they are others than the user of this computer: then the desk stays with its project,
            whose supervisor runs in this process.
        speed_max: The highest speed that they may choose.

    Attributes of the class:
        VISITOR: Looks at a world that a program holds, and drags what is in it.
        NOTEBOOK: Starts programs in such a world, too.
        OWNER: Replaces the world.
        STUDENT: Does so within the exercise, on a computer that many share.
    """

    owns_world: bool = False
    may_run_programs: bool = False
    may_edit: bool = False
    is_for_others: bool = False
    speed_max: float = inf

    VISITOR: ClassVar[Rights]
    NOTEBOOK: ClassVar[Rights]
    OWNER: ClassVar[Rights]
    STUDENT: ClassVar[Rights]


Rights.VISITOR = Rights()
Rights.NOTEBOOK = Rights(may_run_programs=True)
Rights.OWNER = replace(Rights.NOTEBOOK, owns_world=True)
Rights.STUDENT = replace(Rights.OWNER, is_for_others=True, speed_max=5.0)

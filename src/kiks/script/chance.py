"""Chance in a program: what is random on a computer follows from the world's seed, so that a run can be repeated."""

from __future__ import annotations

import _random
import os
import random
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from kiks.script.patching import for_program
from kiks.script.thread_scheduler import Scheduler

_real_seed = _random.Random.seed


class ProgramChance:
    """The source of all randomness of one program.

    Args:
        scheduler: The program's threads.
        seed: What it follows from: the world's seed, and the program's number.
    """

    def __init__(self, scheduler: Scheduler, seed: str) -> None:
        self._scheduler = scheduler
        self._seed = seed
        self._source = random.Random(seed)

    @contextmanager
    def taken(self) -> Iterator[None]:
        """Give the generators that are there already seeds of the program, and their own ones back."""
        numpy_random = sys.modules.get("numpy.random")
        before = random.getstate(), None if numpy_random is None else numpy_random.get_state()
        random.seed(f"{self._seed} random")
        try:
            yield
        finally:
            random.setstate(before[0])
            if numpy_random is not None:
                numpy_random.set_state(before[1])

    def doubt(self, library: str) -> None:
        """Note that a library draws by chance, or tells a time, by itself."""
        self._scheduler.program.doubt = f"{library} has random numbers or a clock of its own"

    def number(self, library: str, bits: int) -> int:
        """Return a seed for the generator of a library, which it seeds by itself when it is imported."""
        return random.Random(f"{self._seed} {library}").getrandbits(bits)

    def read(self, size: int, flags: int = 0, /) -> bytes:
        """Return random bytes; see `os.urandom`."""
        if size < 0:
            os.urandom(size)  # says what is wrong
        return self._source.randbytes(size)

    def replacements(self) -> dict[str, dict[str, Any]]:
        """Return the replacements for names of `os` and `random`."""

        def seed(generator: Any, value: Any = None, /) -> None:
            _real_seed(generator, self._source.getrandbits(256) if value is None else value)

        return {
            "posix": {"urandom": self.read, "getrandom": self.read},
            "_random.Random": {"seed": for_program(self._scheduler, seed, _real_seed)},
        }

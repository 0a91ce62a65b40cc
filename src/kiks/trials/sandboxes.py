"""The sandboxes of a worker: one for each program, warm from case to case."""

from __future__ import annotations

from collections import OrderedDict
from functools import cache
from pathlib import Path

from kiks.ports.sandbox import Sandbox, SandboxLimits
from kiks.trials.trial import Trial

KEPT = 4
"""Sandboxes that stay warm, and with them the players of a match or two."""


class Sandboxes:
    """Sandboxes of programs; a program finds none of another's files, nor its own of an earlier run.

    Args:
        limits: What the programs in each may take.
    """

    def __init__(self, limits: SandboxLimits | None = None) -> None:
        self._limits = limits
        self._kept: OrderedDict[tuple[tuple[Path, ...], int, bool, str], Sandbox] = OrderedDict()

    def of(self, trial: Trial) -> dict[int, Sandbox]:
        """Return the sandbox of each robot's program, which runs when this returns.

        Raises:
            KiksError: If there can be no sandbox on this computer.
        """
        found: dict[int, Sandbox] = {}
        for robot, command in enumerate(trial.programs, 1):
            if command is None:
                continue
            # A program that drives several robots has a sandbox for each.
            files = tuple(command.files().shown)
            key = (files, robot, trial.is_trusted, trial.user)
            if key not in self._kept:
                self._kept[key] = Sandbox(files, limits=self._limits, is_trusted=trial.is_trusted, user=trial.user)
            self._kept.move_to_end(key)
            found[robot] = self._kept[key]
        while len(self._kept) > max(KEPT, len(found)):
            self._kept.popitem(last=False)[1].close()
        for sandbox in found.values():
            sandbox.warm()
        return found

    def close(self) -> None:
        """End them all."""
        while self._kept:
            self._kept.popitem()[1].close()


@cache
def sandboxes_of_process() -> Sandboxes:
    """Return the sandboxes of a worker, which stay warm from trial to trial."""
    return Sandboxes()

"""Small evaluations for tests of executors, in a module that workers can import."""

from __future__ import annotations

import os
import signal
from dataclasses import dataclass
from pathlib import Path

import numpy as np

MARK = 0.125
"""First parameter of marked candidates, to which an evaluation reacts."""


def candidates(count: int, *, marked: int | None = None) -> np.ndarray:
    """Return candidates [count, 3], one of them marked."""
    values = np.random.default_rng(count).standard_normal((count, 3))
    if marked is not None:
        values[marked, 0] = MARK
    return values


def seeds(count: int) -> np.ndarray:
    return np.arange(count, dtype=np.int64) * 7 + 1


class Sums:
    """Two values that depend on all bits of parameters and seed; it overwrites its arguments, as an evaluation may."""

    is_prepared = False

    def prepare(self):
        self.is_prepared = True

    def evaluate(self, candidates, seeds, threads):
        assert self.is_prepared
        values = np.stack(
            [candidates[:, 0] / 3 + candidates[:, 1] * candidates[:, 2], candidates[:, 1] / seeds], axis=1
        )
        candidates[:] = 0
        seeds[:] = 0
        return values


@dataclass
class Deadly(Sums):
    """Kills its process at a marked candidate; with a file as memory, only once."""

    memory: Path | None = None

    def evaluate(self, candidates, seeds, threads):
        if MARK in candidates[:, 0] and not (self.memory and self.memory.exists()):
            if self.memory:
                self.memory.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().evaluate(candidates, seeds, threads)


class Failing(Sums):
    def evaluate(self, candidates, seeds, threads):
        if MARK in candidates[:, 0]:
            raise ZeroDivisionError("a wheel came off")
        return super().evaluate(candidates, seeds, threads)


class Unprepared(Sums):
    def prepare(self):
        raise FileNotFoundError("no arena")


class DeadAtStart(Sums):
    def prepare(self):
        os.kill(os.getpid(), signal.SIGKILL)


class WrongShape(Sums):
    def evaluate(self, candidates, seeds, threads):
        return candidates[:, 0]


@dataclass
class WorkerFacts(Sums):
    """Returns the process id, the number of calls of `prepare`, and the number of threads."""

    prepare_count: int = 0

    def prepare(self):
        self.prepare_count += 1

    def evaluate(self, candidates, seeds, threads):
        return np.full((len(candidates), 3), [os.getpid(), self.prepare_count, threads], dtype=np.float64)


@dataclass
class Stuck(Sums):
    """At a marked candidate, writes a line to a named pipe and then blocks until its process ends."""

    pipe: Path

    def evaluate(self, candidates, seeds, threads):
        if MARK in candidates[:, 0]:
            self.block()
        return super().evaluate(candidates, seeds, threads)

    def block(self):
        self.open_pipe = self.pipe.open("w")
        self.open_pipe.write("here\n")
        self.open_pipe.flush()
        while True:
            signal.pause()


@dataclass
class StuckOnANode(Stuck):
    """At a marked candidate, blocks for ever on one node of a Ray cluster; on others, until the gate has a byte."""

    gate: Path
    node: str

    def block(self):
        import ray

        if ray.get_runtime_context().get_node_id() == self.node:
            super().block()
        with self.gate.open("rb", buffering=0) as gate:
            gate.read(1)


@dataclass
class OpenPipe(Sums):
    """Keeps a named pipe open as long as its worker lives."""

    pipe: Path

    def prepare(self):
        super().prepare()
        self.open_pipe = self.pipe.open("w")

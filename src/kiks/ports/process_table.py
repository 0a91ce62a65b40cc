"""The processes of a sandbox, as the system's folder /proc tells of them: their time and memory."""

from __future__ import annotations

import contextlib
import os
from typing import NamedTuple


class Sample(NamedTuple):
    """A process at an instant: its processor time, and that of its ended children [s]; its memory [bytes]."""

    process: int
    parent: int
    is_running: bool
    own_s: float
    children_s: float
    memory: int


class ProcessTable:
    """A process and all that it has started.

    Args:
        process: Its number.
        is_namespace: Whether it is the first process of a namespace, whose processes are all its own.
    """

    def __init__(self, process: int, *, is_namespace: bool) -> None:
        self._first, self._is_namespace = 1 if is_namespace else process, is_namespace
        self._folder = -1
        with contextlib.suppress(OSError):
            folder = f"/proc/{process}/root/proc" if is_namespace else "/proc"
            self._folder = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)

    def close(self) -> None:
        """Let go of the folder; there are no samples any more."""
        if self._folder >= 0:
            folder, self._folder = self._folder, -1
            os.close(folder)

    def samples(self) -> list[Sample]:
        """Return the processes, the first one first; none if it has ended."""
        if self._folder < 0:
            return []
        found: dict[int, Sample] = {}
        try:
            names = os.listdir(self._folder)
        except OSError:  # another thread has closed it meanwhile
            return []
        for name in names:
            if name.isdigit() and (sample := _sample(self._folder, int(name))) is not None:
                found[sample.process] = sample
        if self._first not in found:
            return []
        if self._is_namespace:
            return [found.pop(self._first), *found.values()]
        children: dict[int, list[int]] = {}
        for each in found.values():
            children.setdefault(each.parent, []).append(each.process)
        family = [self._first]
        for process in family:
            family += children.get(process, [])
        return [found[process] for process in family]

    def own_memory(self, sample: Sample) -> int:
        """Return the memory of a process, of shared pages its share [bytes]."""
        text = _read(self._folder, f"{sample.process}/smaps_rollup")
        shares = [line.split()[1] for line in text.splitlines() if line.startswith("Pss:")]
        return int(shares[0]) * 1024 if shares else sample.memory


def _sample(folder: int, process: int) -> Sample | None:
    text = _read(folder, f"{process}/stat")
    # Its name, in brackets, may hold anything. See proc(5).
    fields = text.rpartition(")")[2].split()
    if len(fields) < 22:
        return None
    ticks_a_second, page_bytes = os.sysconf("SC_CLK_TCK"), os.sysconf("SC_PAGE_SIZE")
    own_s, children_s = (sum(map(int, fields[at : at + 2])) / ticks_a_second for at in (11, 13))
    return Sample(process, int(fields[1]), fields[0] in "RD", own_s, children_s, int(fields[21]) * page_bytes)


def _read(folder: int, name: str) -> str:
    try:
        with open(name, "rb", opener=lambda path, flags: os.open(path, flags, dir_fd=folder)) as file:
            return file.read().decode(errors="replace")
    except OSError:
        return ""

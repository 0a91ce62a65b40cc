"""The processes of a sandbox, as the system's folder /proc tells of them: their time and memory.

Some of what they take is in no process at a look: data in sockets that was not read, files in memory, and
the time of processes that come and go between two looks. That is estimated from above.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from kiks.ports.bubblewrap import WRITABLE

THREAD_BYTES = 1 << 15
"""What the kernel keeps for each thread [bytes]: its stack, and more."""

DESCRIPTOR_BYTES = 1 << 15
"""Most that it keeps for each descriptor [bytes]: a full pipe has two."""

FILE_BYTES = 1 << 11
"""What it keeps for each file in memory beside its content [bytes]: a long name, and more."""

MAP_BYTES, MANY_MAPS_BYTES = 1 << 9, 1 << 25
"""What it keeps for each map of memory, and most for as many as a process may have [bytes]."""

MAPS_READ_BYTES = 1 << 18
"""Most that is read of a process's list of maps [bytes]: some thousands."""

_SIZES = re.compile(r"^(VmRSS|VmSwap|VmPTE|FDSize|Threads|Pss|Pss_Shmem|SwapPss):\s*(\d+)", re.MULTILINE)


class ProcessSample(NamedTuple):
    """A process at an instant.

    Attributes:
        process: Its number.
        parent: That of its parent.
        is_running: Whether it computes, or could if a processor were free.
        own_s: Its processor time [s].
        children_s: That of its children which have ended, as far as they were waited for [s].
        threads: Number of its threads.
        memory: Its memory, also what is swapped out, and of shared pages all [bytes].
        kernel_memory: What the kernel keeps for it [bytes].
        has_many_maps: Whether its memory is in more pieces than can be looked at in a short time.
    """

    process: int
    parent: int
    is_running: bool
    own_s: float
    children_s: float
    threads: int
    memory: int
    kernel_memory: int
    has_many_maps: bool


class ProcessTable:
    """A process and all that it has started.

    Args:
        process: Its number.
        is_namespace: Whether it is the first process of a namespace, whose processes are all its own.
    """

    def __init__(self, process: int, *, is_namespace: bool) -> None:
        self._first, self._is_namespace = 1 if is_namespace else process, is_namespace
        self._folder, self._written = -1, [-1] * len(WRITABLE) * is_namespace
        root = f"/proc/{process}/root" if is_namespace else ""
        with contextlib.suppress(OSError):
            self._folder = os.open(f"{root}/proc", os.O_RDONLY | os.O_DIRECTORY)
            self._written = [os.open(root + folder, os.O_RDONLY) for folder in WRITABLE * is_namespace]

    def close(self) -> None:
        """Let go of the folders; there are no samples any more."""
        folders, self._folder, self._written = [self._folder, *self._written], -1, []
        for folder in folders:
            if folder >= 0:
                os.close(folder)

    def samples(self) -> list[ProcessSample]:
        """Return the processes, the first one first; none if it has ended."""
        samples = (_sample(self._folder, number) for number in self._numbers())
        found = {sample.process: sample for sample in samples if sample is not None}
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

    def namespace_count(self) -> int:
        """Return how many processes its namespace has; 0 without one."""
        return len(self._numbers()) if self._is_namespace else 0

    def _numbers(self) -> list[int]:
        """Return the numbers of all processes in the folder."""
        if self._folder < 0:
            return []
        try:
            return [int(name) for name in os.listdir(self._folder) if name.isdigit()]
        except OSError:  # another thread has closed it meanwhile
            return []

    def own_memory(self, sample: ProcessSample) -> int:
        """Return the memory of a process, of shared pages its share; in a namespace without files in memory."""
        sizes = {} if sample.has_many_maps else _sizes(self._folder, f"{sample.process}/smaps_rollup")
        if "Pss" not in sizes:
            return sample.memory
        files = sizes.get("Pss_Shmem", 0) if self._is_namespace else 0
        return (sizes["Pss"] - files + sizes.get("SwapPss", 0)) * 1024

    def memory_outside(self) -> int:
        """Return how much memory of a namespace is at most in no process [bytes]: files in memory, and in sockets."""
        if not self._is_namespace:
            return 0
        spaces = list(map(_space, self._written))
        used = [(each.f_blocks - each.f_bfree) * each.f_frsize for each in spaces]
        used += [(each.f_files - each.f_ffree) * FILE_BYTES for each in spaces]
        lines = [_read(self._folder, f"1/net/{name}") for name in ("sockstat", "sockstat6")]
        counts = dict(re.findall(r"^(sockets|TCP6?): (?:used|inuse) (\d+)", "\n".join(lines), re.MULTILINE))
        streams = int(counts.get("TCP", 0)) + int(counts.get("TCP6", 0))
        return sum(used) + int(counts.get("sockets", 0)) * _SOCKET_BYTES + streams * _TCP_BYTES

    def file_count(self) -> int:
        """Return how many files in memory a namespace has, and locks of files: each takes memory of the kernel."""
        if not self._is_namespace:
            return 0
        files = sum(each.f_files - each.f_ffree for each in map(_space, self._written))
        return files + _read(self._folder, "locks").count("\n")


class ProcessorTime:
    """Adds up the processor time of processes.

    A process whose parent ignores its end takes its time with it, so time that was seen once is kept. One that begins
    and ends between two looks is seen by chance: each one that is new and computes counts as if it had done so since
    the last look. For many that is right on average, and those that are waited for tell how long it was.

    Attributes:
        total_s: Their time so far [s].
    """

    def __init__(self) -> None:
        self.total_s = 0.0
        self._last: dict[int, ProcessSample] = {}
        self._own_s = self._ended_s = self._short_s = 0.0
        self._processors = os.cpu_count() or 1

    def add(self, first: ProcessSample, others: Sequence[ProcessSample], passed_s: float) -> float:
        """Take a look at the processes; return the time that has come since the last one [s].

        Args:
            first: The first process, which is trusted: of its time only that of its ended children counts.
            others: All others.
            passed_s: Real time since the last look [s].
        """
        last, now = self._last, {each.process: each for each in (first, *others)}
        for each in others:
            before = last.get(each.process)
            self._own_s += each.own_s - (before.own_s if before else 0.0)
            if before is None and (each.is_running or each.threads > 1):
                self._short_s += max(passed_s * min(each.threads, self._processors) - each.own_s, 0.0)
        ended_s = sum(
            each.children_s - (last[number].children_s if number in last else 0.0) for number, each in now.items()
        )
        # What of it was seen before they ended.
        ended_s -= sum(each.own_s + each.children_s for number, each in last.items() if number not in now)
        self._ended_s += max(ended_s, 0.0)
        self._last = now
        total_s = self._own_s + max(self._ended_s, self._short_s)
        grown_s, self.total_s = total_s - self.total_s, total_s
        return grown_s


def _sample(folder: int, process: int) -> ProcessSample | None:
    text = _read(folder, f"{process}/stat")
    # Its name, in brackets, may hold anything. See proc(5).
    fields = text.rpartition(")")[2].split()
    if len(fields) < 22:
        return None
    ticks_a_second = os.sysconf("SC_CLK_TCK")
    own_s, children_s = (sum(map(int, fields[at : at + 2])) / ticks_a_second for at in (11, 13))
    sizes = _sizes(folder, f"{process}/status")
    threads = sizes.get("Threads", 1)
    if threads > 1 and "VmRSS" not in sizes:
        # Its first thread has ended, and only the others tell of their memory.
        sizes = max((_sizes(folder, name) for name in _threads(folder, process)), key=len, default=sizes)
    memory = (sizes.get("VmRSS", 0) + sizes.get("VmSwap", 0)) * 1024
    maps = _read(folder, f"{process}/maps", MAPS_READ_BYTES)
    # It can hide them.
    has_many_maps = "VmRSS" in sizes and len(maps) in (0, MAPS_READ_BYTES)
    kernel_memory = MANY_MAPS_BYTES if has_many_maps else maps.count("\n") * MAP_BYTES
    kernel_memory += sizes.get("VmPTE", 0) * 1024
    kernel_memory += threads * THREAD_BYTES + sizes.get("FDSize", 0) * DESCRIPTOR_BYTES
    is_running = fields[0] == "R"
    return ProcessSample(
        process, int(fields[1]), is_running, own_s, children_s, threads, memory, kernel_memory, has_many_maps
    )


def _threads(folder: int, process: int) -> list[str]:
    try:
        return [f"{process}/task/{name}/status" for name in os.listdir(f"/proc/self/fd/{folder}/{process}/task")]
    except OSError:  # it has ended
        return []


def _sizes(folder: int, name: str) -> dict[str, int]:
    """Return what a file says of sizes, by their names [kB], and of the number of threads."""
    return {key: int(value) for key, value in _SIZES.findall(_read(folder, name))}


def _read(folder: int, name: str, most: int = -1) -> str:
    try:
        with open(name, "rb", opener=lambda path, flags: os.open(path, flags, dir_fd=folder)) as file:
            return file.read(most).decode("latin-1")
    except OSError:
        return ""


def _space(folder: int) -> os.statvfs_result:
    try:
        return os.statvfs(folder)
    except OSError:  # another thread has closed it meanwhile
        return os.statvfs_result((1,) + (0,) * 9)


def _most_bytes(name: str, usual: int) -> int:
    """Return the largest number of a setting of the network [bytes]."""
    try:
        return int((Path("/proc/sys/net") / name).read_text().split()[-1])
    except (OSError, ValueError, IndexError):
        return usual


_SOCKET_BYTES = 2 * max(_most_bytes("core/wmem_default", 212992), _most_bytes("core/rmem_default", 212992))
"""Most that a socket keeps unread [bytes]: the last message may be as long as all before it."""

_TCP_BYTES = _most_bytes("ipv4/tcp_wmem", 4 << 20) + _most_bytes("ipv4/tcp_rmem", 6 << 20)
"""Most that one of TCP keeps [bytes]."""

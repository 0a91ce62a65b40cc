"""Control groups of Linux: the kernel itself holds the limits of a sandbox, where this user may make a group."""

from __future__ import annotations

import contextlib
import os
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

_LIMITS = {
    "cgroup2": {"pids": ["pids.max"], "memory": ["memory.max", "memory.swap.max"]},
    "cgroup": {"pids": ["pids.max"], "memory": ["memory.limit_in_bytes"]},
}
"""The files of the limits by their kinds, of version 2 and of version 1 (cgroups(7))."""

# A group that cannot be joined, as its user may not leave the one before, is none.
_JOIN = 'until [ "$1" = -- ]; do { echo $$ > "$1/cgroup.procs"; } 2> /dev/null; shift; done; shift; exec "$@"'


class ControlGroup:
    """A control group; one of version 1 has a folder for each kind of limit. Without a right to make one it has none.

    Args:
        processes: Most processes in it, and threads.
        memory: Most memory of all together, with what the kernel keeps for them [bytes].

    Attributes:
        folders: Its folders.
    """

    def __init__(self, processes: int, memory: int) -> None:
        self.folders: list[Path] = []
        most = {"pids.max": processes, "memory.max": memory, "memory.limit_in_bytes": memory, "memory.swap.max": 0}
        with contextlib.suppress(OSError):
            for parents, names in _hierarchies():
                made = next(filter(None, (_made_in(parent, names[0]) for parent in parents)), None)
                if made is not None:
                    _remove_old(made.parent)
                    self.folders.append(made)
                    for name in names:
                        if (made / name).exists():  # not each kernel limits swap
                            (made / name).write_text(str(most[name]))

    def line(self, line: list[str]) -> list[str]:
        """Return a command line that runs another one in the group."""
        return ["sh", "-c", _JOIN, "sh", *map(str, self.folders), "--", *line] if self.folders else line

    @property
    def is_out_of_memory(self) -> bool:
        """Whether the kernel has ended a process of it for its memory."""
        said = ""
        for folder in self.folders:
            for name in ("memory.events", "memory.oom_control"):
                with contextlib.suppress(OSError):
                    said += (folder / name).read_text()
        return re.search(r"^oom_kill [1-9]", said, re.MULTILINE) is not None

    def close(self) -> None:
        """Remove it, after its processes have ended."""
        for folder in self.folders:
            with contextlib.suppress(OSError):
                folder.rmdir()


def _hierarchies() -> Iterator[tuple[list[Path], list[str]]]:
    """Yield for each hierarchy with limits the groups above this process, the nearest first, and the limits' files."""
    own = [line.split(":", 2)[1:] for line in Path("/proc/self/cgroup").read_text().splitlines()]
    # Of each mount: its place, its kind, and with which controllers (proc_pid_mountinfo(5)).
    mounts = Path("/proc/self/mountinfo").read_text()
    for place, kind, options in re.findall(r"^(?:\S+ ){4}(\S+) .* - (cgroup2?) \S+ (\S+)", mounts, re.MULTILINE):
        # Version 2 has all controllers in one hierarchy, and names none.
        has = _LIMITS[kind] if kind == "cgroup2" else _LIMITS[kind].keys() & options.split(",")
        names = [name for controller in has for name in _LIMITS[kind][controller]]
        for controllers, path in own:
            is_here = controllers in options.split(",") if kind == "cgroup" else not controllers
            if names and is_here:
                folder = Path(place, path.lstrip("/"))
                yield [each for each in (folder, *folder.parents) if each.is_relative_to(place)], names


def _remove_old(parent: Path) -> None:
    """Remove the groups of processes that were killed; one in which something still runs cannot be removed."""
    for each in parent.glob("kiks-*-*"):
        if not Path("/proc", each.name.split("-")[1]).exists():
            with contextlib.suppress(OSError):
                each.rmdir()


def _made_in(parent: Path, name: str) -> Path | None:
    """Make a group below another one; return None where it cannot be, or has no limit of that name."""
    with contextlib.suppress(OSError):
        made = Path(tempfile.mkdtemp(prefix=f"kiks-{os.getpid()}-", dir=parent))
        if os.access(made / name, os.W_OK):
            return made
        made.rmdir()
    return None

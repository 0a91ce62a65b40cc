"""What came to the engine in a run: all that Python has changed in its arrays between two of its calls.

With that the engine makes the run again by itself, without lines, firmwares, turrets or hands: whatever they are, they
act on the engine through the bytes of its arrays alone.

The arrays that change are robots, bodies and lamps. Their words of four bytes are compared with those that the engine
has left, before time passes and at each checkpoint. Words that change together again and again are a pattern, and the
values of each word a column, so that an hour of a run packs into some hundred kilobytes. Where arrays are added,
replaced or get another shape, a new segment begins, with all that the engine's scene is then.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.engine import step
from kiks.recording.replay import Replay
from kiks.sim.simulation import Simulation

CHANGING = ("robots", "bodies", "lamps")
"""Arrays of a scene that Python changes within a segment."""

FIXED = ("kinds", "networks", "seeds", "brightness", "floor")
"""Arrays of a scene that a segment holds, and that do not change in it."""

TABLES = ("clearance", "rooms", "leaps", "faces", "plains")
"""Arrays of a scene that follow from the brightness of walls and floor."""

NUMBERS = ("widest_mm", "sight_mm", "cell_mm", "pad")
"""Numbers of a scene."""

CHECK, SEGMENT, PATTERNS = 0, 1, 2
"""What a moment is: a checkpoint, the begin of a segment, or a change of the words of a pattern, from `PATTERNS` on."""

WORDS_MAX = 64
"""Words of an array that may change one by one: where more do, all of it counts as changed."""


class Packed(NamedTuple):
    """Inputs in a form that packs well.

    Attributes:
        head: What `engine_inputs.js` needs to read the rest, for JSON.
        parts: Bytes, in this order: the differences of the moments' ticks; what each moment is; the hashes of the
            checkpoints, eight bytes each; the values of each word that changes, in the order in which patterns name
            them first; the contents of segments. Numbers of four bytes come as their first bytes, then their second
            ones, and so on.
    """

    head: dict[str, Any]
    parts: list[bytes]


class EngineInputs:
    """Collects what comes to the engine while a recorded run is made again.

    Args:
        replay: The run, which has not yet gone on.
        shown: Returns for each robot a word of what is shown of it and is no array of the engine, uint32 [robot].
    """

    def __init__(self, replay: Replay, shown: Callable[[Simulation], NDArray[np.uint32]]) -> None:
        self._sim, self._world = replay.sim, replay.sim.world
        self._shown = shown
        self._ticks: list[int] = []
        self._whats: list[int] = []
        self._patterns: dict[tuple[bytes, ...], int] = {}
        self._values: list[NDArray[np.uint32]] = []
        self._hashes: list[str] = []
        self._segments: list[dict[str, Any]] = []
        self._contents: dict[bytes, int] = {}
        self._scene: Any = None
        self._fixed: dict[str, NDArray[Any]] = {}
        self._layout: Any = None
        self._left: list[bytes] = []
        self._replay = replay
        self._begin_ns = replay.sim.now_ns
        self.note()
        self._world.advance = self._advance
        replay.on_check = self._note_check

    def _advance(self, scene: Any, tick: int, tick_count: int) -> None:
        """Let time pass, and remember what the engine leaves."""
        self._note(tick)
        step.advance(scene, tick, tick_count)
        arrays = self._world.arrays
        self._left[: len(CHANGING)] = [arrays[name].tobytes() for name in CHANGING]

    def _note_check(self) -> None:
        self.note()
        self._add(self._world.state.tick_count, CHECK)
        self._hashes.append(self._replay.state_hash)

    def note(self) -> None:
        """Note what has changed up to the present state, whose ticks are done."""
        self._note(self._world.state.tick_count)

    def _note(self, tick: int) -> None:
        arrays = self._world.arrays
        now, left = [arrays[name].tobytes() for name in CHANGING], self._left[: len(CHANGING)]
        if self._world.scene is not self._scene or [*map(len, now)] != [*map(len, left)]:
            self._scene = self._world.scene
            if self._is_other(arrays):
                self._begin_segment(tick, now)
                return
        if now == left:
            return
        now.append(self._shown(self._sim).tobytes())
        pattern, values = [], []
        for before, after in zip(self._left, now, strict=True):
            words = np.frombuffer(after, np.uint32)
            changed = np.flatnonzero(words != np.frombuffer(before, np.uint32))
            if len(changed) > WORDS_MAX:
                changed = np.arange(len(words))
            pattern.append(changed.astype(np.int32).tobytes())
            values.append(words[changed])
        self._left = now
        what = self._patterns.setdefault(tuple(pattern), PATTERNS + len(self._patterns))
        self._add(tick, what)
        self._values.append(np.concatenate(values))

    def _add(self, tick: int, what: int) -> None:
        self._ticks.append(tick)
        self._whats.append(what)

    # ---- segments ----

    def _is_other(self, arrays: dict[str, NDArray[Any]]) -> bool:
        """Return whether a new segment begins."""
        fixed, before = {name: arrays[name] for name in FIXED}, self._fixed
        layout = {name: array.shape for name, array in arrays.items()}, [self._scene[name].item() for name in NUMBERS]
        is_same = layout == self._layout and all(
            array is before[name] or array.tobytes() == before[name].tobytes() for name, array in fixed.items()
        )
        self._fixed, self._layout = fixed, layout
        return not is_same

    def _begin_segment(self, tick: int, now: list[bytes]) -> None:
        arrays = self._world.arrays
        self._left = [*now, self._shown(self._sim).tobytes()]
        self._add(tick, SEGMENT)
        held: dict[str, bytes] = dict(zip(CHANGING, now, strict=True))
        held |= {name: arrays[name].tobytes() for name in FIXED}
        self._segments.append(
            {
                "arrays": {
                    name: {"shape": array.shape, "size": array.itemsize}
                    | ({"content": self._content(held[name])} if name in held else {"is_table": name in TABLES})
                    for name, array in arrays.items()
                },
                "numbers": dict(zip(NUMBERS, self._layout[1], strict=True)),
                "shown": self._content(self._left[-1]),
            }
        )

    def _content(self, data: bytes) -> int:
        """Return the number of a content, which is added if it is not there."""
        return self._contents.setdefault(data, len(self._contents))

    # ---- packed ----

    def pack(self) -> Packed:
        """Return all that was noted."""
        patterns = [[np.frombuffer(words, np.int32) for words in pattern] for pattern in self._patterns]
        columns: dict[tuple[int, int], list[tuple[int, int]]] = {}
        places = [
            [(array, word) for array, words in enumerate(pattern) for word in words.tolist()] for pattern in patterns
        ]
        for pattern, named in enumerate(places):
            for place, name in enumerate(named):
                columns.setdefault(name, []).append((pattern, place))
        changes = np.array([what - PATTERNS for what in self._whats if what >= PATTERNS], np.int64)
        order = [np.flatnonzero(changes == pattern) for pattern in range(len(patterns))]
        tables = [np.array([self._values[k] for k in rows], np.uint32) for rows in order]
        parts = [_planes(np.diff(self._ticks, prepend=0)), _planes(np.array(self._whats)), _hash_bytes(self._hashes)]
        is_summed = []
        for named in columns.values():
            rows = np.concatenate([order[pattern] for pattern, _ in named])
            values = np.concatenate([tables[pattern][:, place] for pattern, place in named])
            summed, part = _column(values[np.argsort(rows)])
            is_summed.append(summed)
            parts.append(part)
        head = {
            "begin_ns": self._begin_ns,
            "moment_count": len(self._ticks),
            "check_count": len(self._hashes),
            "patterns": [[_runs(words) for words in pattern] for pattern in patterns],
            "is_summed": "".join(str(int(each)) for each in is_summed),
            "segments": self._segments,
            "contents": [len(data) for data in self._contents],
        }
        return Packed(head, [*parts, *self._contents])


def _runs(words: NDArray[np.int32]) -> list[int]:
    """Return words as runs: the first one of each and their number, 3, 2 for 3 and 4."""
    begins = np.flatnonzero(np.diff(words, prepend=-2) != 1)
    counts = np.diff(begins, append=len(words))
    return np.column_stack([words[begins], counts]).ravel().tolist()


def _planes(numbers: NDArray[Any]) -> bytes:
    """Return numbers as their first bytes, then their second ones, and so on."""
    return np.ascontiguousarray(numbers.astype("<u4").view(np.uint8).reshape(-1, 4).T).tobytes()


def _column(values: NDArray[np.uint32]) -> tuple[bool, bytes]:
    """Return whether the values of a word are given as sums, and the bytes of them, whichever packs better."""
    change = np.diff(values, prepend=np.uint32(0)).view(np.int32)
    zigzag = (change << 1 ^ change >> 31).view(np.uint32)
    plain, summed = _planes(values), _planes(zigzag)
    is_summed = len(zlib.compress(summed, 1)) < len(zlib.compress(plain, 1))
    return is_summed, summed if is_summed else plain


def _hash_bytes(hashes: list[str]) -> bytes:
    """Return hashes of 16 hexadecimal digits as eight bytes each; zeros for what is none."""
    return b"".join(_bytes_of(each) for each in hashes)


def _bytes_of(digits: str) -> bytes:
    try:
        data = bytes.fromhex(digits)
    except ValueError:
        data = b""
    return data if len(data) == 8 else bytes(8)

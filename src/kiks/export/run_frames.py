"""The frames and messages that browsers of a desk would get of a run, at a fixed period.

A recorded run is made again for it.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterator
from itertools import groupby
from typing import Any

import numpy as np

from kiks.export.frames import arena_picture, describe_scene, describe_shapes, pack_frame, scene_key
from kiks.export.packed_text import packed_text
from kiks.model.arena import Arena
from kiks.recording.log import RecordedLog
from kiks.recording.replay import Replay
from kiks.recording.rerun import RunPiece, run_again
from kiks.sim.simulation import Simulation
from kiks.units import TICK_NS, s_from_ns

PERIOD_NS = 4 * TICK_NS
"""Period of the frames [ns], that of a desk; a long run has twice the period, four times, and so on."""

FRAME_BYTES_MAX = 16 << 20
"""Most bytes of all frames together. Packed, they take a sixth of it or less."""


class Frames:
    """The frames and messages of a run; `web/recorded_feed.js` shows them.

    Attributes:
        begin_ns: When the run begins [ns].
        end_ns: When it ends [ns].
        period_ns: Time between two frames [ns]; the last one may come earlier.
        frames: Of `pack_frame`. The scene of each is an index of `scenes`.
        scenes: Messages of `describe_scene`; `picture` of the arena is an index of `pictures`.
        pictures: Walls, as PNG.
        shapes: Messages of `describe_shapes`, and from which frame on each holds.
    """

    def __init__(self, begin_ns: int, end_ns: int) -> None:
        self.begin_ns, self.end_ns, self.period_ns = begin_ns, end_ns, PERIOD_NS
        self.frames: list[bytes] = []
        self.scenes: list[dict[str, Any]] = []
        self.pictures: list[bytes] = []
        self.shapes: list[tuple[int, dict[str, Any]]] = []

    def fit_period(self, frame_bytes: int) -> None:
        """Choose the shortest period with which all frames of a size have room."""
        while (self.end_ns - self.begin_ns) // self.period_ns * frame_bytes > FRAME_BYTES_MAX:
            self.period_ns *= 2

    def add_picture(self, arena: Arena) -> int:
        """Return the index of the picture of an arena's walls, which is added if it is not there."""
        if (picture := arena_picture(arena)) not in self.pictures:
            self.pictures.append(picture)
        return self.pictures.index(picture)

    def pack(self) -> str:
        """Return all of it as text, in the form of `packed_text`.

        The parts are the frames in groups of equal size. Each group holds the differences of each frame's bytes from
        the frame before it, the first byte of all frames before the second one: most bytes change seldom, or by little.
        """
        groups = [(size, list(group)) for size, group in groupby(self.frames, len)]
        head = {
            "period_s": s_from_ns(self.period_ns),
            "groups": [{"size": size, "count": len(frames)} for size, frames in groups],
            "scenes": self.scenes,
            "shapes": self.shapes,
            "pictures": [f"data:image/png;base64,{base64.b64encode(each).decode()}" for each in self.pictures],
        }
        return packed_text(head, (_differences(size, frames) for size, frames in groups))


def _differences(size: int, frames: list[bytes]) -> bytes:
    """Return the differences of each frame's bytes from the frame before it, column by column."""
    table = np.frombuffer(b"".join(frames), np.uint8).reshape(len(frames), size)
    table = np.diff(table, axis=0, prepend=np.uint8(0))
    return np.ascontiguousarray(table.T).tobytes()


class RunFrames(Frames):
    """The frames of a recorded run.

    Args:
        log: The log of the recording.

    Attributes:
        first: The world at the beginning.
        replay: The run that is made again, at its end when all pieces are.
    """

    def __init__(self, log: RecordedLog) -> None:
        super().__init__(log.begin_ns, log.end_ns)
        self._key: tuple[Any, ...] = ()
        self._arena: Any = None
        self._log = log
        self.first = Replay(log, log.begin_ns).sim

    @classmethod
    def of(cls, log: RecordedLog) -> RunFrames:
        """Return all frames of a run."""
        frames = cls(log)
        for _ in frames.pieces():
            pass
        return frames

    def pieces(self, on_progress: Callable[[float], None] = lambda share: None) -> Iterator[RunPiece]:
        """Make the run again, take the frames, and yield its pieces, as `run_again` does.

        Args:
            on_progress: Called now and then with the share that is done.
        """

        def look(replay: Replay) -> int:
            self.replay = replay
            self._take()
            if len(self.frames) == 1:
                self.fit_period(len(self.frames[0]))
            elif len(self.frames) % 100 == 0:
                on_progress((replay.sim.now_ns - self.begin_ns) / (self.end_ns - self.begin_ns))
            return self.begin_ns + len(self.frames) * self.period_ns

        yield from run_again(self._log, look=look)
        while self.replay.advance():
            pass
        self.replay.sim.advance_to(self.end_ns)
        if self.end_ns > self.begin_ns:
            self._take()
        on_progress(1.0)

    def _take(self) -> None:
        """Add a frame of the present state."""
        sim = self.replay.sim
        with sim.lock:
            sim.sync()
            if self._key != (key := scene_key(sim)):
                self._key = key
                self._take_scene(sim)
            shapes = describe_shapes(sim)
            if not self.shapes or self.shapes[-1][1] != shapes:
                self.shapes.append((len(self.frames), shapes))
            self.frames.append(pack_frame(sim, scene=len(self.scenes) - 1, is_coarse=True))

    def _take_scene(self, sim: Simulation) -> None:
        """Add the present scene if it differs from the last one."""
        if sim.arena is not self._arena:
            self._arena, self._picture = sim.arena, self.add_picture(sim.arena)
        number = len(self.scenes)
        scene = describe_scene(sim, number)
        scene["arena"]["picture"] = self._picture
        if not self.scenes or scene != self.scenes[-1] | {"scene": number}:
            self.scenes.append(scene)
            self.shapes.append((len(self.frames), describe_shapes(sim)))

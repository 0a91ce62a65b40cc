"""A recorded run as a page holds it: what came to the engine, which makes the run again, and the messages of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.export.browser_engine import ENGINE
from kiks.export.frames import LEDS, describe_scene, describe_shapes, robots_with_camera, scene_key
from kiks.export.looks import lit_leds
from kiks.export.packed_text import packed_text
from kiks.export.shown_run import PERIOD_NS, ShownRun
from kiks.recording.engine_inputs import EngineInputs
from kiks.recording.log import RecordedLog
from kiks.recording.replay import Replay
from kiks.recording.rerun import RunPiece, run_again
from kiks.sim.simulation import Simulation


class PageRun(ShownRun):
    """A recorded run; `web/run_feed.js` shows it.

    Frames are at its begin, at each whole period after it, and at its end.

    Args:
        log: The log of the recording.

    Attributes:
        first: The world at the beginning.
        replay: The run that is made again, at its end when all pieces are.
    """

    def __init__(self, log: RecordedLog) -> None:
        super().__init__(log.begin_ns, log.end_ns)
        self._log = log
        self._key: tuple[Any, ...] = ()
        self._arena: Any = None
        self._scene_begins: list[int] = []
        self._frame_count = 0
        self.first = Replay(log, log.begin_ns).sim

    @classmethod
    def of(cls, log: RecordedLog) -> PageRun:
        """Return a run with all that a page needs."""
        run = cls(log)
        for _ in run.pieces():
            pass
        return run

    def pieces(self, on_progress: Callable[[float], None] = lambda share: None) -> Iterator[RunPiece]:
        """Make the run again, take what the page needs, and yield its pieces, as `run_again` does.

        Args:
            on_progress: Called now and then with the share that is done.
        """

        def look(replay: Replay) -> int:
            if not self._frame_count:
                self.replay, self._inputs = replay, EngineInputs(replay, _flags)
            self._take()
            if self._frame_count % 100 == 0:
                on_progress((replay.sim.now_ns - self.begin_ns) / (self.end_ns - self.begin_ns))
            return (replay.sim.now_ns // PERIOD_NS + 1) * PERIOD_NS

        yield from run_again(self._log, look=look)
        while self.replay.advance():
            pass
        self.replay.sim.advance_to(self.end_ns)
        self._take()
        self._inputs.note()
        on_progress(1.0)

    def _take(self) -> None:
        """Note the messages of a frame, if they are others."""
        sim = self.replay.sim
        with sim.lock:
            sim.sync()
            if self._key != (key := scene_key(sim)):
                self._key = key
                self._take_scene(sim)
            shapes = describe_shapes(sim)
            if self.shapes[-1][1] != shapes:
                self.shapes.append((self._frame_count, shapes))
        self._frame_count += 1

    def _take_scene(self, sim: Simulation) -> None:
        """Add the present scene if it differs from the last one."""
        if sim.arena is not self._arena:
            self._arena, self._picture = sim.arena, self.add_picture(sim.arena)
        number = len(self.scenes)
        scene = describe_scene(sim, number)
        scene["arena"]["picture"] = self._picture
        scene["cameras"] = robots_with_camera(sim)
        if not self.scenes or scene != self.scenes[-1] | {"scene": number}:
            self.scenes.append(scene)
            self._scene_begins.append(self._frame_count)
            self.shapes.append((self._frame_count, describe_shapes(sim)))

    def pack(self) -> str:
        """Return all of it as text, in the form of `packed_text`."""
        inputs = self._inputs.pack()
        # As the loop of a batch takes them.
        switches = sorted([each.tick, 2 * (each.lamp - 1) + each.is_on] for each in self.replay.sim.arena.lamp_switches)
        times = {"begin_ns": self.begin_ns, "end_ns": self.end_ns, "period_ns": self.period_ns}
        run = {"scene_begins": self._scene_begins, "inputs": inputs.head, "lamp_switches": switches}
        return packed_text(times | self.messages() | run, inputs.parts)


def _flags(sim: Simulation) -> NDArray[np.uint32]:
    """Return the flags of robots in frames that the engine does not know."""
    flags: NDArray[np.uint32] = lit_leds(sim.specs, sim.world.state.robots[0]) * np.uint32(LEDS)
    return flags


@lru_cache(1)
def packed_engine() -> str:
    """Return the engine for browsers as text."""
    return packed_text({}, [ENGINE.read_bytes()])

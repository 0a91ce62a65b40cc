"""Looking back: what browsers see of the past of a desk's world, and how they move in it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import TimeoutError as NotYet
from contextlib import suppress
from pathlib import Path

from kiks.desk.server.desk_world import DeskWorld, Speedometer
from kiks.desk.server.marks import Mark, MarkReader, next_mark
from kiks.desk.server.player import Player, Span
from kiks.errors import KiksError, LinkError, ParameterError
from kiks.recording.log import RecordedLog, Source
from kiks.recording.mcap_file import McapReader
from kiks.recording.recorder import RunWriter
from kiks.recording.recording import Recording
from kiks.recording.ring import Ring
from kiks.sim.simulation import Simulation
from kiks.units import ns_from_s, s_from_ns

CLOSE_S = 1.0
"""Longest wait for the end of the recording when the desk is closed [s]."""


class _History:
    """What is read of a run.

    Args:
        source: Its recording.

    Attributes:
        source: Its recording.
        log: For the thread of the server; each thread reads with a log of its own.
        reader: Reads what has happened.
        marks: What has happened, as far as it was read.
    """

    def __init__(self, source: Source) -> None:
        self.source, self.log, self.reader = source, RecordedLog(source), MarkReader(RecordedLog(source))
        self.marks: list[Mark] = []


class LookingBack:
    """Shows the past of a desk's world; the world stands still meanwhile, and goes on unchanged after it.

    All browsers of the desk share it.

    Args:
        present: Returns the world that goes on.
        say: Called with messages for people.

    Attributes:
        past: What is shown of the past; None while the present is shown.
        has_present: Whether a world goes on besides the past; False while the desk shows only a file.
        run: Stands for the run of the present world, also where it goes on from its past.
    """

    def __init__(self, present: Callable[[], DeskWorld], say: Callable[[str], None]) -> None:
        self.past: Player | None = None
        self.has_present = True
        self.run = object()
        self._present, self._say = present, say
        # What led to the present, and the other run that is shown, if there is one.
        self._own_history: _History | None = None
        self._other_history: _History | None = None
        self._writer: RunWriter | None = None
        self._is_recorded = False
        self._was_running = False
        # Time [ns] and note of bookmarks that were set in a finished recording, which cannot keep them.
        self._bookmarks: list[tuple[int, str]] = []
        self._wanted_ns: int | None = None
        self._turn = asyncio.Lock()

    @property
    def _history(self) -> _History | None:
        """What people see of the past."""
        return self._other_history or self._own_history

    @property
    def marks(self) -> list[Mark]:
        """What has happened, as far as it was read."""
        history = self._history
        return [] if history is None else history.marks

    @property
    def is_own(self) -> bool:
        """Whether what is shown of the past led to the present."""
        return self.has_present and self._other_history is None

    # ---- what is recorded; with the lock of the present world ----

    def start_history(self) -> None:
        """Record the present world and all later ones, unless a recording is shown; from any thread."""
        sim = self._present().sim
        with sim.lock:
            self._is_recorded = True
            if self.has_present:
                self.begin(sim)

    def begin(self, sim: Simulation, *, is_branch: bool = False) -> None:
        """Record another world, if worlds are recorded.

        Args:
            sim: The world.
            is_branch: Whether it goes on from a time of the past, which is kept up to there; else it is forgotten.
        """
        self.run = self.run if is_branch else object()
        before, bookmarks = (self._history, self._bookmarks) if is_branch else (None, [])
        self._other_history, self._bookmarks = None, []
        self._forget()
        if not self._is_recorded:
            return
        try:
            ring = Ring(sim, self._say)
            if before is not None:
                ring.copy(RecordedLog(before.source), sim.now_ns)
            self._writer = RunWriter.of(sim)
            self._writer.add(ring)
            self._own_history = _History(ring)
            for time_ns, note in bookmarks:
                if time_ns <= sim.now_ns:
                    self._writer.mark(note, time_ns)
            self._flush(sim)
        except (KiksError, OSError) as error:
            self._say(f"People cannot look back at this run: {error}")

    def _forget(self) -> None:
        if self._writer is not None and self._own_history is not None and isinstance(self._own_history.source, Ring):
            self._writer.remove(self._own_history.source)
        self._own_history = self._writer = None

    async def bookmark(self, time_ns: int, note: str) -> None:
        """Set a bookmark at a time [ns]; what records the world keeps it."""

        def mark(sim: Simulation) -> None:
            if self._writer is None:
                self._bookmarks.append((time_ns, note))
            else:
                self._writer.mark(note, time_ns)
                self._flush(sim)

        await self._present().do(mark)
        await self.poll()

    def show_recording(self, file: Path, time_ns: int) -> None:
        """Show a recording from a time on [ns]; the present world stands still until a person goes on from there."""
        self._own_history = history = _History(McapReader(file))
        history.marks = history.reader.read(has_contacts=True)
        self._present().pause()
        self.has_present = False
        self._show(time_ns)

    async def show_run(self, file: Path) -> None:
        """Play the recording of another run; the present stands still until people go back to it."""
        async with self._turn:
            history = _History(McapReader(file))
            if self.past is None:
                await self._stop_present()
            elif self.has_present:
                self.stop()
            self._other_history = history
            await asyncio.to_thread(self._show, 0)
            if (past := self.past) is not None:
                await past.do(lambda _: past.gate.go_on())
        await self.poll()

    def stop(self) -> None:
        """Show the present, which is another world now."""
        self._other_history = None
        past, self.past = self.past, None
        self.has_present = True
        if past is not None:
            past.end()

    def close(self) -> None:
        """Forget the past."""
        self.stop()
        self._is_recorded = False
        # The world may be in a long step; then its thread ends the recording.
        with suppress(NotYet):
            self._present().gate.ask(self._forget).result(CLOSE_S)

    # ---- the span and the marks ----

    @property
    def span(self) -> Span | None:
        """From when to when the past goes; None if there is none."""
        if self.past is not None:
            return self.past.span
        history = self._history
        return None if history is None else Span(history.log.begin_ns, self._present().sim.now_ns)

    async def recording(self) -> Recording:
        """Return the recording of what led to the present, with all that has happened up to now."""
        await self._present().do(self._flush)
        if (history := self._history) is None:
            raise ParameterError("Cannot read what happened: the world is not recorded. Is the disk full?")
        return Recording(history.source)

    async def poll(self) -> None:
        """Read what has happened; called about once a second."""
        await self._read_marks(has_contacts=self.past is not None)

    async def _read_marks(self, *, has_contacts: bool) -> None:
        """Read what has happened; contacts only for people who look back, as the run is made again for them."""
        if (history := self._history) is not None:
            with suppress(KiksError):  # a replay tells people of it
                found = await asyncio.to_thread(lambda: history.reader.read(has_contacts=has_contacts))
                bookmarks = (Mark(s_from_ns(time_ns), "bookmark", (note,)) for time_ns, note in self._bookmarks)
                history.marks = sorted([*found, *bookmarks])

    def _flush(self, _sim: Simulation) -> None:
        if self._writer is not None:
            self._writer.flush()

    # ---- where people look ----

    async def look_at(self, time_ns: int) -> None:
        """Show the past at a time [ns], or where it begins or ends; the present stands still meanwhile.

        Of requests that come while one is carried out, only the last one counts.

        Raises:
            LinkError: If there is no past.
        """
        self._wanted_ns = time_ns
        async with self._turn:
            wanted_ns, self._wanted_ns = self._wanted_ns, None
            if wanted_ns is not None:
                await self._look_at(wanted_ns)

    async def _look_at(self, time_ns: int) -> None:
        if self._history is None:
            raise LinkError("Cannot look back: this world is not recorded. Start it over.")
        if (past := self.past) is None:
            await self._stop_present()
            await asyncio.to_thread(self._show, time_ns)
        else:
            await asyncio.to_thread(past.seek, time_ns)
            past.meter = Speedometer()

    async def _stop_present(self) -> None:
        """Let the present stand still while people look back."""
        present = self._present()

        def stop(sim: Simulation) -> None:
            self._was_running = not present.gate.is_paused
            present.drop_all()
            present.pause()
            self._flush(sim)

        await present.do(stop)

    def _show(self, time_ns: int) -> None:
        """Begin to show the past at a time [ns]."""
        history, present = self._history, self._present()
        assert history is not None
        past = Player(RecordedLog(history.source), time_ns, speed=present.gate.speed, say=self._say)
        if self._present() is present:
            self.past = past
            past.start()

    async def move_by(self, seconds: float) -> None:
        """Show the past so many seconds later, or earlier if negative; it stands still there.

        Raises:
            LinkError: If there is no past.
        """
        world = self.past or self._present()
        if self.past is not None or seconds < 0:
            await self._stand_at(world.sim.now_ns + ns_from_s(seconds))

    async def jump(self, *, is_before: bool) -> Mark | None:
        """Show the past at the event after this time, or before it; it stands still there.

        Returns:
            The event; None if there is none.

        Raises:
            LinkError: If there is no past.
        """
        world = self.past or self._present()
        if self.past is None:
            await self._present().do(self._flush)
        await self._read_marks(has_contacts=True)
        mark = next_mark(self.marks, world.sim.now_ns, is_before=is_before)
        if mark is not None:
            await self._stand_at(ns_from_s(mark.time_s))
        return mark

    async def _stand_at(self, time_ns: int) -> None:
        if (past := self.past) is not None:
            await past.do(lambda _: past.pause())
        await self.look_at(time_ns)

    async def turn_at_the_end(self) -> None:
        """Where the past ends, show the present, or the beginning of a recording."""
        past = self.past
        if past is not None and past.sim.now_ns >= past.span.end_ns:
            if self.has_present:
                await self.back_to_now()
            else:
                await self.look_at(past.span.begin_ns)

    async def back_to_now(self) -> None:
        """Show the present again; it goes on if it did before.

        Raises:
            LinkError: If there is none.
        """
        if not self.has_present:
            raise LinkError("This desk shows a recording only. Press 'Go on from here' first.")
        async with self._turn:
            if self.past is None:
                return
            self.stop()
            present = self._present()
            present.meter = Speedometer()
            if self._was_running:
                await present.do(lambda _: present.gate.go_on())

"""Looking back: what browsers see of the past of a desk's world, and how they move in it."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import TimeoutError as NotYet
from contextlib import suppress
from pathlib import Path

from kiks.desk.server.desk_world import DeskWorld, Speedometer
from kiks.desk.server.player import Player, Span
from kiks.desk.server.timeline import Mark, Run, Timeline, next_mark
from kiks.errors import KiksError, LinkError, ParameterError
from kiks.sim.simulation import Simulation
from kiks.units import ns_from_s

CLOSE_S = 1.0
"""Longest wait for the end of the recording when the desk is closed [s]."""


class LookingBack:
    """Shows the past of a desk's world; the world stands still meanwhile, and goes on unchanged after it.

    All browsers of the desk share it.

    Args:
        present: Returns the world that goes on.
        say: Called with messages for people.

    Attributes:
        past: What is shown of the past; None while the present is shown.
        has_present: Whether a world goes on besides the past; False while the desk shows only a file.
        marks: What has happened, as far as it was read.
    """

    def __init__(self, present: Callable[[], DeskWorld], say: Callable[[str], None]) -> None:
        self.past: Player | None = None
        self.has_present = True
        self.marks: list[Mark] = []
        self._present, self._say = present, say
        self._timeline = Timeline()
        self._keeps = False
        self._was_running = False
        self._wanted_ns: int | None = None
        self._turn = asyncio.Lock()
        self._switching = threading.Lock()

    # ---- what is recorded; with the lock of the present world ----

    def keep(self, run: Run | None) -> None:
        """Record the present world and all later ones, unless a recording is shown.

        Args:
            run: How the present one began, if its programs can run again.
        """
        self._keeps = True
        if self.has_present:
            self.begin(self._present().sim, run)

    def begin(self, sim: Simulation, run: Run | None) -> None:
        """Forget the past, as another world begins, and record that if worlds are recorded.

        Args:
            sim: The world.
            run: How it began, if its programs can run again.
        """
        if self._keeps:
            self._try(lambda: self._timeline.begin(sim, run))

    def branch(self, sim: Simulation) -> None:
        """Keep what was before the present time of a world, which goes on from there, and record that."""
        if self._keeps:
            self._try(lambda: self._timeline.branch(sim))

    def _try(self, record: Callable[[], object]) -> None:
        try:
            record()
        except (KiksError, OSError) as error:
            self._say(f"People cannot look back at this run: {error}")

    def show_recording(self, file: Path, time_ns: int) -> None:
        """Show a recording from a time on [ns]; the present world stands still until a person goes on from there."""
        self._timeline.open(file)
        self.marks = self._timeline.read()
        self._present().pause()
        self.has_present = False
        self.past = self._player_at(time_ns, None)
        self.past.start()

    def stop(self) -> None:
        """Show the present, which is another world now."""
        with self._switching:
            past, self.past = self.past, None
            self.has_present = True
        if past is not None:
            past.end()

    def close(self) -> None:
        """Forget the past."""
        self.stop()
        self._keeps = False
        # The world may be in a long step; then its thread ends the recording.
        with suppress(NotYet):
            self._present().gate.ask(self._timeline.close).result(CLOSE_S)

    # ---- the span and the marks ----

    @property
    def span(self) -> Span | None:
        """From when to when the past goes; None if there is none."""
        return self._timeline.span(self._present().sim.now_ns)

    @property
    def run(self) -> Run | None:
        """How the run that is shown began, if its programs can run again."""
        past = self.past
        return None if past is None else self._timeline.run_at(past.sim.now_ns)

    async def file(self) -> Path:
        """Return the file of the recording of the time that is shown, with all that has happened up to now."""
        await self.tend()
        present = self._present()
        await present.do(lambda _: self._timeline.flush())
        if not self._timeline.parts:
            raise ParameterError("the world must be recorded, but its past could not be kept. Is the disk full?")
        return self._timeline.part_at((self.past or present).sim.now_ns).file

    async def tend(self) -> None:
        """Keep the recording going, and read what has happened; called about once a second."""
        present = self._present()
        if self._keeps and self.has_present and self.past is None:
            told = await present.do(self._timeline.tend)
            if told:
                self._say(told)
        with suppress(KiksError):  # a replay tells people of it
            self.marks = await asyncio.to_thread(self._timeline.read)

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
        present, past = self._present(), self.past
        if self.span is None:
            raise LinkError("a world must be recorded for people to look back, but this one is not. Start it over.")
        if past is None:
            await present.do(lambda _: self._stop_present(present))
        span = self.span
        assert span is not None
        time_ns = min(max(time_ns, span.begin_ns), span.end_ns)
        if past is not None and await asyncio.to_thread(past.seek, time_ns):
            past.meter = Speedometer()
            return
        player = await asyncio.to_thread(self._player_at, time_ns, past)
        if self._present() is present:
            self._show(player, past)

    def _stop_present(self, present: DeskWorld) -> None:
        self._was_running = not present.is_paused
        present.drop_all()
        present.pause()
        self._timeline.flush()

    def _player_at(self, time_ns: int, before: Player | None) -> Player:
        present = self._present()
        replay, span = self._timeline.replay_at(time_ns, present.sim.now_ns)
        player = Player(replay, span, speed=(before or present).gate.speed, leave=self._leave, say=self._say)
        if before is not None:
            player.go_like(before)
        return player

    def _show(self, player: Player, before: Player | None) -> bool:
        """Show another part of the past, unless something else is shown by now; return whether it is shown."""
        with self._switching:
            if self.past is not before:
                return False
            self.past = player
        player.start()
        if before is not None:
            before.end()
        return True

    def _leave(self, player: Player, time_ns: int) -> bool:
        """Show a time with another player, as this one cannot; return whether there is such a time."""
        at_ns: int | None = time_ns
        if time_ns >= player.span.end_ns:
            at_ns = self._timeline.begin_after(time_ns, self._present().sim.now_ns)
        span = self.span
        if at_ns is None or span is None or at_ns < span.begin_ns:
            return False
        return self._show(self._player_at(at_ns, player), player)

    async def go_back(self) -> None:
        """Play the past backwards.

        Raises:
            LinkError: If there is no past.
        """
        if self.past is None:
            await self.look_at(self._present().sim.now_ns)
        if (past := self.past) is not None:
            await past.do(lambda _: past.go_back())

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
        past, span = self.past, self.span
        if past is not None and span is not None and past.sim.now_ns >= span.end_ns:
            if self.has_present:
                await self.back_to_now()
            else:
                await self.look_at(span.begin_ns)

    async def back_to_now(self) -> None:
        """Show the present again; it goes on if it did before.

        Raises:
            LinkError: If there is none.
        """
        if not self.has_present:
            raise LinkError("a recording must be gone on from before it has a present. Press 'Go on from here' first.")
        async with self._turn:
            if self.past is None:
                return
            self.stop()
            present = self._present()
            present.meter = Speedometer()
            if self._was_running:
                await present.do(lambda _: present.go_on())

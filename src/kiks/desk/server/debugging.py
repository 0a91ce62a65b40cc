"""The debugger of a desk: it follows the programs of the world, and begins that world again to go back in it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path
from typing import Any

from nicegui import Event, background_tasks

from kiks.debug.code_lines import code_lines
from kiks.debug.session import DebugSession, Stop
from kiks.errors import KiksError, ParameterError
from kiks.ports.program_command import ProgramCommand

STAND_S = 5.0
"""Longest wait for a program that shall stand [s of real time]."""

CHANGED = (
    "You have changed the world, so this is another run now. The debugger cannot go back in it. Press Debug to begin "
    "again."
)


class DeskDebugger:
    """The debugger of a desk, which all its pages share.

    Args:
        desk: The `Desk`.

    Attributes:
        session: What follows the programs of the present world; None if nothing does.
        breakpoints: The lines at which programs stop, by the file; None: in a new one.
        changed: Happens when a program stands or goes on; in the thread of the server.
        located: The file and the line at which the program was at the time of the past that is shown; None if that is
            not known.
    """

    def __init__(self, desk: Any) -> None:
        self._desk = desk
        self.session: DebugSession | None = None
        self.breakpoints: dict[Path | None, list[int]] = {}
        self.changed: Event[[]] = Event()
        self.located: tuple[str, int] | None = None
        self._located_for: object = None
        self._files: object = None

    @property
    def is_there(self) -> bool:
        """Whether a program runs that is followed."""
        return self.session is not None and any(each.is_running for each in self._desk.programs.handles)

    @property
    def is_going_back(self) -> bool:
        """Whether the run is made again up to a place in it."""
        return self.session is not None and self.session.is_going_back

    @property
    def stop(self) -> Stop | None:
        """Where a program stands; None while none does."""
        return self.session.stop if self.session is not None and self.is_there and not self.is_going_back else None

    async def begin(self, command: ProgramCommand, robot: int) -> None:
        """Begin the world again, with a program on a robot that is followed, as are all others."""
        if command.program.suffix != ".py":
            raise ParameterError(f"Only Python programs can be debugged, and {command.name} is none. Press Run.")
        soon = asyncio.get_running_loop().call_soon_threadsafe
        # The thread that moves the world calls these.
        session = DebugSession(lambda *news: soon(self._take, *news), lambda: soon(self._begin_again, session))
        session.has_editor = session.stops_at_end = True
        session.set_filters(["uncaught"])
        self._desk.attach(command, robot)
        self._files = await self._read_files()
        for file in self.breakpoints:
            self._set(session, file)
        await self._desk.start_over(session)
        self.changed.emit()

    def set_breakpoints(self, file: Path | None, lines: list[int]) -> None:
        """Set the breakpoints of a file."""
        self.breakpoints[file] = lines
        if self.session is not None:
            self._set(self.session, file)
        self.changed.emit()

    def _set(self, session: DebugSession, file: Path | None) -> None:
        if file is not None:
            # A program stops where code follows.
            stood = [next((line for line in code_lines(file) if line >= each), each) for each in self.breakpoints[file]]
            lines = [{"line": line} for line in stood]
            self._desk.present.gate.ask(lambda: session.set_breakpoints(str(file), lines))

    async def _read_files(self) -> object:
        commands = [*self._desk.run.commands]
        return await asyncio.to_thread(lambda: [each and each.files().pack() for each in commands])

    async def ask(self, act: Callable[[DebugSession], Any]) -> Any:
        """Let the session do something between two events, and return or raise what comes of it, also later."""
        if (session := self.session) is None:
            raise ParameterError("No program is debugged. Press Debug.")
        done = await self._desk.present.do(lambda _: act(session))
        return await asyncio.wrap_future(done) if isinstance(done, Future) else done

    async def go_on(self, command: str = "continue") -> None:
        """Let the program go on, and time pass; see `DebugSession.go_on`."""
        await self._let_time_pass()
        await self.ask(lambda session: session.go_on(command))

    async def pause(self, robot: int) -> None:
        """Let the program of a robot stand at its next line, for which time passes."""
        if not self.is_going_back:
            await self._let_time_pass()
            # Without a wait: the program may sleep for long.
            await self.ask(lambda session: [session.ask("pause", {}, robot)])

    async def _let_time_pass(self) -> None:
        if self._desk.past is not None:
            await self._desk.looking.back_to_now()
        if self._desk.is_paused:
            await self._desk.go_on()

    async def back(self, robot: int = 0, **how: Any) -> None:
        """Go back in the run; see `DebugSession.back`. The program of a robot stands first, if none does."""
        if self.is_going_back:
            return
        if self.stop is None and self.is_there:
            await self.pause(robot)
            with suppress(TimeoutError):
                while self.stop is None and self.is_there:
                    await self.changed.emitted(STAND_S)
        if self.session is not None and self._files != await self._read_files():
            self.session.note_change("its program was changed meanwhile")
        await self.ask(lambda session: session.back(**how))
        self.changed.emit()

    def note_change(self) -> None:
        """Note that a person has changed the world, and say once what that means."""
        if any(each.is_running for each in self._desk.programs.handles):
            self._desk.programs.note_doubt("a person has changed the world")
        if self.session is not None and self.is_there and not self.session.is_changed:
            self.session.note_change("a person has changed the world")
            self._desk.say(CHANGED)

    @property
    def hint(self) -> str:
        """What to do to see at which line the program was at the time that is shown; empty if it is seen."""
        if self.session is None or self._desk.past is None or not self._desk.looking.is_own or self.stop is not None:
            return ""
        return f"{'Pause the program first' if self.is_there else 'Press Debug'} to see which line ran then."

    async def locate(self) -> None:
        """Find out where the program was at the time of the past that is shown."""
        past, stop = self._desk.past, self.stop
        time_ns = None if past is None or not self._desk.looking.is_own else past.sim.now_ns
        if (time_ns, stop) != self._located_for:
            self._located_for, self.located = (time_ns, stop), None
            if time_ns is not None and stop is not None:
                with suppress(KiksError):  # no line had run by then
                    place = await self.ask(lambda session: session.where(time_ns))
                    self.located = place["file"], place["line"]
            self.changed.emit()

    # ---- what the session wants ----

    def _take(self, event: str, body: dict[str, Any]) -> None:
        if event == "output":
            self._desk.say(str(body["output"]).strip())
        if not self.is_going_back:
            self._desk.show_again()
            self.changed.emit()

    def _begin_again(self, session: DebugSession) -> None:
        async def begin() -> None:
            try:
                await self._desk.start_over(session)
            except KiksError as error:
                self._desk.say(str(error))

        if session is self.session:  # else people have begun another world
            background_tasks.create(begin(), name="kiks debugger")

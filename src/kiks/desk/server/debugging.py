"""The debugger of a desk: it follows the programs of the world, and begins that world again to go back in it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nicegui import Event, background_tasks

from kiks.debug.session import Body, Session, Stop
from kiks.errors import KiksError
from kiks.model.program_kinds import ProgramKind, program_kind
from kiks.ports.program_command import ProgramCommand
from kiks.script.code_lines import code_lines

if TYPE_CHECKING:
    from kiks.desk.server.desk import Desk

ANSWER_S = 10.0
"""Longest wait for an answer of a program that stands [s of real time]."""

CHANGED = (
    "You have changed the world, so this is another run now. The debugger cannot go back in it. Press Debug to begin "
    "again."
)


class Debugging:
    """The debugger of a desk, which all its pages share.

    Args:
        desk: The desk.

    Attributes:
        session: What follows the programs of the present world; None if nothing does.
        breakpoints: The lines at which programs stop, by the file; None: in a new one.
        changed: Happens when a program stands or goes on; in the thread of the server.
        located: The file and the line at which the program was at the time of the past that is shown; None if that is
            not known.
        complaint: Why that is not known; empty if nobody asks.
    """

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self.session: Session | None = None
        self.breakpoints: dict[Path | None, list[int]] = {}
        self.changed: Event[[]] = Event()
        self.located: tuple[str, int] | None = None
        self.complaint = ""
        self._located_for: object = None
        self._program: ProgramCommand | None = None
        self._files: dict[str, bytes] = {}

    @property
    def is_going_back(self) -> bool:
        """Whether the run is made again up to a place in it."""
        return self.session is not None and self.session.is_going_back

    @property
    def is_there(self) -> bool:
        """Whether a program runs that is followed."""
        return self.session is not None and any(each.is_running for each in self._desk.programs.handles)

    @property
    def stop(self) -> Stop | None:
        """Where a program stands; None while none does."""
        return self.session.stop if self.session is not None and self.is_there and not self.is_going_back else None

    async def begin(self, command: ProgramCommand, robot: int) -> None:
        """Begin the world again, with a program on a robot that is followed, as are all others."""
        if program_kind(command.program) is not ProgramKind.PYTHON or command.program.suffix != ".py":
            raise KiksError(
                f"a program must be a file of Python to be debugged here, but {command.name} is none. Run it."
            )
        loop = asyncio.get_running_loop()
        session = Session(
            lambda event, body: _soon(loop, lambda: self._take(session, event, body)),
            lambda: _soon(loop, lambda: background_tasks.create(self._begin_again(session), name="kiks debugger")),
        )
        session.has_editor = True
        session.set_filters(["uncaught"])
        self._program, self._files = command, await asyncio.to_thread(lambda: command.files().pack())
        self._desk.attach(command, robot)
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

    def _set(self, session: Session, file: Path | None) -> None:
        """Let programs stop at the breakpoints of a file, or where code follows."""
        if file is not None:
            stood = [next((line for line in code_lines(file) if line >= each), each) for each in self.breakpoints[file]]
            session.set_breakpoints(str(file), [{"line": line} for line in stood])

    # ---- while programs are followed ----

    async def ask(self, command: str, arguments: Body | None = None) -> Body:
        """Ask the program that stands; see `Session.ask`."""
        return await self._done(lambda session: session.ask(command, arguments))

    async def go_on(self, command: str = "continue") -> None:
        """Let the program go on, and time pass; see `Session.go_on`."""
        desk = self._desk
        if desk.past is not None:
            await desk.looking.back_to_now()
        if desk.is_paused:
            await desk.go_on()
        if (session := self.session) is not None:
            await desk.present.do(lambda _: session.go_on(command))
        self.changed.emit()

    async def pause(self, robot: int) -> None:
        """Let the program of a robot stand at its next line."""
        if (session := self.session) is not None:
            await self._desk.present.do(lambda _: session.ask("pause", {}, robot))

    async def back(self, **how: Any) -> None:
        """Go back in the run; see `Session.back`."""
        program = self._program
        files = {} if program is None else await asyncio.to_thread(lambda: program.files().pack())
        if self.session is not None and files != self._files:
            self.session.note_change("the program was changed meanwhile")
        await self._done(lambda session: session.back(**how))
        self.changed.emit()

    def note_change(self) -> None:
        """Note that a person has changed the world, and say once what that means."""
        session = self.session
        if session is not None and self.is_there and not session.is_changed:
            session.note_change("a person has changed the world")
            self._desk.say(CHANGED)

    async def locate(self) -> None:
        """Find out where the program was at the time of the past that is shown."""
        past = self._desk.past
        wanted = None if past is None or not self._desk.looking.is_own or self.session is None else past.sim.now_ns
        if (wanted, self.stop) == self._located_for:
            return
        self._located_for = wanted, self.stop
        self.located, self.complaint = None, ""
        if wanted is not None and self.is_there and self.stop is None:
            self.complaint = "To see which line ran then, go back to now and pause the program."
        elif wanted is not None:
            try:
                place = await self._done(lambda session: session.where(wanted))
                self.located = place["file"], place["line"]
            except KiksError as error:
                self.complaint = str(error) if self.is_there else "To see which line ran then, press Debug."
        self.changed.emit()

    async def _done(self, act: Callable[[Session], Future[Body]]) -> Body:
        """Let the session do something, and return or raise what comes of it."""
        if (session := self.session) is None:
            raise KiksError("a program must be followed for that, but it is not. Press Debug.")
        future = await self._desk.present.do(lambda _: act(session))
        try:
            return await asyncio.wait_for(asyncio.wrap_future(future), ANSWER_S)
        except TimeoutError:
            raise KiksError("The program has not answered. Try again.") from None

    # ---- what the session wants ----

    def _take(self, session: Session, event: str, body: Body) -> None:
        if event == "output":
            self._desk.say(str(body["output"]).strip())
        if session is self.session and not session.is_going_back:
            self._desk.show_again()
            self.changed.emit()

    async def _begin_again(self, session: Session) -> None:
        if session is self.session:
            try:
                await self._desk.start_over(session)
            except KiksError as error:
                self._desk.say(str(error))


def _soon(loop: asyncio.AbstractEventLoop, act: Callable[[], object]) -> None:
    """Do something in the thread of the server."""
    loop.call_soon_threadsafe(act)

"""A room: a desk for each student of a class, each with its own world and folder, behind one address."""

from __future__ import annotations

import asyncio
import logging
import re
import secrets
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path, PurePosixPath

from nicegui import background_tasks

from kiks.desk.room.entrance import CODE_LENGTH, LETTERS, Entrance
from kiks.desk.room.pictures import Pictures
from kiks.desk.room.seats import Seat, read_seats, write_seats
from kiks.desk.server.access import ADVICE
from kiks.desk.server.desk import Desk
from kiks.desk.server.public_address import PublicAddress
from kiks.desk.server.rights import Rights
from kiks.desk.server.scripts import EXAMPLES
from kiks.desk.server.server import SERVER
from kiks.desk.server.show import Shown
from kiks.desk.server.token import Token
from kiks.errors import KiksError, ParameterError, shown
from kiks.model.atomic_files import make_folder, replace_file
from kiks.model.project import Project
from kiks.ports.program_command import project_commands
from kiks.ports.resources import processor_count
from kiks.ports.sandbox import Sandbox, check_sandbox
from kiks.run import Run
from kiks.trials.hand_in import HAND_IN_BYTES_MAX, has_run

DESKS, HANDED_IN = "desks", "handed-in"
"""Folders of the room's folder: one below the first for each student; what students hand in."""

CLOSERS = 32
"""How many desks are closed at a time."""

LOOK_S = 1.0
"""Period at which the room looks how the desks do [s]."""

STUDENT_ADVICE = """<p><a href="HOME">Choose your name again</a>, or ask your teacher.</p>
<p>For the teacher: open the complete address that KiKS printed when it started. It ends in <code>?token=</code> and a
long word.</p>"""


class Room:
    """The desks of a class, and what the lecturer sees of them.

    Students come in by the entrance; their browsers get tokens that open their own desks alone. The owner's token opens
    the lecturer's page and all desks.

    Args:
        project: The exercise.
        home: Where it lies.
        names: The students' names.
        folder: Where the room keeps the students' folders and what they hand in.
        code: The code of the entrance; that of the last time if left out, or a random one.
        address: The address that people open, if it is that of a proxy.
        is_trusted: Whether students' programs run with the rights of this process; else each student's in a sandbox.

    Attributes:
        project: What each desk begins with: the exercise without its hidden cases.
        title: The title of the exercise.
        code: The code of the entrance.
        seats: The students' places, by their names.
        desks: The open desks, by the students' names.
        may_hand_in: Whether handing in is open.
    """

    def __init__(
        self,
        project: Project,
        home: Path,
        names: Sequence[str],
        folder: Path,
        *,
        code: str = "",
        address: PublicAddress | None = None,
        is_trusted: bool = False,
    ) -> None:
        if not is_trusted:
            check_sandbox()
        self.project = project.for_students()
        most = Rights.STUDENT.speed_max
        self._begins_with = replace(self.project, speed=min(self.project.speed or most, most))
        self.title = (project.exercise.title if project.exercise is not None else "") or project.arena.name
        self.folder, self._home = folder.resolve(), home
        is_new = not self.folder.exists()
        for each in (DESKS, HANDED_IN):
            make_folder(self.folder / each, "--folder")
        if is_new:
            self.folder.chmod(0o700)  # other users of this computer may be students
        self.seats, kept_code = read_seats(self.folder, list(names))
        self.code = code or kept_code or "".join(secrets.choice(LETTERS) for _ in range(CODE_LENGTH))
        self.desks: dict[str, Shown] = {}
        self.may_hand_in = True
        self._pictures: dict[str, Pictures] = {}
        self._public = address
        self._is_trusted = is_trusted
        self._sandboxes: list[Sandbox] = []
        self._starter = ThreadPoolExecutor(max(processor_count() // 2, 1), "kiks room")
        self._turn = asyncio.Lock()
        self._saving = threading.Lock()
        self._is_over = False

    # ---- from the thread of the command ----

    def open(self, *, host: str = "127.0.0.1", port: int | None = None) -> None:
        """Let people in; the desks of those who have been there are open again.

        Raises:
            LinkError: If the room cannot listen there.
        """
        visitors = SERVER.visitors
        SERVER.start(host=host, port=port, public=self._public)
        visitors.advice = STUDENT_ADVICE.replace("HOME", f"{visitors.path}/")
        for seat in self.seats.values():
            if seat.number:
                self._open(seat)
        self.save()
        visitors.entrance = Entrance(self.code, self.title, visitors, self.free_names, self.take)
        SERVER.run(self._begin())

    async def _begin(self) -> None:
        for seat in self.seats.values():
            if seat.key is not None:
                SERVER.visitors.add(seat.key)
        background_tasks.create(self._watch(), name="kiks room")
        background_tasks.create(self._try_again(), name="kiks room")

    async def _try_again(self) -> None:
        """Try what was handed in and not yet tried when the room was last open."""
        for name, opened in tuple(self.desks.items()):
            file = self.folder / HANDED_IN / self.seats[name].handed_in
            if file.is_file() and not has_run(file):
                with suppress(KiksError):  # a grade will say why
                    await opened.desk.give_again(file)

    def close(self) -> None:
        """Close all desks, and let no student in."""
        self._is_over = True
        visitors = SERVER.visitors
        visitors.entrance, visitors.advice, visitors.public = None, ADVICE, None
        self._starter.shutdown(cancel_futures=True)
        if SERVER.is_running:
            SERVER.run(self._leave())
        for desk in self.desks.values():
            desk.stop()
        # Each may have to wait for its programs, and these end with their sandboxes.
        with ThreadPoolExecutor(CLOSERS, "kiks room") as closers:
            closes = [desk.close for desk in self.desks.values()] + [sandbox.close for sandbox in self._sandboxes]
            for close in closes:
                closers.submit(close)

    async def _leave(self) -> None:
        async with self._turn:  # after the last student who comes in
            SERVER.visitors.keys.clear()

    @property
    def address(self) -> str:
        """The address for students, without the code."""
        return SERVER.address()

    @property
    def address_with_code(self) -> str:
        """The address that leads past the question for the code."""
        return f"{self.address}?code={self.code}"

    @property
    def lecturer_address(self) -> str:
        """The address of the lecturer's page, with its token."""
        return f"{self.address}room?token={SERVER.key.token}"

    # ---- in the server's thread ----

    def free_names(self) -> dict[str, bool]:
        """Return all names, each with whether it is free."""
        return {name: seat.key is None for name, seat in self.seats.items()}

    async def take(self, name: str) -> Token:
        """Give a name to a browser, and return its token; its desk opens.

        Raises:
            ParameterError: If the name is none of the class, or not free.
        """
        async with self._turn:
            if self._is_over:
                raise ParameterError("The room must be open, but it has been closed.")
            if (seat := self.seats.get(name)) is None:
                raise ParameterError(f"The name must be one of the class, but it was {shown(name)}. Choose another.")
            if seat.key is not None:
                raise ParameterError(f"The name must be free, but {name} is taken. Ask your teacher to give it free.")
            if not seat.number:
                seat.number = max(each.number for each in self.seats.values()) + 1
            if name not in self.desks:
                await asyncio.to_thread(self._open, seat)
            seat.key = Token(desk=seat.number)
            SERVER.visitors.add(seat.key)
            await asyncio.to_thread(self.save)
            return seat.key

    async def give_free(self, name: str) -> None:
        """Let any browser take a name again; the one that had it is disconnected, and the desk stays as it is."""
        async with self._turn:
            seat = self.seats[name]
            if seat.key is not None:
                key, seat.key = seat.key, None
                await SERVER.visitors.remove(key)
                await asyncio.to_thread(self.save)

    def set_submissions_open(self, is_open: bool) -> None:
        """Open or close handing in."""
        self.may_hand_in = is_open
        for each in tuple(self.desks.values()):  # another thread may open one meanwhile
            each.desk.may_hand_in = is_open

    async def picture(self, name: str) -> bytes:
        """Return a small picture of a desk's world."""
        return await self._pictures[name].draw()

    # ---- inside ----

    def save(self) -> None:
        """Write down which browser has which name, and how the desks do; from any thread."""
        with self._saving:
            write_seats(self.folder, self.seats, self.code)

    def _open(self, seat: Seat) -> None:
        """Open the desk of a student."""
        folder = self.folder / DESKS / seat.folder
        make_folder(folder, "a student's folder")
        sandbox = None
        if not self._is_trusted:
            commands = project_commands(self.project, self._home)
            others = [path for command in commands if command is not None for path in command.files().shown]
            sandbox = Sandbox([folder, EXAMPLES.parent, *others])
            self._sandboxes.append(sandbox)
        desk = Desk(Run.of(self._begins_with, self._home, sandbox=sandbox), Rights.STUDENT, folder=folder)
        desk.secret = seat.secret  # so that a page finds its desk when the room is back
        desk.hand_in, desk.may_hand_in = partial(self._take_in, seat), self.may_hand_in
        opened = Shown(desk, number=seat.number)
        opened.drive()
        # Some at a time: a class comes at once, and a student sees the desk before a program can start.
        self._starter.submit(self._begin_at, desk, sandbox)
        self._pictures[seat.name] = Pictures(desk)
        self.desks[seat.name] = opened

    def _begin_at(self, desk: Desk, sandbox: Sandbox | None) -> None:
        """Make a desk ready for programs, and start those of the exercise."""
        try:
            if sandbox is not None:
                sandbox.warm()
            desk.begin()
        except KiksError as error:
            desk.say(str(error))

    def _take_in(self, seat: Seat, data: bytes, name: str, *, is_again: bool = False) -> None:
        """Take what a student hands in; the latest counts."""
        if not (self.may_hand_in or is_again):
            raise ParameterError("Handing in must be open, but your teacher has closed it. Ask your teacher.")
        ending = PurePosixPath(name).suffix.lower()
        if not re.fullmatch(r"\.[a-z0-9]{1,8}", ending) or len(data) > HAND_IN_BYTES_MAX:
            raise ParameterError(
                f"What is handed in must be a file of at most {HAND_IN_BYTES_MAX >> 20} MiB, but it was "
                f"{shown(name)} of {len(data) / 2**20:.1f}. Hand in another one."
            )
        file = f"{seat.folder}{ending}"
        replace_file(self.folder / HANDED_IN / file, data, "what is handed in")
        if seat.handed_in not in ("", file):
            (self.folder / HANDED_IN / seat.handed_in).unlink(missing_ok=True)
        seat.handed_in = file
        self.save()

    async def _watch(self) -> None:
        """Note how the desks do, until the room is closed."""
        log = logging.getLogger("kiks.desk")
        while not self._is_over:
            await asyncio.sleep(LOOK_S)
            has_news = False
            for name, each in tuple(self.desks.items()):
                judged = each.desk.judgement
                # Of a goal of the student's own making a judgement says nothing.
                if judged is not None and each.desk.project.goal == self.project.goal:
                    has_news |= self.seats[name].note(judged.points, is_solved=judged.is_solved)
            if has_news:
                try:
                    await asyncio.to_thread(self.save)
                except KiksError as error:
                    log.error("%s", error)

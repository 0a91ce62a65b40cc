"""The process of a session: who comes in by pipes or TCP, and when all is over.

Octave starts it and speaks with it by its standard input and output; another Octave, and MATLAB, which has no pipes,
come by TCP, on this computer only, and with a token that stands in a file of the user's alone. It ends when the last of
them has gone, however that was: a crashed Octave leaves nothing behind.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import select
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from kiks import __version__
from kiks.errors import LinkError
from kiks.model.files import replace_file
from kiks.ports.pty import default_folder
from kiks.toolbox.requests import answer
from kiks.toolbox.session import Session
from kiks.toolbox.visitor import Visitor
from kiks.toolbox.words import frame

LINE_MAX = 1 << 26
"""Longest request [bytes]: an arena of 64 million cells in which no two neighbours are alike is longer."""

LOOK_S = 0.5
"""How often it is looked whether everybody has gone while the world is paused [s of real time]."""

FIRST_S = 60.0
"""How long a process that listens waits for the first who comes [s of real time]."""

SPIN_NS = 1_000_000 if len(os.sched_getaffinity(0)) > 1 else 0
"""How long the next request is waited for without going to sleep [ns of real time]: a program in a loop sends it within
that, and being woken takes a third of what a whole exchange does. With a single core the program needs it itself."""

TOKEN_BYTES = 24

_READ_SIZE = 1 << 16

_PREFIX = "session-"


class Door(NamedTuple):
    """Where a session is found.

    Attributes:
        number: Its number, that of its process.
        port: Its TCP port.
        token: What has to be said first there.
    """

    number: int
    port: int
    token: str

    def line(self) -> str:
        """Return it as the toolbox reads it."""
        return f"KiKS {__version__} session {self.number} port {self.port} token {self.token}\n"

    @staticmethod
    def read(path: Path) -> Door | None:
        """Return the door that a file tells of; None if it tells of none."""
        try:
            words = path.read_text(encoding="ascii").split()
            return Door(int(words[3]), int(words[5]), words[7])
        except (OSError, ValueError, IndexError):
            return None


class Host:
    """The process of a session.

    Args:
        session: The session.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.door = Door(os.getpid(), self._listener.getsockname()[1], secrets.token_urlsafe(TOKEN_BYTES))
        self._file = default_folder() / f"{_PREFIX}{self.door.number}"
        write_door(self.door, self._file)
        self._there: dict[int, Callable[[], None]] = {}
        self._count = 0
        self._lock = threading.Lock()
        self._is_over = threading.Event()
        threading.Thread(target=self._let_in, name="kiks door", daemon=True).start()

    def speak_on(self, source: int, sink: int) -> None:
        """Let somebody take part who speaks with us on two descriptors."""
        self._attend(source, sink, lambda: None)

    def run(self) -> None:
        """Move the world until the last has gone; then `close` is due."""
        waited = threading.Timer(FIRST_S, self._go_if_alone)
        waited.daemon = True
        waited.start()
        threading.Thread(target=self._look_around, name="kiks watch", daemon=True).start()
        while not self._is_over.is_set():
            self._session.round()

    def close(self) -> None:
        """Let nobody in any more, and end the world."""
        self._file.unlink(missing_ok=True)
        self._listener.close()
        self._session.close()

    # ---- who is there ----

    def _attend(self, source: int, sink: int, close: Callable[[], None]) -> None:
        with self._lock:
            self._count += 1
            self._there[source] = close
            visitor = Visitor(self._session, self._count)
        threading.Thread(target=self._listen, args=(visitor, source, sink), name=visitor.name, daemon=True).start()

    def _listen(self, visitor: Visitor, source: int, sink: int) -> None:
        """Answer somebody line by line until it hangs up."""
        try:
            with contextlib.suppress(OSError):
                _write(sink, frame(self.door.line()))
                for line in _lines(source):
                    _write(sink, frame(answer(visitor, line)))
        finally:
            visitor.leave()
            with self._lock:
                self._there.pop(source)()
            self._go_if_alone()

    def _go_if_alone(self) -> None:
        if not self._there:
            self._is_over.set()

    def _let_in(self) -> None:
        """Let those in who know the token."""
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            threading.Thread(target=self._greet, args=(connection,), daemon=True).start()

    def _greet(self, connection: socket.socket) -> None:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        given = b""
        with contextlib.suppress(OSError):
            connection.settimeout(FIRST_S)
            while not given.endswith(b"\n") and len(given) < 100 and (piece := connection.recv(1)):
                given += piece
            connection.settimeout(None)
        if secrets.compare_digest(given.strip(), self.door.token.encode()):
            self._attend(connection.fileno(), connection.fileno(), connection.close)
        else:
            connection.close()

    def _look_around(self) -> None:
        """Notice that all have gone even while a paused world keeps them from being heard."""
        while not self._is_over.wait(LOOK_S):
            with self._lock:
                sources = list(self._there)
            if sources and all(_has_hung_up(source) for source in sources):
                self._session.let_go()


def find_door(number: int) -> Door:
    """Return where a session of this user runs on this computer.

    Args:
        number: Its number; 0 for the one that was started last.

    Raises:
        LinkError: If there is none.
    """
    folder = default_folder()
    files = sorted(folder.glob(f"{_PREFIX}*"), key=lambda path: path.stat().st_mtime_ns, reverse=True)
    doors = [door for file in files if (door := Door.read(file)) is not None and _is_open(door, file)]
    for door in doors:
        if number in (0, door.number):
            return door
    known = f"those that run are {[door.number for door in doors]}" if doors else "none runs on this computer"
    which = "a session" if number == 0 else f"session {number}"
    raise LinkError(f"{which} must run before it is joined, but {known}. Start one with kiks(ARENA) in another Octave.")


def join(door: Door, source: int, sink: int) -> None:
    """Carry what somebody says on two descriptors to a session and back, until one of the two hangs up.

    Raises:
        LinkError: If the session has ended.
    """
    connection = _connect(door)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.sendall(f"{door.token}\n".encode())
    while True:
        ready, _, _ = select.select([source, connection.fileno()], [], [])
        for each in ready:
            try:
                piece = os.read(source, _READ_SIZE) if each == source else connection.recv(_READ_SIZE)
            except OSError:
                piece = b""
            if not piece:
                connection.close()
                return
            if each == source:
                connection.sendall(piece)
            else:
                _write(sink, piece)


def write_door(door: Door, path: Path) -> None:
    """Write where a session is found into a file that this user alone can read.

    Raises:
        ParameterError: If the file cannot be written.
    """
    replace_file(path, door.line(), "where a session is found", rights=0o600)


def _connect(door: Door) -> socket.socket:
    try:
        return socket.create_connection(("127.0.0.1", door.port), timeout=None)
    except OSError as error:
        raise LinkError(f"session {door.number} must run to be joined, but it has ended ({error.strerror}).") from None


def _is_open(door: Door, file: Path) -> bool:
    """Say whether a session is there; what one that was killed has left behind goes."""
    try:
        _connect(door).close()
    except LinkError:
        file.unlink(missing_ok=True)
        return False
    return True


def _lines(source: int) -> Iterator[str]:
    """Yield the lines that come on a descriptor, until it ends."""
    rest = bytearray()
    while piece := _read(source):
        rest += piece
        if b"\n" not in piece:
            if len(rest) > LINE_MAX:
                return
            continue
        *lines, last = bytes(rest).split(b"\n")
        rest = bytearray(last)
        for line in lines:
            yield line.decode("utf-8", errors="replace")


def _read(source: int) -> bytes:
    poll = select.poll()
    poll.register(source, select.POLLIN)
    begin_ns = time.perf_counter_ns()
    while not poll.poll(0) and time.perf_counter_ns() - begin_ns < SPIN_NS:
        pass
    return os.read(source, _READ_SIZE)


def _write(sink: int, data: bytes) -> None:
    while data:
        data = data[os.write(sink, data) :]


def _has_hung_up(source: int) -> bool:
    poll = select.poll()
    poll.register(source, getattr(select, "POLLRDHUP", 0) | select.POLLHUP)
    return bool(poll.poll(0))

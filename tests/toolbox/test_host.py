"""The process of a session: who may come in, and that nothing is left when the last has gone."""

from __future__ import annotations

import os
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from tests.served import GUARD_S

from kiks.cli.matlab import toolbox_folder

pytestmark = pytest.mark.slow

KIKS = [sys.executable, "-m", "kiks"]


class Session:
    """A process of a session, and who started it."""

    def __init__(self, *words: str, folder: Path) -> None:
        self.process = subprocess.Popen(
            [*KIKS, "session", *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
            env={**os.environ, "XDG_RUNTIME_DIR": str(folder), "DISPLAY": "", "WAYLAND_DISPLAY": ""},
        )
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.to, self.out = self.process.stdin.fileno(), self.process.stdout.fileno()
        self.greeting = self.hear()

    def hear(self, *, confirms: bool = True) -> str:
        """Return the next answer; confirm that it is waited for where it takes long, if nothing else is said."""
        while (heard := self.hear_frame()) == "~":
            if confirms:
                os.write(self.to, b"\n")
        return heard

    def hear_frame(self) -> str:
        length = int(self._read(8))
        return self._read(max(length, 88))[:length]

    def say(self, request: str) -> None:
        os.write(self.to, f"{request}\n".encode())

    def ask(self, request: str) -> str:
        self.say(request)
        heard = self.hear()
        assert heard[0] == "+", heard
        return heard[20:]

    def hang_up(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()

    def wait(self) -> int:
        return self.process.wait(GUARD_S)

    def _read(self, count: int) -> str:
        data = b""
        while len(data) < count:
            assert select.select([self.out], [], [], 3 * GUARD_S)[0], "nothing came"
            piece = os.read(self.out, count - len(data))
            assert piece, f"it has ended after {data!r}"
            data += piece
        return data.decode()


@contextmanager
def started(*words: str, folder: Path) -> Iterator[Session]:
    session = Session(*words, folder=folder)
    try:
        yield session
    finally:
        session.process.kill()
        session.process.wait()
        assert session.process.stdout is not None
        session.process.stdout.close()
        if not session.process.stdin.closed:  # type: ignore[union-attr]
            session.process.stdin.close()  # type: ignore[union-attr]


def test_a_session_ends_when_the_last_has_hung_up_and_leaves_nothing(tmp_path: Path) -> None:
    with started(folder=tmp_path) as session:
        assert session.greeting.startswith("KiKS ")
        session.ask("world default")
        session.ask("open 1 9600")
        assert session.ask("ask 1 N").startswith("n,")
        assert len(list((tmp_path / "kiks").glob("session-*"))) == 1
        session.hang_up()
        assert session.wait() == 0
        assert not list((tmp_path / "kiks").iterdir())


def test_another_program_joins_and_the_session_lives_until_both_have_gone(tmp_path: Path) -> None:
    with started(folder=tmp_path) as first, started("--join", "0", folder=tmp_path) as second:
        first.ask("set thinking none")
        first.ask("world default")
        assert second.greeting == first.greeting
        assert second.ask("active") == "1"
        second.ask("open 1 9600")
        assert second.ask("ask 1 H") == "h,0,0"
        first.hang_up()
        assert second.ask("ask 1 H") == "h,0,0"
        assert first.process.poll() is None
        second.hang_up()
        assert second.wait() == 0
        assert first.wait() == 0


def test_who_joins_is_told_that_there_is_no_session(tmp_path: Path) -> None:
    for words, told in ((["--join", "0"], "must run before it is joined"), (["--join", "7"], "session 7 must run")):
        process = subprocess.run(
            [*KIKS, "session", *words],
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            timeout=GUARD_S,
            env={**os.environ, "XDG_RUNTIME_DIR": str(tmp_path)},
        )
        assert told in process.stdout
        assert process.returncode == 2


def test_a_session_that_was_killed_is_forgotten(tmp_path: Path) -> None:
    with started(folder=tmp_path) as session:
        session.process.kill()
        session.wait()
        assert list((tmp_path / "kiks").glob("session-*"))
        with started(folder=tmp_path) as other, started("--join", "0", folder=tmp_path) as guest:
            assert guest.greeting == other.greeting
            assert len(list((tmp_path / "kiks").glob("session-*"))) == 1


def test_a_joined_program_notices_that_the_session_was_killed(tmp_path: Path) -> None:
    with started(folder=tmp_path) as first, started("--join", "0", folder=tmp_path) as second:
        first.process.kill()
        assert second.wait() == 0
        assert os.read(second.out, 1) == b""


def test_without_the_token_nobody_gets_in(tmp_path: Path) -> None:
    with started(folder=tmp_path) as session:
        words = session.greeting.split()
        for token in ("", "x" * 32, words[7][:-1], "y" * 10_000):
            with socket.create_connection(("127.0.0.1", int(words[5]))) as client:
                client.settimeout(GUARD_S)
                client.sendall(f"{token}\nversion\n".encode())
                heard = b""
                with suppress(ConnectionResetError):
                    heard = client.recv(100)
                assert heard == b""
        door = next((tmp_path / "kiks").glob("session-*"))
        assert door.stat().st_mode & 0o077 == 0, "the token is the user's alone"
        with socket.create_connection(("127.0.0.1", int(words[5]))) as client:
            client.settimeout(GUARD_S)
            client.sendall(f"{words[7]}\n".encode())
            assert b"KiKS" in client.recv(200)


def test_ctrl_c_is_meant_for_octave_and_sigterm_ends_it(tmp_path: Path) -> None:
    with started(folder=tmp_path) as session:
        session.process.send_signal(signal.SIGINT)
        assert session.ask("active") == "0"
        session.process.send_signal(signal.SIGTERM)
        assert session.wait() == 0
        assert not list((tmp_path / "kiks").iterdir())


def test_a_paused_world_does_not_keep_a_session_whose_octave_has_gone(tmp_path: Path) -> None:
    """The request waits in the world, so nobody reads, and the pipe's end must be noticed all the same."""
    with started("--window", folder=tmp_path) as session:
        session.ask("set thinking none")
        session.ask("world default")
        session.ask("open 1 9600")
        os.write(session.to, b"pause 100000\n")  # at real speed, with a window: longer than anybody waits
        os.write(session.to, b"ask 1 N\n")
        session.hang_up()
        assert session.wait() == 0


def test_what_is_printed_never_mixes_with_answers(tmp_path: Path) -> None:
    with started(folder=tmp_path) as session:
        os.write(session.to, f"world file {tmp_path / 'none.kad'}\n".encode())
        assert session.hear().startswith("-")
        assert session.ask("version")


def test_octave_is_told_where_the_toolbox_is() -> None:
    assert (toolbox_folder() / "kiks.m").is_file()
    told = subprocess.run([*KIKS, "matlab"], capture_output=True, text=True, check=True, timeout=GUARD_S).stdout
    assert str(toolbox_folder()) in told

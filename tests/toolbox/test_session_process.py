"""The process of a session: access, and that nothing is left after the last client."""

import os
import resource
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from subprocess import PIPE

import pytest
from tests import forked
from tests.guard import GUARD_S, wait_until

from kiks.model.package import shipped

pytestmark = pytest.mark.slow

KIKS = [sys.executable, "-m", "kiks"]
"""The command as a process of its own, for what a fork does in its own way: start, signals, parents."""

STARTER = [sys.executable, "-c", "import subprocess, sys; subprocess.run(sys.argv[1:])"]
"""A process that starts another one and waits for it."""

COMPILES_FOR_EVER = """
import importlib, threading
importlib.import_module("kiks.cli.session").ready_engine = threading.Event().wait
importlib.import_module("kiks.cli").main()
"""


class Session:
    """A process of a session, and the command that waits for it: a fork (tests/forked.py) unless one is given."""

    def __init__(self, *words: str, folder: Path, command: Sequence[str] = ()) -> None:
        command = [*(command or forked.kiks_command()), "session", *words]
        environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder)}
        self.process = subprocess.Popen(command, bufsize=0, env=environment, stdin=PIPE, stdout=PIPE)
        self.to, self.out = self.process.stdin.fileno(), self.process.stdout.fileno()
        # select.select() refuses descriptors from 1024 on, and a test opens a thousand first.
        self.poll = select.poll()
        self.poll.register(self.out, select.POLLIN)
        self.greeting = self.hear()

    @property
    def number(self) -> int:
        return int(self.greeting.split()[3])

    def hear(self, *, confirms: bool = True) -> str:
        """Return the next answer; by default confirm the frames that announce it."""
        while (heard := self.hear_frame()) == "~":
            if confirms:
                os.write(self.to, b"\n")
        return heard

    def hear_frame(self) -> str:
        length = int(self._read(8))
        return self._read(max(length, 88))[:length]

    def say(self, request: str) -> None:
        os.write(self.to, f"{request}\n".encode())

    def ask(self, *requests: str) -> str:
        """Send requests; return the answer to the last."""
        for request in requests:
            self.say(request)
            heard = self.hear()
            assert heard[0] == "+", heard
        return heard[20:]

    def open(self) -> None:
        """Open port -1 in a new world."""
        self.ask("set thinking none", "world default", "open 1 9600")

    def hang_up(self) -> None:
        self.process.stdin.close()

    def wait(self) -> int:
        return self.process.wait(GUARD_S)

    def _read(self, count: int) -> str:
        data = b""
        while len(data) < count:
            assert self.poll.poll(GUARD_S * 1000), "nothing came"
            piece = os.read(self.out, count - len(data))
            assert piece, f"it has ended after {data!r}"
            data += piece
        return data.decode()


def address(greeting: str) -> tuple[int, str]:
    """Return the port of a session and its token."""
    words = greeting.split()
    return int(words[5]), words[7]


def ended(*words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Wait for a process to end and return its output and exit code."""
    return forked.run("session", *words, env={"XDG_RUNTIME_DIR": str(folder)})


@contextmanager
def started(*words: str, folder: Path, command: Sequence[str] = ()) -> Iterator[Session]:
    session = Session(*words, folder=folder, command=command)
    with session.process:
        try:
            if session.greeting.startswith("KiKS"):
                # Other programs find the session only after a client takes part.
                session.ask("active")
            yield session
        finally:
            session.process.kill()


def test_a_joined_session_ends_when_both_programs_have_left(tmp_path: Path) -> None:
    with started(folder=tmp_path) as first, started("--join", "0", folder=tmp_path) as second:
        first.ask("set thinking none", "world default")
        assert second.greeting == first.greeting
        assert second.ask("active") == "1"
        assert second.ask("open 1 9600", "ask 1 H") == "h,0,0"
        first.hang_up()
        assert second.ask("ask 1 H") == "h,0,0"
        assert first.process.poll() is None
        second.hang_up()
        assert second.wait() == 0
        assert first.wait() == 0


def test_joining_without_a_session_and_listening_at_an_existing_file_are_errors(tmp_path: Path) -> None:
    for number, told in (("0", "must run before it is joined"), ("7", "session 7 must run")):
        process = ended("--join", number, folder=tmp_path)
        assert (process.returncode, told in process.stdout) == (2, True)
    file = tmp_path / "there"
    file.write_text("mine", encoding="ascii")
    assert "must be a new file" in ended("--listen", str(file), folder=tmp_path).stdout
    assert file.read_text(encoding="ascii") == "mine"
    assert list(tmp_path.glob(".there*")) == []


def test_a_killed_session_is_noticed_by_a_joined_program_and_its_file_is_removed(tmp_path: Path) -> None:
    with started(folder=tmp_path) as first, started("--join", "0", folder=tmp_path) as second:
        os.kill(first.number, signal.SIGKILL)
        assert second.wait() == 0
        assert os.read(second.out, 1) == b""
        first.wait()
        assert list((tmp_path / "kiks").glob("session-*"))
        with started(folder=tmp_path) as other, started("--join", "0", folder=tmp_path) as participant:
            assert participant.greeting == other.greeting
            assert len(list((tmp_path / "kiks").glob("session-*"))) == 1


def test_connections_without_the_token_are_refused(tmp_path: Path) -> None:
    with started(folder=tmp_path) as session:
        port, token = address(session.greeting)
        for given, answer in ((token[:-1], b""), (token, b"KiKS")):
            with socket.create_connection(("127.0.0.1", port), timeout=GUARD_S) as client:
                client.sendall(f"{given}\nversion\n".encode())
                heard = b""
                with suppress(ConnectionResetError):
                    heard = client.recv(200)
                assert heard.lstrip(b" 0123456789")[:4] == answer
        door = next((tmp_path / "kiks").glob("session-*"))
        assert door.stat().st_mode & 0o077 == 0, "the token is the user's alone"


def test_sigint_is_ignored_and_sigterm_ends_the_session(tmp_path: Path) -> None:
    """It is started with signals blocked, as Octave does."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGINT, signal.SIGHUP})
    with ExitStack() as after:
        after.callback(signal.pthread_sigmask, signal.SIG_SETMASK, before)
        session = after.enter_context(started(folder=tmp_path, command=KIKS))
        session.process.send_signal(signal.SIGINT)
        assert session.ask("active") == "0"
        session.process.send_signal(signal.SIGTERM)
        assert session.wait() == 0
        assert not list((tmp_path / "kiks").iterdir())


def test_ctrl_c_ends_a_listening_session_until_its_first_client_comes(tmp_path: Path) -> None:
    for has_client in (False, True):
        file = tmp_path / f"address-{has_client}"
        command = [*KIKS, "session", "--listen", str(file)]
        with subprocess.Popen(command) as process, ExitStack() as end:
            end.callback(process.kill)
            wait_until(file.exists)
            if not has_client:
                process.send_signal(signal.SIGINT)
                assert process.wait(GUARD_S) == 0
                continue
            port, token = address(file.read_text())
            with socket.create_connection(("127.0.0.1", port), timeout=GUARD_S) as client:
                client.sendall(f"{token}\nactive\n".encode())
                with client.makefile("rb") as heard:
                    assert b"KiKS" in heard.read(96)
                    client.sendall(b"active\n")
                    assert heard.read(96)
                    process.send_signal(signal.SIGINT)
                    client.sendall(b"active\n")
                    assert heard.read(96)
            assert process.wait(GUARD_S) == 0


def test_a_session_whose_engine_is_being_compiled_ends_with_its_program(tmp_path: Path) -> None:
    with started(folder=tmp_path, command=[sys.executable, "-c", COMPILES_FOR_EVER]) as session:
        session.say("world default")
        assert session.hear_frame() == "~"
        session.hang_up()
        assert session.wait() == 0


def test_a_paused_world_does_not_keep_a_session_alive(tmp_path: Path) -> None:
    """The request waits in the world, so no thread reads; the end of the pipe must be noticed anyway."""
    with started("--window", folder=tmp_path) as session:
        session.open()
        os.write(session.to, b"pause 100000\n")  # at real speed, with a window: longer than any client waits
        os.write(session.to, b"ask 1 N\n")
        session.hang_up()
        assert session.wait() == 0


def test_kiks_matlab_prints_the_folder_of_the_toolbox() -> None:
    assert (shipped("matlab") / "kiks.m").is_file()
    assert str(shipped("matlab")) in forked.run("matlab").stdout


def test_running_out_of_descriptors_ends_no_session(tmp_path: Path) -> None:
    with started(folder=tmp_path) as session, ExitStack() as friends:
        session.ask("world default")
        port, token = address(session.greeting)
        folder = Path(f"/proc/{session.number}/fd")
        used = len([*folder.iterdir()])
        resource.prlimit(session.number, resource.RLIMIT_NOFILE, (used + 10, used + 10))
        for _ in range(30):
            friend = friends.enter_context(socket.create_connection(("127.0.0.1", port), timeout=GUARD_S))
            friend.sendall(f"{token}\n".encode())
        wait_until(lambda: len([*folder.iterdir()]) > used + 8)
        assert session.ask("active") == "1"
        friends.close()
        wait_until(lambda: len([*folder.iterdir()]) <= used)
        with started("--join", "0", folder=tmp_path) as participant:
            assert participant.ask("active") == "1"


def test_other_files_are_not_read_as_sessions(tmp_path: Path) -> None:
    with started(folder=tmp_path) as session:
        session.ask("active")
        folder = tmp_path / "kiks"
        file = folder / f"session-{session.number}"
        link, pipe = (folder / f"session-{number}" for number in (1, 3))
        link.symlink_to(file)
        os.mkfifo(pipe, 0o600)
        line = session.greeting.replace(f"session {session.number}", "session 4")
        (folder / "session-4").write_text(line + "\n", encoding="ascii")
        (folder / "session-4").chmod(0o600)  # no process holds it
        for number in (1, 3, 4):
            done = ended("--where", str(number), folder=tmp_path)
            assert done.returncode == 2
            assert f"those that run are [{session.number}]" in done.stdout
        assert {each.name for each in folder.iterdir()} == {file.name, link.name}
        folder.chmod(0o777)
        assert "others can write there" in ended("--where", "0", folder=tmp_path).stdout


def test_a_session_is_announced_when_a_client_takes_part(tmp_path: Path) -> None:
    """Octave may have forgotten it before: Ctrl-C."""
    session = Session(folder=tmp_path)
    with session.process:
        assert not list((tmp_path / "kiks").glob("session-*"))
        session.ask("active")
        assert len(list((tmp_path / "kiks").glob("session-*"))) == 1
        session.hang_up()
        assert session.wait() == 0
        assert not list((tmp_path / "kiks").iterdir()), "it leaves nothing"


def test_a_slow_answer_is_announced_and_can_be_cancelled(tmp_path: Path) -> None:
    with started(folder=tmp_path) as session:
        session.open()
        session.say("pause 1e6")
        for _ in range(3):
            assert session.hear_frame() == "~"
            session.say("")
        session.say("\x18!")
        session.say("time 1")
        stale = session._read(1)
        while not stale.endswith("\x02"):
            stale += session._read(1)
        assert session._read(1) == "!"
        assert stale.endswith("\x01" * 190 + "\x02")
        assert 0 < float(session.hear()[20:]) < 1e6


def test_a_pause_is_held_until_the_program_confirms_that_it_waits(tmp_path: Path) -> None:
    with started(folder=tmp_path) as session:
        session.open()
        session.say("pause 1e6")
        assert session.hear_frame() == "~"
        status = Path(f"/proc/{session.number}/stat")

        def worked() -> int:
            """Return how much processor time it has had; it rests when it has none for a while."""
            words = status.read_text(encoding="ascii").rpartition(")")[2].split()
            return int(words[11]) + int(words[12])

        def rests() -> bool:
            before = worked()
            return not select.select([session.out], [], [], 1.0)[0] and worked() - before < 20

        wait_until(rests)
        session.say("")
        assert session.hear_frame() == "~", "it goes on"


def test_a_disconnecting_client_learns_that_the_session_continues(tmp_path: Path) -> None:
    with started(folder=tmp_path) as first:
        first.ask("world default")
        with started("--join", "0", folder=tmp_path) as second:
            second.ask("active")
            first.say("\x04")
            assert first.hear() == ">"
            assert os.read(first.out, 1) == b""
            assert first.process.poll() is None
            assert second.ask("active") == "1"
            second.say("\x04")
            assert second.wait() == 0
        assert first.wait() == 0


def test_killing_the_program_ends_its_session_at_any_moment(tmp_path: Path) -> None:
    """Its parent has ended, but the pipe is still open here."""
    with started(folder=tmp_path, command=[*STARTER, *KIKS]) as session:
        session.ask("world default")
        session.process.kill()
        session.process.wait()
        assert os.read(session.out, 1) == b"", "its end closes its output"

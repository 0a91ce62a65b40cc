"""The commands of KiKS as processes, and who speaks with them: for campaigns that need whole programs."""

from __future__ import annotations

import contextlib
import os
import re
import select
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit, urlunsplit
from urllib.request import HTTPCookieProcessor, OpenerDirector, build_opener

from tools.campaigns.runner import Broken

GUARD_S = 60.0
"""Longest wait for anything; on a busy computer a start takes ten seconds."""


class Command:
    """A command that runs.

    Args:
        process: Its process.

    Attributes:
        said: What it has said so far, on both outputs.
    """

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self.process, self.said = process, ""
        self._more = threading.Condition()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            with self._more:
                self.said += line.decode(errors="replace")
                self._more.notify_all()

    def find(self, pattern: str) -> str:
        """Wait for something that it says, and return its first group.

        Raises:
            Broken: If it does not come.
        """
        with self._more:
            if not self._more.wait_for(lambda: re.search(pattern, self.said), GUARD_S):
                raise Broken("hang", f"{pattern!r} was not said, but {self.said[-200:]!r}", f"waits for {pattern}")
            found = re.search(pattern, self.said)
        assert found is not None
        return found[1]

    def end(self, *, by: int = 0) -> int:
        """Wait until it ends, and return its exit code; a signal that was sent to it may have ended it.

        Raises:
            Broken: If it does not end, or dies, or a traceback is seen.
        """
        try:
            code = self.process.wait(GUARD_S)
        except subprocess.TimeoutExpired:
            raise Broken("hang", f"did not end: {self.said[-200:]!r}", "waits for the end") from None
        self.check()
        if code < 0 and code != -by:
            raise Broken("death", f"signal {-code}: {self.said[-200:]!r}", "a command dies")
        return code

    def check(self) -> None:
        """Check that no traceback has been seen.

        Raises:
            Broken: If one has.
        """
        if "Traceback" in self.said:
            last = self.said.strip().splitlines()[-1]
            raise Broken("foreign", self.said[-300:], f"traceback: {last[:60]}")


@contextmanager
def started(*words: str, folder: Path, environment: dict[str, str] | None = None, **options: Any) -> Iterator[Command]:
    """Start `kiks` in a folder; nothing of it outlives the block."""
    with subprocess.Popen(
        [sys.executable, "-m", "kiks", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        stdin=subprocess.DEVNULL,
        cwd=folder,
        env={**quiet(folder), **(environment or {})},
        **options,
    ) as process:
        try:
            yield Command(process)
        finally:
            process.kill()


def quiet(folder: Path) -> dict[str, str]:
    """Return an environment without a screen, whose sessions and ports are a folder's own."""
    return {**os.environ, "PYTHONUNBUFFERED": "1", "DISPLAY": "", "WAYLAND_DISPLAY": "", "XDG_RUNTIME_DIR": str(folder)}


def hand_in(folder: Path) -> Path:
    """Return a new folder with a file for each module that Python and the libraries of KiKS have, and hostile settings.

    Each file that is run writes its name into the file `ran` beside the folder.
    """
    inside = folder / "hand-in"
    inside.mkdir()
    for name in {*sys.stdlib_module_names, *packages_distributions(), "sitecustomize", "usercustomize"}:
        (inside / f"{name}.py").write_text(f"open({str(folder / 'ran')!r}, 'a').write(__file__ + '\\n')\n")
    (inside / ".numba_config.yaml").write_text("disable_jit: 1\n")
    (inside / "matplotlibrc").write_text("text.usetex: True\n")
    return inside


@cache
def compile_engine() -> None:
    """Have the engine compiled, so that commands begin at once."""
    subprocess.run([sys.executable, "-m", "kiks", "warmup"], stdout=subprocess.DEVNULL, check=True)


def python(program: str, folder: Path, environment: dict[str, str] | None = None, **options: Any) -> tuple[int, str]:
    """Run a Python program to its end; return its exit code and what it has said."""
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        cwd=folder,
        env={**quiet(folder), **(environment or {})},
        check=False,
        **options,
    )
    return done.returncode, done.stdout + done.stderr


# ---- serial ports over TCP ----


@contextmanager
def serving(*words: str, folder: Path, **options: Any) -> Iterator[tuple[Command, int]]:
    """Let `kiks serve` run; the number is the TCP port of robot 1."""
    with started("serve", "--tcp", "0", "--no-pty", *words, folder=folder, **options) as command:
        yield command, int(command.find(r"socket://[^:]*:(\d+)"))


def connect(port: int, timeout_s: float = GUARD_S) -> socket.socket:
    """Return a connection on this computer."""
    return socket.create_connection(("127.0.0.1", port), timeout=timeout_s)


def check_robot(port: int) -> None:
    """Check that a robot answers a new client, who comes again until it is let in.

    Raises:
        Broken: If it does not.
    """
    end_s = time.monotonic() + GUARD_S
    while time.monotonic() < end_s:
        with contextlib.suppress(OSError), connect(port, GUARD_S / 10) as line:
            line.sendall(b"\nN\n")
            if line.recv(2, socket.MSG_WAITALL) == b"n,":
                return
        time.sleep(0.2)
    raise Broken("hang", "a new client must be answered, but none was", "a robot's port")


# ---- desks ----


class Looker:
    """A browser of a desk, without a screen: it has its cookie, and acknowledges frames.

    Args:
        url: What the desk has said: its page, with a token if it wants one.
    """

    def __init__(self, url: str) -> None:
        jar = HTTPCookieProcessor()
        self.opener: OpenerDirector = build_opener(jar)
        with self.opener.open(url, timeout=GUARD_S) as answer:
            self.page: bytes = answer.read()
            parts = urlsplit(answer.url)
        self.cookies = "; ".join(f"{cookie.name}={cookie.value}" for cookie in jar.cookiejar)
        self.feed = urlunsplit(("ws", parts.netloc, f"{parts.path.rstrip('/')}/feed", "", ""))

    def look(self, frames: int, *, hold: threading.Event | None = None) -> int:
        """Return how many frames have come; with an event, until that is set."""
        from websockets.sync.client import connect as open_socket

        headers = {"Cookie": self.cookies} if self.cookies else None
        seen = 0
        with open_socket(self.feed, compression=None, open_timeout=GUARD_S, additional_headers=headers) as feed:
            while seen < frames or (hold is not None and not hold.is_set()):
                if isinstance(feed.recv(GUARD_S), bytes):
                    seen += 1
                    feed.send('{"kind": "ack"}')
        return seen


@contextmanager
def desk(*words: str, folder: Path, **options: Any) -> Iterator[tuple[Command, str]]:
    """Let `kiks desk` run; the text is where its page is."""
    with started("desk", *words, "--port", "0", "--no-browser", folder=folder, **options) as command:
        yield command, command.find(r"(http://\S+)")


# ---- sessions ----


class SessionClient:
    """Octave, as a session sees it: on the pipes of a process that it has started.

    Args:
        folder: Where sessions are found.
        **options: Of its process.
    """

    def __init__(self, folder: Path, **options: Any) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "kiks", "session"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
            env=quiet(folder),
            **options,
        )
        self.greeting = self.hear()

    def hear(self) -> str:
        """Return the next answer, and confirm meanwhile that it is waited for.

        Raises:
            Broken: If none comes.
        """
        while True:
            length = int(self._read(8))
            heard = self._read(max(length, 88))[:length].decode()
            if heard != "~":
                return heard
            self._say("")

    def ask(self, request: str) -> str:
        """Return the answer to a request."""
        self._say(request)
        return self.hear()

    def _say(self, line: str) -> None:
        assert self.process.stdin is not None
        os.write(self.process.stdin.fileno(), f"{line}\n".encode())

    def _read(self, count: int) -> bytes:
        assert self.process.stdout is not None
        source, data = self.process.stdout.fileno(), b""
        while len(data) < count:
            if not select.select([source], [], [], GUARD_S)[0]:
                raise Broken("hang", f"an answer must come, but {data!r} did", "a session's answer")
            piece = os.read(source, count - len(data))
            if not piece:
                raise Broken("death", f"it has ended after {data!r}", "a session ends")
            data += piece
        return data

    def kill(self) -> None:
        """End it at once."""
        self.process.kill()
        self.process.wait()
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.close()
        self.process.stdout.close()

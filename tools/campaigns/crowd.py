"""A thousand clients at once, on this computer only; afterwards one who means it is still served."""

from __future__ import annotations

import errno
import random
import resource
import socket
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from tools.campaigns.processes import (
    GUARD_S,
    Command,
    Looker,
    SessionClient,
    check_robot,
    compile_engine,
    connect,
    desk,
    serving,
    started,
)
from tools.campaigns.runner import SECRET, Broken, Campaign, Play

CLIENTS = 1000
"""How many come."""

FEW = 200
"""How many descriptors a server has in every other case."""

LATE_S = 5.0
"""Longest time that a client tries to get in [s]; a server may let it wait."""

_HTTP = (
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: evil.example\r\nOrigin: http://[\r\n\r\n",
    b"GET /%0d%0aSet-Cookie:a=b HTTP/1.1\r\nHost: localhost\r\nOrigin: null\r\n\r\n",
    b"GET /desk/0/feed HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Token: AAAAAAAAAAAAAAAAAAAAAA==\r\nOrigin: http://127.0.0.1:99999999\r\n\r\n",
    b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 99999999999999\r\n\r\n" + b"x" * 10_000,
    b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\nffffffff\r\n",
    b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: -1\r\n\r\n",
    b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 5000,
    b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: ",
    b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
)  # fmt: skip
"""What comes to a web server."""

_OTHERS = (
    b"",
    b"N\n",
    b"\n",
    b"\xff" * 3000,
    b"token",
    SECRET.encode() + b"\n",
    b"a" * 200,
    b"\0\n",
    b"D,5,5\nN\n" * 100,
)
"""What comes to anyone."""


def crowd(rng: random.Random, port: int, said: tuple[bytes, ...]) -> None:
    """Let clients come to a port; some go at once, some stay until all have come.

    Raises:
        Broken: If the port accepts no more clients.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, min(hard, CLIENTS + 300)), hard))
    there: list[socket.socket] = []
    stays = rng.random() < 0.5
    # All of one kind, silent ones above all, take more of what there is than a mixture.
    said = rng.choice((said, said, (b"",), (rng.choice(said),)))
    for _ in range(CLIENTS):
        try:
            client = socket.create_connection(("127.0.0.1", port), timeout=LATE_S)
        except TimeoutError:
            break  # A server may let clients wait.
        except OSError as error:
            if error.errno in (errno.ECONNREFUSED, errno.EMFILE):
                raise Broken("death", f"the port accepts no more clients: {error}", "a crowd") from None
            continue
        client.settimeout(0.05)
        with suppress(OSError):
            client.sendall(rng.choice(said))
        if stays or rng.random() < 0.2:
            there.append(client)
        else:
            client.close()
    for client in there:
        client.close()


@contextmanager
def _place() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        yield Path(folder)


def _limits(rng: random.Random) -> dict[str, Any]:
    """Return options for a process that may have few descriptors."""
    return {"preexec_fn": partial(_have_few, FEW)} if rng.random() < 0.5 else {}


def _have_few(count: int) -> None:
    resource.setrlimit(resource.RLIMIT_NOFILE, (count, count))


def _serve(rng: random.Random) -> int:
    """Come to a robot's port."""
    with _place() as folder, serving(folder=folder, **_limits(rng)) as (command, port):
        crowd(rng, port, _OTHERS + _HTTP)
        check_robot(port)
        _check_end(command)
    return CLIENTS


def _desk(rng: random.Random) -> int:
    """Come to a desk."""
    with _place() as folder, desk(folder=folder, **_limits(rng)) as (command, url):
        port = urlsplit(url).port
        assert port is not None
        crowd(rng, port, _HTTP + _HTTP + _OTHERS)
        _again(lambda: Looker(url).look(3), "a desk")
        _check_end(command)
    return CLIENTS


def _session(rng: random.Random) -> int:
    """Come to a session."""
    with _place() as folder:
        client = SessionClient(folder, **_limits(rng))
        words = client.greeting.split()
        port, token = int(words[words.index("port") + 1]), words[words.index("token") + 1]
        try:
            crowd(rng, port, _OTHERS + _HTTP)
            if not client.ask("version").startswith("+"):
                raise Broken("hang", "who was there must still be answered", "a session")
            _again(lambda: _join(port, token), "a session")
        finally:
            client.kill()
    return CLIENTS


def _join(port: int, token: str) -> None:
    with connect(port, LATE_S) as line:
        line.sendall(f"{token}\nversion\n".encode())
        heard = b""
        while b"+  0" not in heard:
            piece = line.recv(1000)
            if not piece:
                raise ConnectionError("hung up")
            heard += piece


def _again(act: Callable[[], object], what: str) -> None:
    """Do something again and again until it succeeds.

    Raises:
        Broken: If it never does.
    """
    last: Exception | None = None
    end_s = time.monotonic() + GUARD_S
    while time.monotonic() < end_s:
        try:
            act()
        except (OSError, ValueError) as error:
            last = error
            time.sleep(0.5)
        else:
            return
    raise Broken("hang", f"one who means it must be let in, but {last!r}", what)


def _check_end(command: Command) -> None:
    command.check()
    if command.process.poll() is not None:
        raise Broken("death", command.said[-200:], "a server ends")
    command.process.terminate()
    command.end()


def _many_robots(rng: random.Random) -> int:
    """Ask for more ports than there are descriptors."""
    with _place() as folder:
        options: dict[str, Any] = {"preexec_fn": partial(_have_few, rng.choice((64, 256, 1024)))}
        words = ["serve", "--robots", "300", "--tcp", "0", *rng.choice(((), ("--no-pty",), ("--rfc2217", "0")))]
        with started(*words, folder=folder, **options) as command:
            if command.end() == 0:
                raise Broken("foreign", "it must be refused", "descriptors")
    return 300


SCENES: dict[str, tuple[Callable[[random.Random], int], int]] = {
    "serve": (_serve, 8), "desk": (_desk, 8), "session": (_session, 8), "many_robots": (_many_robots, 6),
}  # fmt: skip
"""The servers under test, and the number of cases for each."""


def _ready(scene: Callable[[random.Random], int]) -> Play:
    compile_engine()
    return scene


def campaigns() -> Iterator[Campaign]:
    """Yield one for each of them."""
    for name, (scene, count) in SCENES.items():
        yield Campaign(f"crowd.{name}", count, partial(_ready, scene), limit_s=100.0)

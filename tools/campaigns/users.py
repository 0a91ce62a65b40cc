"""Other users of this computer: what they get from a browser, connect to and lock. Only the superuser can play them."""

from __future__ import annotations

import fcntl
import os
import random
import socket
import struct
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from http.cookiejar import CookieJar
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import HTTPCookieProcessor, Request, build_opener

from tests.stranger import as_stranger
from tools.campaigns.processes import GUARD_S, compile_engine, connect, desk
from tools.campaigns.runner import Broken, Campaign, Play

from kiks.desk.server.token import Token
from kiks.errors import LinkError
from kiks.ports.pty import PtyEndpoint

PER_CASE = 20
"""How often a stranger tries it in a case."""


def _desk(rng: random.Random) -> int:
    """Take the cookies that a browser sends to the port of a desk that has ended to another desk, which goes on."""
    browser = build_opener(HTTPCookieProcessor(jar := CookieJar()))
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        with desk(folder=Path(folder)) as (_, ended), browser.open(ended, timeout=GUARD_S) as page:
            old = urlsplit(page.url)
        with desk(folder=Path(folder)) as (_, living):
            browser.open(living, timeout=GUARD_S).close()
            token, port = living.partition("token=")[2], urlsplit(living).port
            if port is None or token not in {cookie.value for cookie in jar}:
                raise Broken("foreign", "the browser must have the token, but it has not", "no cookie")
            for _ in range(PER_CASE):
                path = rng.choice((old.path, "/desk/1", "/", "/_nicegui_ws/socket.io/")) + rng.choice(
                    ("", "/feed", "?x")
                )
                stale = Request(f"http://{old.netloc}{path}")
                jar.add_cookie_header(stale)
                cookie = stale.get_header("Cookie") or ""
                if token in cookie:
                    raise Broken("foreign", f"{path}: {cookie}", "a stranger gets the token")
                # Even the token alone opens nothing: only the browser knows where.
                cookie = rng.choice((cookie, f"kiks_token={token}"))
                with as_stranger(), connect(port) as client:
                    client.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nCookie: {cookie}\r\n\r\n".encode())
                    said = client.recv(12)
                if not said.endswith(b"403"):
                    raise Broken("foreign", f"{path}: {said!r}", "a stranger is let in")
    return PER_CASE


def _ticket(rng: random.Random) -> int:
    """Come with a ticket that a stranger has read, and go in different ways; then the owner comes with it."""
    key = Token()
    ticket = key.new_ticket()
    with socket.create_server(("127.0.0.1", 0)) as listener:
        for _ in range(PER_CASE):
            with as_stranger():
                client = socket.create_connection(listener.getsockname())
            ends, end = (
                (client.getsockname(), listener.getsockname()),
                rng.choice(("stays", "shuts", "closes", "resets")),
            )
            with client, listener.accept()[0] as accepted:
                if end == "shuts":
                    client.shutdown(rng.choice((socket.SHUT_RD, socket.SHUT_WR, socket.SHUT_RDWR)))
                elif end == "resets":
                    client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                if end in ("closes", "resets"):
                    client.close()
                if rng.random() < 0.3:
                    accepted.close()
                if key.take(ticket, *ends):
                    raise Broken("foreign", end, "a stranger is let in by a ticket")
        with socket.create_connection(listener.getsockname()) as client, listener.accept()[0]:
            if not key.take(ticket, client.getsockname(), listener.getsockname()):
                raise Broken("lost", "the owner's ticket must be valid, but it is not", "a stranger has used a ticket")
    return PER_CASE


def _link(rng: random.Random) -> int:
    """Try to keep a link from its owner, who then opens it."""
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        os.chmod(folder, 0o755)
        for _ in range(PER_CASE):
            others = _abstract_names()
            endpoint = PtyEndpoint(f"{folder}/robot")
            names = _abstract_names() - others
            if is_closed := rng.random() < 0.5:
                endpoint.close()
            held, sockets = [], [socket.socket(socket.AF_UNIX) for _ in names]
            with as_stranger():
                for name, each in zip(names, sockets, strict=True):
                    with suppress(OSError):
                        each.bind(f"\0{name}")
                for name in (".", *os.listdir(folder), ".robot.lock", "robot"):
                    flags = rng.choice((os.O_RDONLY, os.O_RDWR | os.O_CREAT))
                    with suppress(OSError):
                        held.append(os.open(f"{folder}/{name}", flags | os.O_NONBLOCK | os.O_NOCTTY))
                        fcntl.flock(held[-1], rng.choice((fcntl.LOCK_EX, fcntl.LOCK_SH)) | fcntl.LOCK_NB)
            if not is_closed:
                endpoint.close()
            try:
                PtyEndpoint(f"{folder}/robot").close()
            except LinkError as error:
                raise Broken("lost", str(error), "a stranger keeps a link") from None
            for file in held:
                os.close(file)
            for each in sockets:
                each.close()
    return PER_CASE


def _abstract_names() -> set[str]:
    """Return the names of sockets of KiKS that are no files, which any user can take."""
    listed = (line.split()[-1] for line in Path("/proc/net/unix").read_text().splitlines())
    return {name[1:] for name in listed if name.startswith("@kiks")}


def _ready(play: Play) -> Play:
    compile_engine()
    return play


def campaigns() -> Iterator[Campaign]:
    """Yield one for each of them, if this is the superuser."""
    if os.getuid() == 0:
        for play, count in ((_desk, 8), (_ticket, 100), (_link, 500)):
            yield Campaign(f"users.{play.__name__[1:]}", count, partial(_ready, play), limit_s=100.0)

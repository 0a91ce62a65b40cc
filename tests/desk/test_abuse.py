"""Abuse of the desk's server: malformed requests, too many connections, misused sockets."""

import logging
import random
import socket
from collections.abc import Iterator
from contextlib import closing, suppress
from urllib.parse import urlsplit

import pytest
from tests.desk.clients import OWNER, feed_of
from tests.guard import GUARD_S
from websockets.exceptions import ConnectionClosed, InvalidStatus

import kiks
from kiks.desk.server import access
from kiks.desk.server.server import SERVER
from kiks.desk.server.show import Shown, show
from kiks.errors import ParameterError
from kiks.model.limits import MESSAGE_BYTES_MAX, REQUEST_BYTES_MAX


@pytest.fixture(scope="module")
def shown() -> Iterator[Shown]:
    with closing(show(kiks.Simulation(kiks.Arena.box(300, 300)), port=0, browser=False)) as shown:
        yield shown


@pytest.fixture(autouse=True)
def is_unharmed(shown: Shown, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]) -> Iterator[None]:
    """After a test, the desk goes on, and neither the log nor the standard error has a traceback."""
    yield
    assert is_well(shown)
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING and record.exc_info]
    assert "Traceback" not in capfd.readouterr().err


def connected() -> socket.socket:
    """Return a new connection to the server, which sends no token."""
    url = urlsplit(SERVER.address())
    return socket.create_connection((url.hostname, url.port), timeout=GUARD_S)


def knock(data: bytes) -> bytes:
    """Return the answer to bytes of a client without the token."""
    with connected() as stranger:
        with suppress(OSError):
            stranger.sendall(data)
            stranger.shutdown(socket.SHUT_WR)
        answer = b""
        with suppress(ConnectionError):
            while piece := stranger.recv(1 << 16):
                answer += piece
    return answer


def is_well(shown: Shown) -> bool:
    """Return whether a browser with the token gets its page."""
    status, page = OWNER.page(urlsplit(shown.url).path[1:])
    return status == 200 and "KiKS" in page


LOCAL = b" HTTP/1.1\r\nHost: 127.0.0.1\r\n"
NO_REQUESTS = [
    *(b"", b"\0" * 1000, b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + b"\xaa" * 100, b"D,10,10\n", b"GET\r\n\r\n"),
    *(b"GET / HTTP/%s\r\n\r\n" % rest for rest in (b"9.9", b"1.1", b"1.1\r\nHost: a\r\nHost: b", b"1.1\r\nHost: [")),
    *(b"GET /%s%s\r\n" % (path, LOCAL) for path in (b"\x00\xff", b"%0d%0aset-cookie:%20a=b", b"/evil.example/%2e%2e")),
    b"GET /_nicegui_ws/socket.io/?EIO=4&transport=polling" + LOCAL + b"\r\n",
    b"GET /" + b"a" * 1_000_000 + b" HTTP/1.1\r\n\r\n",
    b"GET /%sOrigin: http://[\r\n\r\n" % LOCAL,
    b"GET /%sCookie: \xff\xfe;;;=;\r\n\r\n" % LOCAL,
    b"GET /%sx: %s" % (LOCAL, b"y" * 1_000_000),
    b"GET /%s%s" % (LOCAL, b"x: y\r\n" * 100_000),
    *(b"POST /%sContent-Length: %s\r\n\r\n" % (LOCAL, length) for length in (b"99999999999999999999", b"-1")),
    b"POST /%sTransfer-Encoding: chunked\r\n\r\nFFFFFFFFFFFFFFFFFF\r\n" % LOCAL,
    *(b"GET /desk/1/feed%sUpgrade: %s\r\nConnection: Upgrade\r\n\r\n" % (LOCAL, to) for to in (b"websocket", b"h2c")),
]


def test_malformed_requests_are_refused(shown: Shown) -> None:
    chance = random.Random(1)
    whole = b"GET /desk/1?x=1 HTTP/1.1\r\nHost: 127.0.0.1\r\nOrigin: http://127.0.0.1\r\nCookie: a=b\r\n\r\n"
    spoilt = [bytearray(whole) for _ in range(200)]
    for data in spoilt:
        for _ in range(chance.randrange(1, 5)):
            data[chance.randrange(len(data))] = chance.randrange(256)
    for data in NO_REQUESTS + spoilt:
        answer = knock(data)
        assert answer == b"" or answer.split(b" ", 2)[1] in (b"400", b"403", b"413", b"426", b"431"), data[:200]
        assert SERVER.key.token.encode() not in answer


def test_silent_connections_do_not_block_others(shown: Shown) -> None:
    idle = [connected() for _ in range(3 * access.STRANGERS_MAX)]
    for half in idle[::2]:
        with suppress(OSError):
            half.sendall(b"GET / HTTP/1.1\r\n")
    assert is_well(shown)
    # The server closes the oldest connections first.
    for early in idle[: access.STRANGERS_MAX]:
        with suppress(ConnectionError):
            assert early.recv(1) == b""
    for each in idle:
        each.close()


def test_an_unauthenticated_connection_times_out(shown: Shown, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(access, "STRANGER_S", 0.0)
        with connected() as stranger, suppress(ConnectionError):
            assert stranger.recv(1) == b""


def test_an_authenticated_connection_does_not_time_out(shown: Shown) -> None:
    with feed_of(shown) as feed:
        idle = [connected() for _ in range(2 * access.STRANGERS_MAX)]
        for _ in range(5):
            while not isinstance(feed.recv(GUARD_S), bytes):
                pass
            feed.send('{"kind": "ack"}')
        for each in idle:
            each.close()


EVENTS = "_nicegui_ws/socket.io/?EIO=4&transport=websocket"
"""Where a page sends its events."""

NO_FRAMES = [
    b"\x81\x84\0\0\0\0\xff\xfe\xff\xfe",  # a text that is none
    b"\x82\x81\0\0\0\0x",  # bytes, not a text
    b"\x81\x01x",  # not masked
    b"\xf1\x80\0\0\0\0",  # bits that mean nothing
    b"\x83\x80\0\0\0\0",  # an opcode that is none
    b"\x89\xfe\xff\xff\0\0\0\0",  # a ping that is too long
    b"\x80\x80\0\0\0\0",  # goes on where nothing began
    b"\x81\xff" + (MESSAGE_BYTES_MAX + 1).to_bytes(8, "big") + b"\0\0\0\0",  # too long
    b"\x81\xff\xff\xff\xff\xff\xff\xff\xff\xff\0\0\0\0",
    b"\x88\x81\0\0\0\0x",  # a close that is half
    b"\x88\x82\0\0\0\0\xff\xff",
    bytes(range(256)),
]


@pytest.mark.slow
def test_malformed_websocket_frames_close_the_socket(shown: Shown) -> None:
    for frames in NO_FRAMES:
        for client in (feed_of(shown), OWNER.socket(EVENTS)):
            with client:
                client.socket.sendall(frames)
                # Below the library: it would object itself.
                with suppress(OSError):
                    client.socket.shutdown(socket.SHUT_WR)
                with suppress(Exception):
                    while client.recv(GUARD_S):
                        pass


MESSAGES = """
9 4 42 42[] 42{} 42[1] 42[null] 42["event"] 42["event",1] 42["event",{}] 44 42["event",{"client_id":[]}] 451-[] 5
42["handshake",{}] 42["handshake",{"client_id":1,"tab_id":{}}] 42["javascript_response",{}] 42["ack",{}] 42["log",{}] 6
42["connect"] 42["disconnect"] 42["event",1e400] 40/nowhere, b4AAAA 41 1 420["event",{}] 2probe 42["\\ud800"]
45999999-["event",{"_placeholder":true,"num":0}]
"""


@pytest.mark.slow
def test_malformed_events_are_ignored(shown: Shown) -> None:
    for message in ("", "42" + "[" * 100_000, f'42["event",{"9" * 5000}]', *MESSAGES.split()):
        with OWNER.socket(EVENTS) as client:
            client.send("40")
            client.recv(GUARD_S)
            client.send(message)
            with suppress(ConnectionClosed):  # the desk may hang up on it
                client.send("3")


def test_malformed_uploads_are_refused(shown: Shown) -> None:
    from nicegui import app, ui

    @ui.page("/with-an-upload")
    def page() -> None:
        ui.upload()

    OWNER.page("with-an-upload")
    (path,) = {route.path for route in app.routes if "/upload/" in getattr(route, "path", "")}
    kinds = [
        ("text/plain", b"x"),
        ("multipart/form-data", b"x"),
        ("multipart/form-data; boundary=b", b"x"),
        ("multipart/form-data; boundary=b", b'--b\r\nContent-Disposition: form-data; name="a"\r\n\r\nx\r\n--b--\r\n'),
        ("multipart/form-data; boundary=b", b"--b\r\n\r\n\r\n--b--\r\n"),
        ("multipart/form-data; boundary=" + "b" * 5000, b"--b"),
        ("\xff", b""),
    ]
    for kind, body in kinds:
        status, *_ = OWNER.ask(f"{SERVER.key.place}{path}", "POST", body, content_type=kind)
        assert status in (200, 400, 415, 500), (kind, body)


def test_a_too_large_body_is_not_stored(shown: Shown) -> None:
    url = urlsplit(shown.url)
    piece = b"100000\r\n" + b"x" * 0x100000 + b"\r\n"
    head = f"POST {SERVER.key.place}/desk/1 HTTP/1.1\r\nHost: {url.netloc}\r\nCookie: {OWNER.cookie}\r\n"
    for header, body in ((f"Content-Length: {REQUEST_BYTES_MAX + 1}", b""), ("Transfer-Encoding: chunked", piece)):
        with connected() as client:
            client.sendall(f"{head}{header}\r\n\r\n".encode())
            with suppress(OSError):
                for _ in range(REQUEST_BYTES_MAX // 0x100000 + 2):
                    client.sendall(body)
            with suppress(ConnectionError):
                assert client.recv(100).split(b" ", 2)[1] == b"413"


@pytest.mark.parametrize("kind", [KeyError, ParameterError])
def test_a_failure_of_the_application_is_one_line_of_the_log(
    kind: type[Exception], shown: Shown, caplog: pytest.LogCaptureFixture
) -> None:
    from nicegui import app

    name = kind.__name__

    @app.get(f"/{name}")
    @app.websocket(f"/{name}-too")
    async def fail() -> None:
        raise kind("x" * 1000)

    status, page = OWNER.page(name)
    assert (status, "Traceback" in page) == (500, False)
    with pytest.raises(InvalidStatus, match="500"):
        OWNER.socket(f"{name}-too")
    records = [record for record in caplog.records if record.name.startswith("kiks")]
    assert records
    for record in records:
        assert record.getMessage().startswith(f"The desk: Exception in ASGI application: {name}(")
        assert len(record.getMessage()) < 250
        assert record.exc_info is None


def test_only_pages_of_this_computer_may_embed_the_desk(shown: Shown) -> None:
    inside = OWNER.ask(f"{SERVER.key.place}{urlsplit(shown.url).path}")[1]
    for headers in (inside, knock(b"GET / HTTP/1.0\r\n\r\n").decode()):
        policy = headers.split("content-security-policy: ")[1].splitlines()[0]
        assert policy.startswith("frame-ancestors 'self' http://localhost:*")
        assert " *" not in policy.replace(":*", "")

"""Mistakes and attacks at a robot's port: browsers, floods, too many clients, no descriptors."""

import os
import socket
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests import forked
from tests.at_length import cases
from tests.ports.helpers import WallClock, ask_socket, connect, live, no_descriptors, warnings, wheels
from tests.served import GUARD_S, ask, opened, served

from kiks.clock.pace import Pace
from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.errors import LinkError
from kiks.firmware.khepera.commands import COMMANDS
from kiks.ports.endpoint import Endpoint
from kiks.ports.live import LEFT_BEHIND_NS
from kiks.ports.pty import PtyEndpoint
from kiks.ports.resources import _warn_of_shortage
from kiks.ports.rfc2217 import Rfc2217Endpoint
from kiks.ports.tcp import HTTP_REQUEST, TcpEndpoint
from kiks.units import NS_PER_S


@given(
    lines=st.lists(
        st.one_of(
            st.tuples(
                st.sampled_from([each.letter for each in COMMANDS]),
                st.lists(st.integers(-(10**6), 10**6).map(str), max_size=12),
            ).map(lambda each: ",".join([each[0], *each[1]]).encode()),
            st.sampled_from([b"serial 38400", b"POS,1,2", b"GET", b"G ET", b"restart", b"T,1,GET", b"HTTP/1.1", b""]),
        ),
        min_size=1,
        max_size=4,
    ),
    end=st.sampled_from([b"\r", b"\n", b"\r\n"]),
)
def test_no_program_is_taken_for_a_browser(lines: list[bytes], end: bytes) -> None:
    assert not HTTP_REQUEST.match(end.join([*lines, b""]))


@pytest.mark.parametrize("kind", [TcpEndpoint, Rfc2217Endpoint])
@pytest.mark.parametrize("thinking", ["none", "live"])
def test_a_page_in_a_browser_drives_no_robot(kind, thinking, caplog):
    endpoint = kind(0)
    form = b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 18\r\n\r\nD,10,10\nG,7,7\n\n\n"
    options = {"pace": Pace(wall_ns=WallClock())} if thinking == "live" else {}
    with served([endpoint], thinking=thinking, **options) as run:
        for pieces in ([form], [form[:3], form[3:20], form[20:]], [b"GET /" + b"D" * 9999 + form[6:]]):
            with connect(endpoint) as browser, suppress(OSError):
                for piece in pieces:
                    browser.sendall(piece)
                    run.wait_rounds(2)
                while browser.recv(100):
                    pass
            run.wait_free()
        assert wheels(run.sim) == [0, 0]
        assert not run.sim.wires[0].pending
        if kind is TcpEndpoint and thinking == "none":
            with connect(endpoint) as client:
                assert ask_socket(client, b"H\n") == b"h,0,0\r\n"
    assert warnings(caplog) == [
        f"a client of {endpoint.name} must speak as to a serial port, but one spoke HTTP and was disconnected: a page "
        "in a browser may have tried to drive the robot. Do not open this port in a browser."
    ]


@pytest.mark.parametrize("command", cases([b"N\n", b"D,5,5\n", b"H\n", b"B\n"], 2))
def test_flood_delays_the_next_client_by_two_seconds_at_most(command: bytes) -> None:
    with live() as (run, endpoint, wall):
        line = run.sim.wires[0].line
        with connect(endpoint) as flooder:
            flooder.sendall(command * (BACKLOG_LIMIT // len(command)))
            run.wait_for(lambda: line.sending_until_ns - run.sim.now_ns > 2 * LEFT_BEHIND_NS)
            # Most of it acts. Each reply is longer than its command, and the next client does not wait for replies.
            wall.pass_ns(NS_PER_S)
            run.wait_for(lambda: run.sim.now_ns >= NS_PER_S)
        run.wait_free()
        gone_ns = run.sim.now_ns
        with connect(endpoint) as client:
            run.wait_held()
            client.sendall(b"E\n")
            run.wait_for(lambda: run.sim.wires[0].firmware.receiver is not None and run.sim.wires[0].pending)
            client.setblocking(False)
            reply = b""
            while not reply and run.sim.now_ns - gone_ns < 5 * NS_PER_S:
                wall.pass_ns(NS_PER_S // 20)
                run.wait_rounds(2)
                with suppress(BlockingIOError):
                    reply = client.recv(100)
            assert reply.startswith(b"e,")
            assert run.sim.now_ns - gone_ns <= LEFT_BEHIND_NS + NS_PER_S // 5


def test_dropped_commands_of_a_flood_are_logged(caplog: pytest.LogCaptureFixture) -> None:
    with live() as (run, endpoint, _):
        with connect(endpoint) as flooder:
            flooder.sendall(b"D,1,1\n" * 600)
            run.wait_for(lambda: len(run.sim.wires[0].pending) == 600)
        run.wait_free()
        assert 0 < len(run.sim.wires[0].pending) < 600
    assert warnings(caplog) == [
        "the client of robot 1 has gone, but its commands were more than 2 s ahead of the robot: the rest of them is "
        "dropped. Read a line after each command."
    ]


def test_unread_flood_is_dropped_with_its_client(caplog: pytest.LogCaptureFixture) -> None:
    with live() as (run, endpoint, _):
        flooder = connect(endpoint)
        flooder.setblocking(False)
        flood = b"D,1,1\n" * (BACKLOG_LIMIT * 20)
        assert flooder.send(flood) > BACKLOG_LIMIT * 10
        run.wait_for(lambda: run.sim.wires[0].line.sending_until_ns > BACKLOG_LIMIT * NS_PER_S // 1000)
        flooder.close()
        # The wall clock stands still, so the line carries no more characters. Still the port becomes free.
        with connect(endpoint):
            run.wait_for(lambda: "the rest of them is dropped" in "".join(warnings(caplog)))
            run.wait_held()


def test_rejected_client_does_not_shorten_a_flood() -> None:
    with live() as (run, endpoint, wall), connect(endpoint) as flooder:
        flooder.sendall(b"D,1,1\n" * BACKLOG_LIMIT + b"D,3,4\n")
        run.wait_for(lambda: run.sim.wires[0].line.sending_until_ns > BACKLOG_LIMIT * NS_PER_S // 1000)
        with connect(endpoint) as other:
            assert other.recv(1) == b""
        while wheels(run.sim) != [3, 4]:
            wall.pass_ns(NS_PER_S)
            run.wait_rounds(2)
            assert run.sim.now_ns < 2 * 6 * BACKLOG_LIMIT * NS_PER_S // 960


def test_remaining_commands_of_two_seconds_all_act() -> None:
    with live() as (run, endpoint, wall):
        with connect(endpoint) as client:
            client.sendall(b"D,1,1\n" * 100 + b"D,3,4\n")
            run.wait_for(lambda: len(run.sim.wires[0].pending) == 101)
        run.wait_free()
        wall.pass_ns(2 * NS_PER_S)
        run.wait_for(lambda: wheels(run.sim) == [3, 4])


def test_lockstep_logs_how_long_the_next_client_waits(caplog: pytest.LogCaptureFixture) -> None:
    ways = {1: [TcpEndpoint(0)], 2: [TcpEndpoint(0)]}
    with served(ways, when_silent="wait") as run, connect(ways[1][0]) as flooder, connect(ways[2][0]):
        run.wait_held(1)
        run.wait_held(2)
        flooder.sendall(b"N\n" * 1000)
        run.wait_rounds(5)
        flooder.close()
        run.wait_for(lambda: warnings(caplog))
    (warning,) = [text for text in warnings(caplog) if "left" in text]
    assert warning.startswith("the client of robot 1 has gone and left 99")
    assert "the next client may come after that, at most" in warning


def test_clients_wait_without_descriptors_and_the_server_goes_on(caplog: pytest.LogCaptureFixture) -> None:
    _warn_of_shortage.cache_clear()
    ways: dict[int, list[Endpoint]] = {1: [TcpEndpoint(0)], 2: [TcpEndpoint(0)]}
    with served(ways) as run, ExitStack() as stack:
        first = stack.enter_context(connect(ways[1][0]))  # type: ignore[arg-type]
        run.wait_held(1)
        # The end of the client needs a descriptor, too.
        late = stack.enter_context(socket.socket())
        with no_descriptors():
            late.settimeout(GUARD_S)
            late.connect(("127.0.0.1", ways[2][0].port))  # type: ignore[attr-defined]
            run.wait_for(lambda: warnings(caplog))
            assert run.sim.wires[1].holder is None
        run.wait_held(2)
        first.sendall(b"H\n")
        assert ask_socket(late, b"H\n") == b"h,0,0\r\n"
        assert first.recv(1) == b"h"
    (warning,) = warnings(caplog)
    assert "a client needs a file descriptor: this process may have" in warning
    assert "ulimit -n" in warning


def test_pty_is_renewed_without_descriptors(tmp_path: Path) -> None:
    link = f"{tmp_path}/robot"
    with served([PtyEndpoint(link)]) as run:
        with ExitStack() as stack:
            assert ask(stack.enter_context(opened(link)), b"H\n") == b"h,0,0\r\n"
            with no_descriptors() as taken:
                stack.close()
                taken.append(os.open(os.devnull, os.O_RDONLY))
                run.wait_free()
        with opened(link) as port:
            assert ask(port, b"H\n") == b"h,0,0\r\n"


@pytest.mark.parametrize("what", ["a serial port", "a TCP port"])
def test_error_explains_why_a_port_cannot_be_opened(what: str, tmp_path: Path) -> None:
    message = f"^{what} must be able to open, but it needs a file .*ulimit -n"
    with no_descriptors(), pytest.raises(LinkError, match=message):
        PtyEndpoint(f"{tmp_path}/robot") if what == "a serial port" else TcpEndpoint(0)


DESK = "the desk must be able to open 32 more files"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limit", "arguments", "words"),
    cases(
        [
            (16, "host --port 0", f"{DESK}, but this process may have 16 in all"),
            *((16, f"{words} --desk", DESK) for words in ("serve", "demo avoid")),
            (16, "room examples/exercises/lamp --students NAMES --port 0", DESK),
            (16, "serve --robots 6 --no-pty --tcp 0", "the server of ports must be able to open 9 more files"),
            (100, "serve --robots 40 --tcp 0", "this process may have 100"),
        ],
        normally=1,
    ),
)
def test_a_server_with_too_few_files_gives_one_line(limit: int, arguments: str, words: str, tmp_path: Path) -> None:
    (names := tmp_path / "names").write_text("Ada\n")
    given = [{"NAMES": f"{names}"}.get(word, word) for word in arguments.split()]
    code = (
        f"import resource, sys\nresource.setrlimit(resource.RLIMIT_NOFILE, ({limit}, {limit}))\n"
        f"sys.argv = ['kiks', *{given}]\nfrom kiks.__main__ import main\nmain()\n"
    )
    done = forked.run(code=code)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert words in line
    assert "llow more: ulimit -n " in line

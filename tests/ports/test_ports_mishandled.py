"""Mistakes and attacks at a robot's port: browsers, floods, too many clients, no descriptors."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from tests.ports.helpers import WallClock, ask_socket, connect, no_descriptors, warnings
from tests.served import GUARD_S, open_plain, read_line, served

from kiks.clock.pace import Pace
from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.errors import LinkError
from kiks.firmware.commands import COMMANDS
from kiks.ports.endpoint import Endpoint
from kiks.ports.live import LEFT_BEHIND_NS
from kiks.ports.pty import PtyEndpoint
from kiks.ports.resources import _warn_of_shortage
from kiks.ports.rfc2217 import Rfc2217Endpoint
from kiks.ports.tcp import HTTP_REQUEST, TcpEndpoint
from kiks.units import NS_PER_S

# ---- browsers ----


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
def test_a_page_in_a_browser_drives_no_robot(
    kind: type[TcpEndpoint], thinking: str, caplog: pytest.LogCaptureFixture
) -> None:
    endpoint = kind(0)
    form = b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 18\r\n\r\nD,10,10\nG,7,7\n\n\n"
    with served(
        [endpoint], thinking=thinking, **({"pace": Pace(wall_ns=WallClock())} if thinking == "live" else {})
    ) as run:
        for pieces in ([form], [form[:3], form[3:20], form[20:]], [b"GET /" + b"D" * 9999 + form[6:]]):
            with connect(endpoint) as browser, suppress(OSError):
                for piece in pieces:
                    browser.sendall(piece)
                    run.wait_rounds(2)
                while browser.recv(100):
                    pass
            run.wait_free()
        robot = run.sim.world.state.robots[0, 0]
        assert robot["speed_setpoint"].tolist() == [0, 0]
        assert not run.sim.wires[0].pending
        if kind is TcpEndpoint and thinking == "none":
            with connect(endpoint) as client:
                assert ask_socket(client, b"H\n") == b"h,0,0\r\n"
    assert warnings(caplog) == [
        f"a client of {endpoint.name} must speak as to a serial port, but one spoke HTTP and was disconnected: a page "
        "in a browser may have tried to drive the robot. Do not open this port in a browser."
    ]


# ---- floods ----


@settings(max_examples=6)
@given(command=st.sampled_from([b"N\n", b"H\n", b"D,5,5\n", b"B\n"]))
@example(command=b"N\n")
def test_flood_delays_the_next_client_by_two_seconds_at_most(command: bytes) -> None:
    wall, endpoint = WallClock(), TcpEndpoint(0)
    with served([endpoint], thinking="live", pace=Pace(wall_ns=wall)) as run:
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
            run.wait_rounds(2)
            for _ in range(100):
                wall.pass_ns(NS_PER_S // 20)
                run.wait_rounds(2)
                client.setblocking(False)
                try:
                    reply = client.recv(100)
                    break
                except BlockingIOError:
                    continue
            assert reply.startswith(b"e,")
            assert run.sim.now_ns - gone_ns <= LEFT_BEHIND_NS + NS_PER_S // 5


def test_dropped_commands_of_a_flood_are_logged(caplog: pytest.LogCaptureFixture) -> None:
    endpoint = TcpEndpoint(0)
    with served([endpoint], thinking="live", pace=Pace(wall_ns=WallClock())) as run:
        with connect(endpoint) as flooder:
            flooder.sendall(b"D,1,1\n" * 600)
            run.wait_for(lambda: len(run.sim.wires[0].pending) == 600)
        run.wait_free()
        left_count = len(run.sim.wires[0].pending)
        assert 0 < left_count < 600
    assert warnings(caplog) == [
        "the client of robot 1 has gone, but its commands were more than 2 s ahead of the robot: the rest of them is "
        "dropped. Read a line after each command."
    ]


def test_unread_flood_is_dropped_with_its_client(caplog: pytest.LogCaptureFixture) -> None:
    endpoint = TcpEndpoint(0)
    with served([endpoint], thinking="live", pace=Pace(wall_ns=WallClock())) as run:
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
    wall, endpoint = WallClock(), TcpEndpoint(0)
    with served([endpoint], thinking="live", pace=Pace(wall_ns=wall)) as run, connect(endpoint) as flooder:
        count = BACKLOG_LIMIT
        flooder.sendall(b"D,1,1\n" * count + b"D,3,4\n")
        run.wait_for(lambda: run.sim.wires[0].line.sending_until_ns > BACKLOG_LIMIT * NS_PER_S // 1000)
        with connect(endpoint) as other:
            assert other.recv(1) == b""
        while run.sim.world.state.robots[0, 0]["speed_setpoint"].tolist() != [3, 4]:
            wall.pass_ns(NS_PER_S)
            run.wait_rounds(2)
            assert run.sim.now_ns < 2 * 6 * count * NS_PER_S // 960


def test_remaining_commands_of_two_seconds_all_act() -> None:
    wall, endpoint = WallClock(), TcpEndpoint(0)
    with served([endpoint], thinking="live", pace=Pace(wall_ns=wall)) as run:
        with connect(endpoint) as client:
            client.sendall(b"D,1,1\n" * 100 + b"D,3,4\n")
            run.wait_for(lambda: len(run.sim.wires[0].pending) == 101)
        run.wait_free()
        wall.pass_ns(2 * NS_PER_S)
        run.wait_for(lambda: run.sim.world.state.robots[0, 0]["speed_setpoint"].tolist() == [3, 4])


def test_lockstep_logs_how_long_the_next_client_waits(caplog: pytest.LogCaptureFixture) -> None:
    ways = {1: [TcpEndpoint(0)], 2: [TcpEndpoint(0)]}
    with served(ways, when_silent="wait") as run:
        flooder, other = connect(ways[1][0]), connect(ways[2][0])
        run.wait_held(1)
        run.wait_held(2)
        flooder.sendall(b"N\n" * 1000)
        run.wait_rounds(5)
        flooder.close()
        run.wait_for(lambda: warnings(caplog))
        other.close()
    (warning,) = [text for text in warnings(caplog) if "left" in text]
    assert warning.startswith("the client of robot 1 has gone and left 99")
    assert "the next client may come after that, at most" in warning


# ---- descriptors ----


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
        port = open_plain(link)
        os.write(port, b"H\n")
        assert read_line(port) == b"h,0,0\r\n"
        with no_descriptors() as taken:
            os.close(port)
            taken.append(os.open(os.devnull, os.O_RDONLY))
            run.wait_free()
        port = open_plain(link)
        os.write(port, b"H\n")
        assert read_line(port) == b"h,0,0\r\n"
        os.close(port)


@pytest.mark.parametrize("what", ["a serial port", "a TCP port"])
def test_error_explains_why_a_port_cannot_be_opened(what: str, tmp_path: Path) -> None:
    message = f"^{what} must be able to open, but it needs a file .*ulimit -n"
    with no_descriptors(), pytest.raises(LinkError, match=message):
        PtyEndpoint(f"{tmp_path}/robot") if what == "a serial port" else TcpEndpoint(0)


@pytest.mark.slow
def test_too_few_descriptors_for_all_robots_give_one_line(tmp_path: Path) -> None:
    words = f"{sys.executable} -m kiks serve --robots 40 --tcp 0 --link {tmp_path}/robot"
    done = subprocess.run(
        ["bash", "-c", f"ulimit -n 100; exec {words}"], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert "this process may have 100" in line
    assert not list(os.scandir(str(tmp_path)))

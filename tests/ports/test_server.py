import os
import signal
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest
from tests import forked
from tests.ports.helpers import WallClock, ask_socket, connect, live, warnings
from tests.served import GUARD_S, PROGRAMS, ask, fresh, opened, read_line, run_python, served

from kiks.clock.pace import Pace
from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.errors import ParameterError
from kiks.ports.pty import PtyEndpoint
from kiks.ports.server import Server
from kiks.ports.tcp import TcpEndpoint
from kiks.units import NS_PER_S, character_ns


@pytest.mark.parametrize("end", [b"\n", b"\r", b"\r\n"])
@pytest.mark.parametrize("thinking", ["none", "fixed:3.5"])
def test_lockstep_does_not_depend_on_how_bytes_are_split(tmp_path: Path, end: bytes, thinking: str) -> None:
    commands = [command + end for command in (b"D,9,7", b"N", b"D,-2", b"N", b"x", b"N")]
    memory = fresh(thinking=thinking)
    port, replies = memory.port(1), []
    for command in commands:
        port.write(command)
        replies.append(port.readline())
    for size in (10, 1):
        link = str(tmp_path / str(size))
        with served([PtyEndpoint(link)], thinking=thinking) as run:
            with opened(link) as end_of_line:
                for command, reply in zip(commands, replies, strict=True):
                    for start in range(0, len(command), size):
                        os.write(end_of_line, command[start : start + size])
                        run.wait_rounds(1)
                    assert read_line(end_of_line) == reply
            run.wait_free()
            assert (run.sim.state_hash(), run.sim.now_ns) == (memory.state_hash(), memory.now_ns)


def test_lockstep_drops_a_line_without_end_as_the_robot_does(tmp_path: Path) -> None:
    link = str(tmp_path / "robot")
    with served([PtyEndpoint(link)]) as run, opened(link) as port:
        for _ in range(3 * BACKLOG_LIMIT // 1024):
            os.write(port, b"x" * 1024)
            run.wait_rounds(1)
        assert (ask(port, b"\n"), ask(port, b"H\n")) == (b"Command not found\r\n", b"h,0,0\r\n")


def test_live_reply_arrives_on_time(tmp_path: Path) -> None:
    link = str(tmp_path / "robot")
    with live(PtyEndpoint(link), 2.0) as (run, _, wall), opened(link) as port:
        os.write(port, b"H\n")
        run.wait_held()
        run.wait_rounds(3)
        os.set_blocking(port, False)
        with pytest.raises(BlockingIOError):
            os.read(port, 100)
        # Two characters, 1 ms in the robot, and four characters of the reply; the clock passes half of that.
        begun_ns = (6 * character_ns(9600) + 1_000_000) // 2 + 100
        wall.pass_ns(begun_ns)
        run.wait_rounds(3)
        assert os.read(port, 100) == b"h,0,"
        wall.pass_ns(NS_PER_S // 10)
        os.set_blocking(port, True)
        assert read_line(port) == b"0\r\n"
        assert run.sim.now_ns == 2 * (begun_ns + NS_PER_S // 10)


def test_live_world_runs_without_a_client() -> None:
    with live() as (run, _, wall):
        run.wait_rounds(1)
        wall.pass_ns(NS_PER_S)
        run.wait_for(lambda: run.sim.now_ns == NS_PER_S)


def test_ctrl_c_ends_the_server_between_two_rounds(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the middle of a disconnection, it would leave descriptors of which the selector knows a half."""
    endpoint, rounds = TcpEndpoint(0), iter(range(1000))
    server = Server(fresh(), {1: [endpoint]}, thinking="none")
    epoll = server._selector._selector

    class Interrupted:
        def __getattr__(self, name: str) -> object:
            return getattr(epoll, name)

        def unregister(self, descriptor: int) -> None:
            if descriptor == endpoint.fileno():
                signal.raise_signal(signal.SIGINT)
            epoll.unregister(descriptor)

    monkeypatch.setattr(server._selector, "_selector", Interrupted())
    connect(endpoint).close()
    with pytest.raises(KeyboardInterrupt):
        server.serve(until=lambda: next(rounds) == 999)
    assert server.sim.wires[0].holder is None
    server.close()


def test_one_client_of_several_endpoints_has_the_robot(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    link, tcp = str(tmp_path / "robot"), TcpEndpoint(0)
    with served([PtyEndpoint(link), tcp]) as run, ExitStack() as stack:
        client = stack.enter_context(connect(tcp))
        run.wait_held()
        port = stack.enter_context(opened(link))
        for _ in range(2):
            os.write(port, b"G,1,1\n")
            run.wait_for(lambda: caplog.records)
            run.wait_rounds(1)
        client.close()
        run.wait_free()
        assert ask(port, b"H\n") == b"h,0,0\r\n"
        assert stack.enter_context(connect(tcp)).recv(1) == b""
    assert warnings(caplog) == [
        f"robot 1 must have one client at a time, but another came to {came} while the client of {has} has it. "
        "Close that one first."
        for came, has in ((link, tcp.name), (tcp.name, link))
    ]


def test_client_of_a_robot_in_use_is_rejected(caplog: pytest.LogCaptureFixture) -> None:
    sim, tcp = fresh(), TcpEndpoint(0)
    sim.wires[0].holder = "a program in this process"
    with served([tcp], sim=sim), connect(tcp) as client:
        assert client.recv(1) == b""
    assert "while a program in this process has it" in caplog.text
    assert sim.wires[0].holder == "a program in this process"


def test_dropped_clients_are_disconnected_and_others_may_come() -> None:
    tcp = TcpEndpoint(0)
    with served([tcp]) as run:
        with connect(tcp) as client:
            assert ask_socket(client, b"E\n") == b"e,0,0\r\n"
            run.server.drop_clients()
            assert client.recv(100) == b""
        with connect(tcp) as another:
            assert ask_socket(another, b"E\n") == b"e,0,0\r\n"


def test_lag_is_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    wall = WallClock()
    pace = Pace(4.0, wall_ns=wall)
    pace.start(0)
    wall.pass_ns(NS_PER_S)
    pace.report(3_900_000_000)
    assert not caplog.records
    for _ in range(2):
        pace.report(2_000_000_000)
    assert warnings(caplog) == [
        "the simulation must keep up with 4 times real time, but it is 0.5 s behind. Ask for a lower speed; "
        "the robots do the same, only later."
    ]


def test_arguments_are_checked() -> None:
    with pytest.raises(ParameterError, match=r"robot must be the number of an existing robot, but it was 2"):
        Server(fresh(), {2: []})
    with pytest.raises(ParameterError, match=r"thinking of a server must be 'live', 'none' or 'fixed:MS', but it was"):
        Server(fresh(), {1: []}, thinking="live:2")
    for speed in (0, -1, float("nan"), 1e9):
        with pytest.raises(ParameterError, match=r"speed must be a number from 0\.001 to 1000, but it was"):
            Server(fresh(), {1: []}, speed=speed)


@pytest.mark.slow
def test_serve_command(tmp_path: Path) -> None:
    link = str(tmp_path / "robot")
    command = [sys.executable, "-m", "kiks", "serve", "--thinking", "none", "--link", link, "--tcp", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "Robot 1\n"
        assert process.stdout.readline() == f"  serial port  {link}\n"
        assert process.stdout.readline().startswith("  TCP          socket://127.0.0.1:")
        assert process.stdout.readline().startswith("The world waits for each command. Repeatable to the bit")
        assert run_python(PROGRAMS / "course.py", link).startswith("h,")
        process.send_signal(signal.SIGTERM)
        assert process.stdout.readline().startswith("Stopped after ")
        assert process.wait(GUARD_S) == 0
    assert not os.path.lexists(link)


# Runs `kiks serve` with a client, prints the first piece of a reply, and presses Ctrl-C.
WITH_CLIENT = """
import select, signal, socket, sys
from kiks.__main__ import main
from kiks.ports.server import Server
serve = Server.serve
def serve_client(server):
    with socket.create_connection(("127.0.0.1", server._endpoints[1][0].port)) as client:
        client.sendall(b"help\\n")
        serve(server, lambda: select.select([client], [], [], 0)[0])
        print(client.recv(4096))
    serve(server, lambda: signal.raise_signal(signal.SIGINT))
Server.serve = serve_client
sys.argv = ["kiks", "serve", "--no-pty", "--tcp", "0", *OPTIONS]
main()
"""


@pytest.mark.slow
@pytest.mark.parametrize("option", [[], ["--by-character"]])
def test_serve_command_says_how_replies_come_over_tcp(option: list[str]) -> None:
    # So slowly that the rest of a reply that comes by character is a minute away.
    options = ["--speed", "0.01" if option else "100", *option]
    done = forked.run(code=WITH_CLIENT.replace("OPTIONS", str(options)))
    assert done.returncode == 0, done.stderr
    (reply,) = [line for line in done.stdout.splitlines() if line.startswith("b'h")]
    assert reply.endswith("starting them\\r\\n'") == (not option)
    assert "Stopped after " in done.stdout

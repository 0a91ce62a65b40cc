"""Several programs on real ports, in lockstep and live."""

import select
import socket
import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from typing import Any

import pytest
from tests.at_length import cases
from tests.ports.helpers import WallClock, warnings
from tests.served import GUARD_S, fresh, served

from kiks.clock.pace import Pace
from kiks.clock.patience import Patience
from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.errors import ParameterError
from kiks.ports.endpoint import READ_SIZE, Endpoint
from kiks.ports.server import Server
from kiks.ports.tcp import TcpEndpoint
from kiks.units import NS_PER_S


class Client:
    """A program on a TCP port."""

    def __init__(self, endpoint: Endpoint) -> None:
        self.socket = socket.create_connection(tuple(endpoint.name.rsplit(":", 1)), timeout=GUARD_S)
        self.lines = self.socket.makefile("rb")

    def send(self, data: bytes) -> None:
        self.socket.sendall(data)

    def ask(self, command: bytes) -> bytes:
        self.send(command)
        return self.lines.readline()

    def has_no_reply(self) -> bool:
        return not select.select([self.socket], [], [], 0)[0]

    def hang_up(self) -> None:
        self.socket.shutdown(socket.SHUT_RDWR)
        self.close()

    def close(self) -> None:
        self.lines.close()
        self.socket.close()


@contextmanager
def clients(count: int = 2, come: Sequence[int] | None = None, **options: Any) -> Iterator[tuple[Any, list[Client]]]:
    """Serve each robot over TCP, with a wall clock that stands still, to clients of some robots, by default of all.

    `join` of the server lets another client come to a robot, `later` lets a time pass.
    """
    wall = WallClock()
    if options.get("thinking") == "live":
        options["pace"] = Pace(wall_ns=wall)
    ways = {robot: [TcpEndpoint(0)] for robot in range(1, count + 1)}
    with ExitStack() as stack:
        run: Any = stack.enter_context(served(ways, new_patience=partial(Patience, wall_ns=wall), **options))

        def join(robot: int, first: bytes = b"") -> Client:
            client = Client(ways[robot][0])
            stack.callback(client.close)
            client.send(first)
            run.wait_held(robot)
            return client

        def later(seconds: float) -> None:
            run.wait_rounds(3)
            wall.pass_ns(round(seconds * NS_PER_S))
            run.wait_rounds(3)

        run.join, run.later = join, later
        yield run, [join(robot) for robot in (ways if come is None else come)]


# ---- repeatability ----


@pytest.mark.slow
@pytest.mark.parametrize("thinking", cases(["fixed:2", "none"]))
def test_order_in_real_time_does_not_matter(thinking: str) -> None:
    ends = set()
    for order in ((0, 1), (1, 0)):
        for leaving in ((0, 1), (1, 0)):
            with clients(thinking=thinking) as (run, programs):
                for command in (b"D,5,5\n", b"N\n", b"D,1,-3\r\n", b"\n\nO\n", b"K\n"):
                    for index in order:
                        programs[index].send(command)
                        run.wait_rounds(2)
                    for index in order:
                        programs[index].lines.readline()
                # Complete commands act even if the program does not wait for their replies.
                programs[0].send(b"D,9,9\nN\nG,1,1\nH")
                run.wait_rounds(2)
                for index in leaving:
                    programs[index].hang_up()
                    run.wait_rounds(2)
                for robot in (1, 2):
                    run.wait_free(robot)
                ends.add((run.sim.now_ns, run.sim.state_hash()))
    assert len(ends) == 1


def test_world_waits_for_a_program_that_thinks() -> None:
    with clients(thinking="fixed:1") as (run, (one, two)):
        one.send(b"H\n")
        run.wait_rounds(5)
        assert one.has_no_reply()
        assert run.sim.now_ns == 0
        assert two.ask(b"H\n") == b"h,0,0\r\n"
        assert one.lines.readline() == b"h,0,0\r\n"


def test_later_programs_begin_together_again() -> None:
    with clients() as (run, programs):
        for program in programs:
            program.send(b"D,3,3\n")
        for index, program in enumerate(programs):
            assert program.lines.readline() == b"d\r\n"
            program.hang_up()
            run.wait_free(index + 1)
        now_ns = run.sim.now_ns
        again = run.join(1, b"H\n")
        run.wait_rounds(5)
        assert again.has_no_reply()
        assert run.sim.now_ns == now_ns
        assert run.join(2).ask(b"H\n").startswith(b"h,")
        assert again.lines.readline().startswith(b"h,")


# ---- programs that are missing, hang, die or flood ----


def test_world_begins_without_a_missing_program_after_a_warning(caplog: pytest.LogCaptureFixture) -> None:
    with clients(3, come=[1]) as (run, (one,)):
        one.send(b"H\n")
        run.wait_rounds(3)
        assert not warnings(caplog)
        run.later(1.5)
        (waits,) = warnings(caplog)
        assert waits == "the world begins when 3 programs are there. Missing: that of robot 2 or 3. It waits 8 s more."
        assert one.has_no_reply()
        run.later(9)
        assert one.lines.readline() == b"h,0,0\r\n"
        assert warnings(caplog)[1:] == [
            "the world has begun without that of robot 2 or 3, which did not come within 10 s. A program that "
            "comes now acts from now on, and the run is not repeatable."
        ]
        late = run.join(3, b"H\n")
        assert one.ask(b"B\n").startswith(b"b,")
        assert late.lines.readline() == b"h,0,0\r\n"


def test_policy_wait_has_no_time_limit_for_a_missing_program(caplog: pytest.LogCaptureFixture) -> None:
    with clients(come=[1], when_silent="wait") as (run, (one,)):
        one.send(b"H\n")
        run.later(1.5)
        assert warnings(caplog) == [
            "the world begins when 2 programs are there. Missing: that of robot 2. It waits until all are there."
        ]
        run.later(1000)
        assert one.has_no_reply()
        assert run.join(2).ask(b"B\n").startswith(b"b,")
        assert one.lines.readline() == b"h,0,0\r\n"
        assert len(warnings(caplog)) == 1


def test_program_that_disconnects_before_the_start_does_not_count() -> None:
    with clients(come=[]) as (run, _):
        for _ in range(2):
            run.join(1).hang_up()
            run.wait_free(1)
        one = run.join(1, b"H\n")
        run.wait_rounds(5)
        assert one.has_no_reply()
        assert run.join(2).ask(b"H\n") == one.lines.readline() == b"h,0,0\r\n"


def test_remaining_commands_act_before_the_next_client() -> None:
    with clients() as (run, (one, two)):
        one.send(b"G,1,2\nN\nG,3,4\nG,5")
        run.wait_rounds(3)
        one.hang_up()
        run.wait_rounds(3)
        again = run.join(1, b"H\n")
        run.wait_rounds(3)
        assert again.has_no_reply()
        # The wall clock stands still: the world waits for the other program.
        assert run.sim.now_ns == 0
        for _ in range(9):
            two.send(b"B\n")
            run.wait_rounds(2)
        assert again.lines.readline() == b"h,3,4\r\n"


def test_fewer_programs_than_robots_may_begin() -> None:
    with clients(come=[2], programs=1) as (_, (one,)):
        assert one.ask(b"H\n") == b"h,0,0\r\n"


def test_silent_program_is_ignored_until_it_reconnects(caplog: pytest.LogCaptureFixture) -> None:
    with clients() as (run, (one, mute)):
        one.send(b"H\n")
        run.later(1.9)
        assert one.has_no_reply()
        run.later(0.2)
        assert one.lines.readline() == b"h,0,0\r\n"
        for _ in range(50):
            assert one.ask(b"N\n").startswith(b"n,")
        assert warnings(caplog) == [
            "the client of robot 2 must act while others wait, but it did nothing for 2.1 s: from now on the world "
            "does not wait for it, and the run is not repeatable. --patience gives it more time, --when-silent wait "
            "all it wants."
        ]
        # It is a program like any other, but the world does not wait for it.
        mute.send(b"B\n")
        run.wait_rounds(3)
        assert one.ask(b"N\n").startswith(b"n,")
        assert mute.lines.readline() == b"b,5.02,5.01\r\n"
        mute.hang_up()
        run.wait_free(2)
        again = run.join(2)
        one.send(b"H\n")
        run.wait_rounds(3)
        assert one.has_no_reply()
        assert again.ask(b"H\n") == b"h,0,0\r\n"


def test_policy_wait_waits_for_a_silent_program_with_a_warning(caplog: pytest.LogCaptureFixture) -> None:
    with clients(when_silent="wait", patience_s=5) as (run, (one, mute)):
        one.send(b"H\n")
        for _ in range(3):
            run.later(5.5)
        assert one.has_no_reply()
        assert warnings(caplog) == [
            "the world waits for the client of robot 2: it has done nothing for 5.5 s while others wait. Continue it, "
            "or end it."
        ]
        assert mute.ask(b"H\n") == b"h,0,0\r\n"
        assert one.lines.readline() == b"h,0,0\r\n"


def test_silent_program_is_dropped(caplog: pytest.LogCaptureFixture) -> None:
    with clients(when_silent="drop") as (run, (one, mute)):
        one.send(b"H\n")
        run.later(2.5)
        assert one.lines.readline() == b"h,0,0\r\n"
        assert mute.lines.readline() == b""
        assert one.ask(b"H\n") == b"h,0,0\r\n"
        assert warnings(caplog) == [
            "the client of robot 2 must act within 2 s while others wait, but it did not: it is disconnected. "
            "--patience gives it more time."
        ]
        run.wait_free(2)


def test_program_with_four_ports_costs_one_patience() -> None:
    with clients(4) as (run, ports):
        ports[0].send(b"H\n")
        run.later(2)
        assert ports[0].lines.readline() == b"h,0,0\r\n"
        ports[1].send(b"H\n")
        run.later(0.2)
        assert ports[1].lines.readline() == b"h,0,0\r\n"
        # The clock stands still: no patience is needed from here on.
        for _ in range(10):
            for port in ports:
                assert port.ask(b"N\n").startswith(b"n,")


@pytest.mark.slow
@pytest.mark.parametrize("thinking", ["none", "live"])
def test_dead_client_does_not_delay_others(thinking: str, caplog: pytest.LogCaptureFixture) -> None:
    with clients(thinking=thinking) as (run, (one, dying)):
        dying.send(b"L,0,1\nH")
        one.send(b"H\n")
        run.later(1)
        assert one.lines.readline() == b"h,0,0\r\n"
        dying.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        dying.close()
        run.wait_free(2)
        for _ in range(20):
            one.send(b"H\n")
            run.later(0.1)
            assert one.lines.readline() == b"h,0,0\r\n"
        assert run.sim.world.state.robots["led"][0, 1, 0] == 1
        assert not warnings(caplog)


@contextmanager
def flooding(client: Client, data: bytes) -> Iterator[list[int]]:
    """Send the same data repeatedly and never read; yield a list whose one item is the number of characters sent."""
    sent, is_over = [0], threading.Event()

    def send() -> None:
        with suppress(OSError):
            while not is_over.is_set():
                sent[0] += client.socket.send(data * (READ_SIZE // len(data)))

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield sent
    finally:
        is_over.set()
        client.socket.shutdown(socket.SHUT_RDWR)
        thread.join(GUARD_S)


@pytest.mark.slow
@pytest.mark.parametrize("thinking", ["none", "live"])
@pytest.mark.parametrize("data", [b"H\n", b"x", b"\n", b"\r\n"])
def test_flooding_client_does_not_delay_others(thinking: str, data: bytes, caplog: pytest.LogCaptureFixture) -> None:
    with clients(thinking=thinking) as (run, (one, flooder)), flooding(flooder, data) as sent:
        exchanges = 0
        while exchanges < 40 or sent[0] < 4 * BACKLOG_LIMIT:
            one.send(b"N\n")
            if thinking == "live":
                run.later(0.1)
            assert one.lines.readline().startswith(b"n,")
            exchanges += 1
        run.wait_for(lambda: warnings(caplog))
        run.wait_rounds(3)
        assert warnings(caplog) == [
            f"the client of {run.server._endpoints[2][0].name} must wait for its replies, but it is more than "
            f"{BACKLOG_LIMIT - 1} characters ahead of its robot; what it sends now has to wait. Read a line after each "
            "command."
        ]
        line = run.sim.wires[1].line
        assert line.sending_until_ns - run.sim.now_ns < 3 * BACKLOG_LIMIT * line.character_ns
        assert len(run.sim.wires[1].pending) <= BACKLOG_LIMIT


def test_options_are_checked() -> None:
    options: dict[str, Any]
    for options, words in (
        ({"patience_s": 0}, "patience must be a number of seconds above 0 and up to 86400, but it was 0"),
        ({"programs": 3}, "programs must be a whole number from 1 to 2, the number of robots, but it was 3"),
    ):
        with pytest.raises(ParameterError, match=words):
            Server(fresh(2), {1: [], 2: []}, thinking="none", **options)

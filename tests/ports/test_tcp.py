import socket
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
import serial
from tests.ports.helpers import ask_socket, connect, live, warnings
from tests.served import GUARD_S, served

from kiks.clock.serial_timing import OUTPUT_LIMIT
from kiks.errors import LinkError, ParameterError
from kiks.ports.rfc2217 import Rfc2217Endpoint
from kiks.ports.tcp import TcpChannel, TcpEndpoint
from kiks.units import NS_PER_S, character_ns


def test_live_reply_comes_with_its_last_character_and_those_of_several_commands_one_by_one() -> None:
    with live() as (run, endpoint, wall), connect(endpoint) as client:
        client.sendall(b"H\nE\n")
        run.wait_for(lambda: run.sim.wires[0].pending)
        # Two characters, 1 ms in the robot, and seven characters of each reply.
        wall.pass_ns(9 * character_ns(9600) + 1_000_000 - 1)
        run.wait_rounds(3)
        client.setblocking(False)
        for reply in (b"h,0,0\r\n", b"e,0,0\r\n"):
            with pytest.raises(BlockingIOError):
                client.recv(4096)
            wall.pass_ns(1)
            run.wait_for(lambda: run.sim.wires[0].line.reply_end_ns != run.sim.now_ns)
            client.settimeout(GUARD_S)
            assert client.recv(4096) == reply
            client.setblocking(False)
            wall.pass_ns(7 * character_ns(9600) - 1)
            run.wait_rounds(3)


@pytest.mark.parametrize("kind", [partial(TcpEndpoint, by_character=True), Rfc2217Endpoint])
def test_live_characters_come_one_by_one_where_a_client_expects_a_serial_line(kind: Callable[[int], Any]) -> None:
    with live(kind(0)) as (run, endpoint, wall), connect(endpoint) as client:
        client.sendall(b"H\n")
        run.wait_for(lambda: run.sim.wires[0].pending)
        wall.pass_ns(6 * character_ns(9600) + 1_000_000)
        received = b""
        while not received.endswith(b"h,0,"):
            received += client.recv(1)
        run.wait_rounds(3)
        client.setblocking(False)
        with pytest.raises(BlockingIOError):
            client.recv(1)


def test_live_reply_of_a_client_that_hangs_up_in_its_middle_reaches_no_other_client() -> None:
    with live() as (run, endpoint, wall):
        with connect(endpoint) as client:
            client.sendall(b"N\n")
            run.wait_for(lambda: run.sim.wires[0].pending)
            wall.pass_ns(6 * character_ns(9600) + 1_000_000)
            run.wait_rounds(3)
        run.wait_free()
        with connect(endpoint) as client:
            client.sendall(b"H\n")
            run.wait_for(lambda: run.sim.wires[0].pending)
            wall.pass_ns(NS_PER_S)
            assert client.recv(4096) == b"h,0,0\r\n"


def test_unread_output_is_limited_and_logged(caplog: pytest.LogCaptureFixture) -> None:
    here, there = socket.socketpair()
    here.setblocking(False)
    endpoint = TcpEndpoint(0)
    channel = TcpChannel(here, endpoint)
    for _ in range(OUTPUT_LIMIT // 1000 + 2000):
        channel.write(b"x" * 1000)
    assert channel.has_unsent
    assert len(channel._unsent) <= OUTPUT_LIMIT
    assert warnings(caplog) == [
        f"the client of {endpoint.name} must read its replies, but {len(channel._unsent)} characters wait for it; "
        "the rest is lost. Read a line after each command."
    ]
    there.close()
    channel.flush()
    assert len(channel._unsent) == 0
    assert channel.read() is None
    channel.close()
    endpoint.close()


def test_client_that_does_not_read_gets_all_its_replies_later() -> None:
    ways = {1: [TcpEndpoint(0)], 2: [TcpEndpoint(0)]}
    with served(ways) as run, connect(ways[1][0]) as mute, connect(ways[2][0]) as other:
        mute.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        mute.sendall(b"N\n" * 3000)
        assert ask_socket(other, b"H\n") == b"h,0,0\r\n"
        mute.sendall(b"H\n")
        with mute.makefile("rb") as replies:
            assert {replies.readline()[:2] for _ in range(3000)} == {b"n,"}
            assert replies.readline() == b"h,0,0\r\n"
        assert run.sim.wires[0].line.lost_count == 0


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.5", "::", "example.com"])
def test_host_must_be_a_loopback_address(host: str) -> None:
    words = r"host must be an address that only this computer reaches, but it was .*Use 127"
    with pytest.raises(LinkError, match=words):
        TcpEndpoint(0, host=host)


def test_port_must_be_valid_and_free() -> None:
    endpoint = TcpEndpoint(0)
    with pytest.raises(LinkError, match=rf"port {endpoint.port} of 127\.0\.0\.1 must be free, but it is not \(Address"):
        TcpEndpoint(endpoint.port)
    endpoint.close()
    with pytest.raises(ParameterError, match=r"port must be a whole number from 0 to 65535, but it was 65536"):
        TcpEndpoint(65536)


def test_speed_purge_and_control_lines() -> None:
    endpoint = Rfc2217Endpoint(0)
    with served([endpoint]) as run:
        port = serial.serial_for_url(f"rfc2217://{endpoint.name}", baudrate=19200, timeout=GUARD_S)
        assert run.sim.wires[0].line.baud == 19200
        port.write(b"H\n")
        assert port.readline() == b"h,0,0\r\n"
        port.baudrate = 38400
        port.dtr = False
        port.rts = False
        port.stopbits = 2
        port.reset_input_buffer()
        port.reset_output_buffer()
        assert (port.cts, port.dsr, port.cd, port.ri) == (True, True, True, False)
        port.write(b"H\xff\n")  # a character that telnet escapes
        assert port.readline() == b"Command not found\r\n"
        assert run.sim.wires[0].line.baud == 38400
        port.close()
        run.wait_free()


@pytest.mark.parametrize("nonsense", [b"\xff\xf0", b"\xff\xfa\x2c\x01\xff\xf0", b"\xff\xfa" + b"x" * 10_000])
def test_client_that_violates_the_protocol_is_disconnected(nonsense: bytes) -> None:
    endpoint = Rfc2217Endpoint(0)
    with served([endpoint]) as run:
        with connect(endpoint) as client:
            run.wait_held()
            client.sendall(nonsense)
            run.wait_free()
        with serial.serial_for_url(f"rfc2217://{endpoint.name}", timeout=GUARD_S) as port:
            port.write(b"H\n")
            assert port.readline() == b"h,0,0\r\n"

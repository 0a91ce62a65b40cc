from __future__ import annotations

import socket

import pytest
import serial
from tests.served import GUARD_S, served

from kiks.ports.rfc2217 import Rfc2217Endpoint


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
        assert port.cts
        assert port.dsr
        assert port.cd
        assert not port.ri
        port.write(b"H\xff\n")  # a character that telnet escapes
        assert port.readline() == b"Command not found\r\n"
        assert run.sim.wires[0].line.baud == 38400
        port.close()
        run.wait_free()


@pytest.mark.parametrize("nonsense", [b"\xff\xf0", b"\xff\xfa\x2c\x01\xff\xf0", b"\xff\xfa" + b"x" * 10_000])
def test_client_that_violates_the_protocol_is_disconnected(nonsense: bytes) -> None:
    endpoint = Rfc2217Endpoint(0)
    with served([endpoint]) as run:
        client = socket.create_connection(("127.0.0.1", endpoint.port), timeout=GUARD_S)
        run.wait_held()
        client.sendall(nonsense)
        run.wait_free()
        client.close()
        with serial.serial_for_url(f"rfc2217://{endpoint.name}", timeout=GUARD_S) as port:
            port.write(b"H\n")
            assert port.readline() == b"h,0,0\r\n"

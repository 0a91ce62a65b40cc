"""The transcripts of tests/sessions give the same bytes over every kind of port."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import serial
from tests import forked
from tests.served import GUARD_S, PROGRAMS, fresh, run_python, served
from tests.session_player import Pieces, Session, play, sessions, simulation

from kiks.ports.pty import PtyEndpoint
from kiks.ports.rfc2217 import Rfc2217Endpoint
from kiks.ports.tcp import TcpEndpoint
from kiks.sim.simulation import Simulation

# Each session is played over five kinds of ports; tests/firmware/test_sessions.py plays them in memory.
pytestmark = pytest.mark.slow


@contextmanager
def by_name(sim: Simulation, folder: Path) -> Iterator[Any]:
    with serial.serial_for_url(sim.url(1), 9600, timeout=GUARD_S) as port:
        yield port


@contextmanager
def over_pty(sim: Simulation, folder: Path) -> Iterator[Any]:
    endpoint = PtyEndpoint(folder / "khepera")
    with served([endpoint], sim=sim), serial.Serial(str(folder / "khepera"), 9600, timeout=GUARD_S) as port:
        yield port


@contextmanager
def over_tcp(sim: Simulation, folder: Path) -> Iterator[Any]:
    endpoint = TcpEndpoint(0)
    with served([endpoint], sim=sim), serial.serial_for_url(f"socket://{endpoint.name}", timeout=GUARD_S) as port:
        yield port


@contextmanager
def over_rfc2217(sim: Simulation, folder: Path) -> Iterator[Any]:
    endpoint = Rfc2217Endpoint(0)
    with served([endpoint], sim=sim), serial.serial_for_url(f"rfc2217://{endpoint.name}", timeout=GUARD_S) as port:
        yield port


@pytest.mark.parametrize("pieces", ["lines", "one write"])
@pytest.mark.parametrize("way", [by_name, over_pty, over_tcp, over_rfc2217], ids=lambda way: way.__name__)
@pytest.mark.parametrize("session", sessions(), ids=lambda session: session.name)
def test_session(session: Session, way: Callable[..., Any], pieces: Pieces, tmp_path: Path) -> None:
    sim = simulation(session)

    def wait(seconds: float) -> None:
        with sim.lock:
            sim.run(seconds)

    with way(sim, tmp_path) as port:
        play(port, session, wait=wait, pieces=pieces)


def test_the_course_is_the_same_under_kiks_run_and_through_a_serial_port(tmp_path: Path) -> None:
    (tmp_path / "box.toml").write_text("size_mm = [600, 600]\n")
    course = PROGRAMS / "course.py"
    here = forked.run("run", "--arena", str(tmp_path / "box.toml"), "--seed", "7", str(course), "/dev/ttyUSB0")
    assert here.returncode == 0, here.stderr
    with served([PtyEndpoint(tmp_path / "khepera")], sim=fresh()) as run:
        through_pty = run_python(course, str(tmp_path / "khepera"))
        run.wait_free()
        assert f"state {run.sim.state_hash()}" in here.stderr
    assert here.stdout == through_pty

"""The transcripts of tests/sessions give the same bytes over every kind of port."""

from contextlib import ExitStack
from itertools import product
from pathlib import Path
from typing import Any

import pytest
import serial
from tests import forked
from tests.at_length import at_length
from tests.served import GUARD_S, PROGRAMS, fresh, run_python, served
from tests.session_player import FOLDER, Pieces, load, play, simulation

from kiks.ports.pty import PtyEndpoint
from kiks.ports.rfc2217 import Rfc2217Endpoint
from kiks.ports.tcp import TcpEndpoint

# Each session is played over four kinds of ports; tests/firmware/test_sessions.py plays them in memory.
pytestmark = pytest.mark.slow

KINDS: dict[str, Any] = {"": PtyEndpoint, "socket://": TcpEndpoint, "rfc2217://": Rfc2217Endpoint, "kiks://": None}
WAYS = list(product(KINDS, ("lines", "one write")))
CASES = [
    pytest.param(
        path, *way, id=f"{path.stem} {' '.join(way)}", marks=() if (row - column) % len(WAYS) == 0 else at_length
    )
    for row, path in enumerate(sorted(FOLDER.glob("*.txt")))
    for column, way in enumerate(WAYS)
]
"""`make test` plays each session in one way, and in each way some session."""


@pytest.mark.parametrize(("path", "scheme", "pieces"), CASES)
def test_session(path: Path, scheme: str, pieces: Pieces, tmp_path: Path) -> None:
    session = load(path)
    sim = simulation(session)

    def wait(seconds: float) -> None:
        with sim.lock:
            sim.run(seconds)

    with ExitStack() as stack:
        url = sim.url(1)
        if kind := KINDS[scheme]:
            endpoint = kind(tmp_path / "khepera" if kind is PtyEndpoint else 0)
            stack.enter_context(served([endpoint], sim=sim))
            url = f"{scheme}{endpoint.name}"
        port = stack.enter_context(serial.serial_for_url(url, 9600, timeout=GUARD_S))
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

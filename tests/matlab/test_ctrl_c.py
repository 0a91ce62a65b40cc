"""Ctrl-C at Octave's prompt: it interrupts all waits, leaves nothing behind, and later answers are in step."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.matlab.octave import GUARD_S, needs_octave
from tests.matlab.terminal import Terminal, processor_ticks, state

from kiks.toolbox.framing import HANDSHAKE_S

pytestmark = [needs_octave, pytest.mark.slow]

MOMENTS = (0, 5, 15, 30, 60, 120)
"""When the start of a session is interrupted [ticks of its own processor time]: the same on a busy computer."""


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    with Terminal(tmp_path, {"KIKS_COMMAND": f"{sys.executable} -m kiks"}) as each:
        yield each


def begin(terminal: Terminal, *lines: str) -> None:
    """Type lines, and wait until they are done."""
    for line in lines:
        terminal.type(line)
    terminal.type("disp(['ready', ' now'])")
    terminal.wait_for("ready now")


def interrupt(terminal: Terminal, line: str) -> None:
    """Type a line that never ends, and press Ctrl-C while the session works on it."""
    (session,) = terminal.sessions()
    terminal.type(f"disp(['begins', ' now']), {line}, disp(['ends', ' now'])")
    terminal.wait_for("begins now")
    # Press Ctrl-C while Octave waits.
    wait_until(lambda: state(terminal.number) == "S")
    terminal.press_ctrl_c()
    assert terminal.ask("7") == "7", "the prompt is back"
    assert session in terminal.sessions()


def wait_until(fact: object, seconds: float = GUARD_S) -> None:
    """Poll a condition until it is true."""
    assert callable(fact)
    end_s = time.monotonic() + seconds
    while not fact():
        assert time.monotonic() < end_s, "it never was so"


def test_an_interrupted_start_leaves_no_process(terminal: Terminal) -> None:
    for moment in MOMENTS:
        terminal.type("disp(['begins', ' now']), kiks(), disp(['ends', ' now'])")
        terminal.wait_for("begins now")
        wait_until(terminal.sessions)
        session = terminal.sessions()[-1]
        wait_until(lambda: processor_ticks(session) >= moment or terminal.has_printed("ends now"))  # noqa: B023
        terminal.press_ctrl_c()
        assert terminal.ask("7") == "7"
        begin(terminal, "kiks_quit(1)")
    wait_until(lambda: not terminal.sessions(), HANDSHAKE_S + GUARD_S)
    assert list(terminal.doors.glob("kiks/*")) == []
    begin(terminal, "kiks(), ref = kiks_kopen([-1 9600 1]);")
    assert terminal.ask("numel(kProximity(ref))") == "8"


def test_an_interrupted_pause_stops_time(terminal: Terminal) -> None:
    begin(terminal, "kiks(), ref = kiks_kopen([-1 9600 1]);")
    interrupt(terminal, "kiks_pause(1e6)")
    time_s = float(terminal.ask("kiks_ktime(-1)"))
    assert 0 < time_s < 1e6
    assert float(terminal.ask("kiks_ktime(-1)")) == pytest.approx(time_s, abs=0.1)
    assert terminal.ask("numel(kProximity(ref))") == "8"


def test_waiting_for_another_program_is_interrupted(terminal: Terminal) -> None:
    begin(terminal, "global KIKS_PROGRAMS, KIKS_PROGRAMS = 2;", "kiks()")
    interrupt(terminal, "ref = kiks_kopen([-1 9600 1]), kProximity(ref)")
    begin(terminal, "kiks_quit(1)", "KIKS_PROGRAMS = 1;", "kiks(), ref = kiks_kopen([-1 9600 1]);")
    assert terminal.ask("numel(kProximity(ref))") == "8"


def test_answers_of_any_length_stay_in_step(terminal: Terminal) -> None:
    """The path grows, so its answers are read in two pieces; Ctrl-C may come between them."""
    begin(terminal, "kiks(), ref = kiks_kopen([-1 9600 1]); kSetSpeed(ref, 5, 2); kiks_pause(200)")
    for _ in range(20):
        terminal.type("disp(['begins', ' now']), while true, kiks_siminfo_robotpath; kProximity(ref); end")
        terminal.wait_for("begins now")
        terminal.press_ctrl_c()
        assert terminal.ask("numel(kProximity(ref))") == "8"
        assert terminal.ask("rows(kiks_siminfo_robotpath)") == "2"
        assert terminal.ask("numel(kiks_siminfo_robotpos)") == "3"


def test_another_child_of_octave_does_not_keep_a_session_alive(terminal: Terminal) -> None:
    """It inherits the ends of the session's pipes: neither kiks_quit nor the end of Octave shows there."""
    begin(terminal, "kiks()")
    (first,) = terminal.sessions()
    begin(terminal, "[to, from, other] = popen2('sleep', {'300'}, true);")
    begin(terminal, "kiks_quit(1)")
    wait_until(lambda: first not in terminal.sessions())
    begin(terminal, "kiks()")
    second = next(number for number in terminal.sessions() if number != int(terminal.ask("other")))
    begin(terminal, "[to, from, another] = popen2('sleep', {'300'}, true);")
    others = [int(terminal.ask("other")), int(terminal.ask("another"))]
    try:
        terminal.kill()
        wait_until(lambda: state(second) == "Z")
    finally:
        for other in others:
            os.kill(other, 9)

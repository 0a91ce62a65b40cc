"""Ctrl-C at Octave's prompt: it interrupts all waits, leaves nothing behind, and later answers are in step."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.at_length import AT_LENGTH, at_length, share
from tests.forked import kiks_command
from tests.guard import wait_until
from tests.matlab.octave import has_ended, needs_octave
from tests.matlab.terminal import Terminal, processor_ticks, state

pytestmark = [needs_octave, pytest.mark.slow]

MOMENTS = share((60,), (0, 5, 15, 30, 120, 60))
"""When the start of a session is interrupted [ticks of its own processor time]: the same on a busy computer."""


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    with Terminal(tmp_path) as each:
        yield each


@pytest.fixture
def forking(tmp_path: Path) -> Iterator[Terminal]:
    """A terminal whose sessions are forks (tests/forked.py), which start fast."""
    with Terminal(tmp_path, {"KIKS_COMMAND": " ".join(kiks_command())}) as each:
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


@at_length
def test_an_interrupted_start_leaves_no_process(terminal: Terminal) -> None:
    sessions = []
    for moment in MOMENTS:
        terminal.type("disp(['begins', ' now']), kiks(), disp(['ends', ' now'])")
        terminal.wait_for("begins now")
        wait_until(terminal.sessions)
        session = terminal.sessions()[-1]
        sessions.append(os.pidfd_open(session))
        wait_until(lambda: processor_ticks(session) >= moment or terminal.has_printed("ends now"))  # noqa: B023
        terminal.press_ctrl_c()
        assert terminal.ask("7") == "7"
        begin(terminal, "kiks_quit(1)")
    # The next start ends an interrupted one, which else waits for its first request.
    if AT_LENGTH:
        assert has_ended(sessions.pop())
    begin(terminal, "kiks(), ref = kiks_kopen([-1 9600 1]);")
    assert terminal.ask("numel(kProximity(ref))") == "8"
    assert all(has_ended(session) for session in sessions)
    begin(terminal, "kiks_quit(1)")
    assert list(terminal.doors.glob("kiks/*")) == []


def test_an_interrupted_pause_stops_time(terminal: Terminal) -> None:
    begin(terminal, "kiks(), ref = kiks_kopen([-1 9600 1]);")
    interrupt(terminal, "kiks_pause(1e6)")
    time_s = float(terminal.ask("kiks_ktime(-1)"))
    assert 0 < time_s < 1e6
    assert float(terminal.ask("kiks_ktime(-1)")) == pytest.approx(time_s, abs=0.1)
    assert terminal.ask("numel(kProximity(ref))") == "8"


def test_waiting_for_another_program_is_interrupted(forking: Terminal) -> None:
    begin(forking, "global KIKS_PROGRAMS, KIKS_PROGRAMS = 2;", "kiks()")
    interrupt(forking, "ref = kiks_kopen([-1 9600 1]), kProximity(ref)")
    begin(forking, "kiks_quit(1)", "KIKS_PROGRAMS = 1;", "kiks(), ref = kiks_kopen([-1 9600 1]);")
    assert forking.ask("numel(kProximity(ref))") == "8"


def test_answers_of_any_length_stay_in_step(forking: Terminal) -> None:
    """The path grows, so its answers are read in two pieces; Ctrl-C may come between them."""
    begin(forking, "kiks(), ref = kiks_kopen([-1 9600 1]); kSetSpeed(ref, 5, 2); kiks_pause(200)")
    for _ in range(share(5, 20)):
        forking.type("disp(['begins', ' now']), while true, kiks_siminfo_robotpath; kProximity(ref); end")
        forking.wait_for("begins now")
        forking.press_ctrl_c()
        assert forking.ask("numel(kProximity(ref))") == "8"
        assert forking.ask("rows(kiks_siminfo_robotpath)") == "2"
        assert forking.ask("numel(kiks_siminfo_robotpos)") == "3"


@at_length
def test_another_child_of_octave_does_not_keep_a_session_alive(terminal: Terminal) -> None:
    """It inherits the ends of the session's pipes: neither kiks_quit nor the end of Octave shows there."""
    begin(terminal, "kiks()")
    first = os.pidfd_open(terminal.sessions()[0])
    begin(terminal, "[to, from, other] = popen2('sleep', {'300'}, true);")
    begin(terminal, "kiks_quit(1)")
    assert has_ended(first)
    begin(terminal, "kiks()")
    second = next(number for number in terminal.sessions() if number != int(terminal.ask("other")))
    begin(terminal, "[to, from, another] = popen2('sleep', {'300'}, true);")
    session = os.pidfd_open(second)
    others = [int(terminal.ask("other")), int(terminal.ask("another"))]
    try:
        terminal.kill()
        assert has_ended(session)
    finally:
        for other in others:
            os.kill(other, 9)

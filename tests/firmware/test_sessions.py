"""The transcripts of tests/sessions, over the port in memory."""

import re

import pytest
from tests.session_player import FOLDER, Pieces, Session, Step, play, sessions, simulation


@pytest.mark.slow
@pytest.mark.parametrize("pieces", ["lines", "bytes", "one write"])
def test_sessions_in_memory(pieces: Pieces) -> None:
    for session in sessions():
        sim = simulation(session)
        port = sim.port(1)
        port.timeout = 1.0
        clock = None if pieces == "one write" else lambda sim=sim: sim.time_s
        play(port, session, wait=port.sleep, pieces=pieces, clock=clock)


def test_all_thirty_vectors_are_there() -> None:
    text = "".join(path.read_text(encoding="ascii") for path in sorted(FOLDER.glob("vectors*.txt")))
    assert sorted(map(int, re.findall(r"^# vector (\d+)", text, re.MULTILINE))) == list(range(1, 31))


def test_every_wrong_reply_is_noticed() -> None:
    right = Session("right", (Step(1, ">", r"H\n"), Step(2, "<", "h,0,0"), Step(3, "=", "13.604163")))
    wrong = (
        Session("wrong", (*right.steps[:1], Step(2, "<", "h,0,1"))),
        Session("missing", (*right.steps, Step(4, "<", "h,0,0"))),
        Session("too many", right.steps[:1]),
        Session("late", (*right.steps[:2], Step(3, "=", "13.5"))),
        Session("half", (*right.steps[:1], Step(2, "~", "h"))),
    )
    for session in wrong:
        port = simulation(session).port(1)
        port.timeout = 1.0
        with pytest.raises(AssertionError, match=f"session '{session.name}'"):
            play(port, session, wait=port.sleep, clock=lambda port=port: port.sim.time_s)

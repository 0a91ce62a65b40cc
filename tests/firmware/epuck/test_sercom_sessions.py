"""The transcripts of e-pucks: every command of every personality, the rules of the line, and the ways of clients."""

import re

import pytest
from tests.firmware.epuck.sercom_line import VERSIONS, SercomSession, sessions

from kiks.firmware.epuck.commands import COMMANDS
from kiks.firmware.epuck.personality import PERSONALITIES
from kiks.firmware.epuck.requests import REQUESTS

ALL = sessions()


@pytest.mark.parametrize("pieces", ["lines", "bytes", "one write"])
@pytest.mark.parametrize("session", ALL, ids=lambda session: session.name)
def test_a_session(session: SercomSession, pieces: str) -> None:
    assert session.versions
    for version in session.versions:
        session.play(version, pieces)


@pytest.mark.parametrize("version", VERSIONS)
def test_every_command_and_request_is_in_a_session(version: str) -> None:
    played = [step[2] for session in ALL if version in session.versions for step in session.steps if step[1] == ">"]
    text = "\n".join(played)
    letter = PERSONALITIES[version].letter
    # H has tests of its own.
    lines = {row.letter for row in COMMANDS if letter in row.within} - {"H"}
    assert not {each for each in lines if not re.search(rf"(^|\\n|\\r){each}[,\\]", text, re.MULTILINE)}
    requests = {row.code for row in REQUESTS if letter in row.within} - {0xAB}
    assert not {hex(code) for code in requests if rf"\x{code:02x}" not in text}


def test_every_wrong_reply_is_noticed() -> None:
    right = ((1, ">", r"E\n"), (2, "<", r"e,0,0\r\n"))
    for wrong in ((*right, (3, "<", "x")), right[:1], right[1:], (right[0], (2, "<", r"e,0,1\r\n"))):
        for pieces in ("lines", "bytes", "one write"):
            SercomSession("right", ("AS12",), right).play("AS12", pieces)
            with pytest.raises(AssertionError, match="session"):
                SercomSession("session", ("AS12",), wrong).play("AS12", pieces)

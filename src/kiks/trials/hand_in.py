"""What a student hands in: one ZIP file with the program, a run of it as a recording and as a page, and the score."""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, NamedTuple

from kiks.errors import ParameterError, shown
from kiks.model.limits import PROGRAM_BYTES_MAX
from kiks.trials.trial import Outcome
from kiks.version import __version__

PROGRAM, RECORDING, PAGE, SCORE = "program.py", "recording.mcap", "run.html", "score.json"
"""The files in it."""

HAND_IN_BYTES_MAX = 64 << 20
"""Most bytes of such a file."""

_UNREADABLE = (ValueError, KeyError, OSError, RuntimeError, EOFError, zlib.error)
_DATE = (1980, 1, 1, 0, 0, 0)  # the same content makes the same file


class Tried(NamedTuple):
    """A case in which a program was tried.

    Attributes:
        case: The name of the case.
        outcome: What came out.
    """

    case: str
    outcome: Outcome


def score_of(tried: Sequence[Tried]) -> dict[str, float]:
    """Return how a program has done in all cases: solved ones, all, and points in all."""
    points = round(sum(each.outcome.points for each in tried), 3)
    return {"solved": sum(each.outcome.is_solved for each in tried), "cases": len(tried), "points": points}


def packed(program: bytes, tried: Sequence[Tried], *, exercise: str, recording: bytes, page: bytes) -> bytes:
    """Return the file.

    Args:
        program: The program.
        tried: How it has done in the visible cases.
        exercise: Title of the exercise.
        recording: The recording of one of the runs.
        page: The page of that recording.

    Example:
        >>> data = packed(b"print(1)", [], exercise="To the lamp", recording=b"", page=b"")
        >>> program_of(data)
        b'print(1)'
    """
    cases = [
        {
            "case": case,
            "is_solved": outcome.is_solved,
            "points": outcome.points,
            "time_s": outcome.time_s,
            "programs": [asdict(each) for each in outcome.ends],
            "state": outcome.state,
        }
        for case, outcome in tried
    ]
    score: dict[str, Any] = {"kiks": __version__, "exercise": exercise, **score_of(tried), "each": cases}
    files = {
        PROGRAM: program,
        SCORE: json.dumps(score, indent=1).encode(),
        RECORDING: recording,
        PAGE: page,
    }
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name, _DATE), data, zipfile.ZIP_DEFLATED)
    return made.getvalue()


def program_of(data: bytes, what: str = "what was handed in") -> bytes:
    """Return the program in such a file, which a stranger may have made: no more is unpacked than a program may have.

    The score in it is what the student saw; whoever grades lets the program run again.

    Args:
        data: The file.
        what: What messages call it.

    Raises:
        ParameterError: If it is no such file.
    """
    try:
        if len(data) > HAND_IN_BYTES_MAX:
            raise ValueError(f"it has more than {HAND_IN_BYTES_MAX >> 20} MiB")
        with zipfile.ZipFile(io.BytesIO(data)) as archive, archive.open(PROGRAM) as file:
            program = file.read(PROGRAM_BYTES_MAX + 1)
        if len(program) > PROGRAM_BYTES_MAX:
            raise ValueError(f"its program has more than {PROGRAM_BYTES_MAX} bytes")
    except (*_UNREADABLE, zipfile.BadZipFile) as error:
        why = str(error.args[0] if error.args else error)
        raise ParameterError(
            f"{what} must be a file that the desk's 'Hand in' made, but: {shown(why)}. Hand it in again."
        ) from None
    return program

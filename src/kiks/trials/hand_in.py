"""What a student hands in: one ZIP file with the program, a run of it as a recording and as a page, and the score."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from typing import Any

PROGRAM, RECORDING, PAGE, SCORE = "program.py", "recording.mcap", "run.html", "score.json"
"""The files in it."""

HAND_IN_BYTES_MAX = 64 << 20
"""Most bytes of such a file."""

_DATE = (1980, 1, 1, 0, 0, 0)  # the same content makes the same file


def packed(program: bytes, score: Mapping[str, Any], *, recording: bytes = b"", page: bytes = b"") -> bytes:
    """Return the file; `kiks.trials.submissions` reads it. Its score is what the student saw: graders run the program.

    Args:
        program: The program.
        score: How it has done in the visible cases, for JSON.
        recording: The recording of one of the runs; none if left out.
        page: The page of that recording; none if left out.

    Example:
        >>> data = packed(b"print(1)", {"points": 3})
        >>> zipfile.ZipFile(io.BytesIO(data)).namelist()
        ['program.py', 'score.json']
    """
    files = {PROGRAM: program, SCORE: json.dumps(score, indent=1).encode()}
    files |= {name: data for name, data in ((RECORDING, recording), (PAGE, page)) if data}
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name, _DATE), data, zipfile.ZIP_DEFLATED)
    return made.getvalue()

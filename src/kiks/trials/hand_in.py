"""What a student hands in: one ZIP file with all files of the program, a run of it in two forms, and the score."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from kiks.errors import ParameterError

PROGRAM, RECORDING, PAGE, SCORE = "program.py", "recording.mcap", "run.html", "score.json"
"""The files in it, beside those that belong to the program; of Octave it is `program.m`, a notebook `program.ipynb`."""

OF_THE_RUN = (RECORDING, PAGE, SCORE)
"""Those of them that are no part of the program."""

HAND_IN_BYTES_MAX = 64 << 20
"""Most bytes of such a file."""

DATE = (1980, 1, 1, 0, 0, 0)
"""The date of what is in an archive, so that the same content makes the same file."""


def packed(
    program: Mapping[str, bytes], score: Mapping[str, Any], *, recording: bytes = b"", page: bytes = b""
) -> bytes:
    """Return the file; `kiks.trials.submissions` reads it. Its score is what the student saw: graders run the program.

    Args:
        program: The program's files by their names, the one that runs first (`ProgramFiles.pack`).
        score: How it has done in the visible cases, for JSON.
        recording: The recording of one of the runs; none if left out.
        page: The page of that recording; none if left out.

    Raises:
        ParameterError: If another file of the program has one of these names.

    Example:
        >>> data = packed({"drive.py": b"import speeds", "speeds.py": b""}, {"points": 3})
        >>> zipfile.ZipFile(io.BytesIO(data)).namelist()
        ['program.py', 'score.json', 'speeds.py']
    """
    main, *others = program.items()
    first = str(PurePosixPath(PROGRAM).with_suffix(PurePosixPath(main[0]).suffix.lower()))
    files = {first: main[1], SCORE: json.dumps(score, indent=1).encode()}
    files |= {name: data for name, data in ((RECORDING, recording), (PAGE, page)) if data}
    for name, data in others:
        if name in (first, *OF_THE_RUN):
            raise ParameterError(
                f"a file of a program that is handed in must not be called {name}, as a file of the run is. Rename it."
            )
        files[name] = data
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name, DATE), data, zipfile.ZIP_DEFLATED)
    return made.getvalue()


def has_run(file: Path) -> bool:
    """Return whether a file that was handed in has a run in it; it has none before its program was tried."""
    try:
        with zipfile.ZipFile(file) as archive:
            return RECORDING in archive.namelist()
    except (OSError, zipfile.BadZipFile):
        return False

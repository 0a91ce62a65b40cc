"""What figures and pages show of a recording, found while the run is made again once."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from kiks.export.pictures import Picture
from kiks.recording.analysis import Lines
from kiks.recording.recording import Recording
from kiks.recording.rerun import RunPiece, run_again, shared_with
from kiks.recording.tables import TABLES, Table, TableParts
from kiks.sim.wire_log import TimeShares


class Findings(NamedTuple):
    """What was found.

    Attributes:
        tables: The tables by name.
        shares: Where the time of each robot went.
        picture: The world at the end, with all paths.
    """

    tables: dict[str, Table]
    shares: list[TimeShares]
    picture: Picture


def gather_findings(recording: Recording, pieces: Iterable[RunPiece] | None = None) -> Findings:
    """Return what is found in a recording.

    Args:
        recording: The recording.
        pieces: Those of `run_again` from its beginning to its end, where something else needs them, too.
    """
    log = recording.log
    parts, lines = TableParts(TABLES), Lines(recording.robots)
    pieces = shared_with(run_again(log) if pieces is None else pieces, parts.add, lines.add)
    picture = Picture.of_recording(recording, log.end_ns, pieces)
    for _ in pieces:  # the picture may be finished before the last one
        pass
    return Findings(dict(zip(TABLES, parts.tables(log), strict=True)), lines.shares(log), picture)

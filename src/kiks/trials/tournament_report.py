"""Writes what is left of a tournament: `tournament.csv`, `games.csv` and `tournament.html`, which needs no network."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from kiks.errors import figure
from kiks.export.page import page_template
from kiks.model.atomic_files import replace_file
from kiks.table import Table
from kiks.trials.report_parts import page_parts, shown_runs
from kiks.trials.tournament import Standing, Tournament

PAGE = "tournament.html"
"""The page's name in the output folder."""

SHOWN_MAX, SHOWN_BYTES_MAX = 200, 20 << 20
"""Most games that the page plays, and most bytes of them; `kiks replay` plays the others."""

HEADS = ("player", "games", "won", "drawn", "lost", "score", "points", "rating", "failed")


def rows_of(tournament: Tournament) -> list[tuple[str, ...]]:
    """Return the cells of the table, the best player first, under `HEADS`."""
    return [_row(place, each) for place, each in enumerate(tournament.table, 1)]


def _row(place: int, each: Standing) -> tuple[str, ...]:
    counts = (str(each.played), str(each.won), str(each.drawn), str(each.lost))
    score = f"{each.scored:g}:{each.conceded:g}"
    rating = f"{each.rating:.1f}±{each.interval:.1f}"
    return (f"{place}. {each.name}", *counts, score, f"{each.share:.1%}", rating, str(each.failed or ""))


def results_of(tournament: Tournament, out: Path) -> dict[str, Any]:
    """Return table and games for JSON."""
    return {
        "match": tournament.title,
        "folder": str(out),
        "table": [vars(each) for each in tournament.table],
        "games": [
            {
                "round": each.game.round,
                "players": list(each.names),
                "seed": each.game.seed,
                "score": list(each.score),
                "points": list(each.shares),
                "failed": each.notes,
                "time_s": each.outcome.time_s,
                "state": each.outcome.state,
                "recording": each.outcome.recording,
            }
            for each in tournament.played
        ],
    }


def save_tournament(
    tournament: Tournament,
    out: Path,
    seconds: float,
    *,
    workers: int | None = None,
    on_progress: Callable[[int, int], object] = lambda done, count: None,
) -> None:
    """Write tables and page into the output folder.

    Args:
        tournament: The tournament.
        out: The folder, in which the recordings are.
        seconds: Time limit of a game [s of simulated time].
        workers: Processes that prepare the players of the page; one for each core if left out.
        on_progress: Called with how many are ready, and of how many.
    """
    table = [tuple(vars(each).values()) for each in tournament.table]
    replace_file(out / "tournament.csv", Table([*Standing.__dataclass_fields__], table).csv(), "the table")
    sides = len(tournament.played[0].names) if tournament.played else 2
    heads = [
        "round",
        "seed",
        *(f"player_{k}" for k in range(1, sides + 1)),
        *(f"score_{k}" for k in range(1, sides + 1)),
    ]
    games = [
        (each.game.round, each.game.seed, *each.names, *each.score, "; ".join(each.notes), each.outcome.recording)
        for each in tournament.played
    ]
    replace_file(out / "games.csv", Table([*heads, "failed", "recording"], games).csv(), "the games")
    recorded = [each.outcome for each in tournament.played if each.outcome.recording][:SHOWN_MAX]
    runs = shown_runs({each.name: out / each.recording for each in recorded}, workers, on_progress)
    left = SHOWN_BYTES_MAX
    for name, run in list(runs.items()):
        left -= sum(map(len, run.values()))
        if left < 0:
            del runs[name]
    text = page_template("tournament.html").render(
        tournament=tournament,
        figure=figure,
        heads=[head.capitalize() for head in HEADS],
        rows=rows_of(tournament),
        seconds=seconds,
        **page_parts(runs, out),
    )
    replace_file(out / PAGE, text.encode("utf-8", "replace"), "the page")

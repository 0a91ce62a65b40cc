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
from kiks.trials.tournament import Tournament

PAGE = "tournament.html"
"""The page's name in the output folder."""

SHOWN_MAX, SHOWN_BYTES_MAX = 200, 20 << 20
"""Most games that the page plays, and most bytes of them; `kiks replay` plays the others."""


def standings_table(tournament: Tournament) -> Table:
    """Return what a terminal and the page show of each player, the best first."""
    rows = []
    for place, each in enumerate(tournament.standings, 1):
        counts = (str(each[name]) for name in ("played", "won", "drawn", "lost"))
        score, rating = f"{each['scored']:g}:{each['conceded']:g}", f"{each['rating']:.1f}±{each['interval']:.1f}"
        rows.append((f"{place}. {each['name']}", *counts, score, f"{each['share']:.1%}", rating, each["failed"] or ""))
    return Table(("player", "games", "won", "drawn", "lost", "score", "points", "rating", "failed"), rows)


def _meetings_table(tournament: Tournament) -> Table:
    """Return what each player has won against each other one."""
    names = [each["name"] for each in tournament.standings]
    met = [[tournament.between(one, other) if one != other else None for other in names] for one in names]
    texts = [["" if won is None else f"{figure(won[0])} : {figure(won[1])}" for won in row] for row in met]
    return Table(("", *names), ((name, *row) for name, row in zip(names, texts, strict=True)))


def _games_table(tournament: Tournament) -> Table:
    games = tournament.played
    rows = ((" – ".join(each.names), each.text, each.round, each.seed, "; ".join(each.notes)) for each in games)
    return Table(("game", "score", "round", "seed", ""), rows, ends_in_text=True)


def tournament_results(tournament: Tournament, out: Path) -> dict[str, Any]:
    """Return table and games for JSON."""
    return {
        "match": tournament.title,
        "folder": str(out),
        "table": tournament.standings,
        "games": [
            {
                "round": each.round,
                "players": list(each.names),
                "seed": each.seed,
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
    standings = tournament.standings
    table = Table([*standings[0]], (each.values() for each in standings))
    replace_file(out / "tournament.csv", table.csv(), "the table")
    places = range(1, 1 + (len(tournament.played[0].names) if tournament.played else 2))
    heads = [f"{what}_{place}" for what in ("player", "score") for place in places]
    games = [
        (each.round, each.seed, *each.names, *each.score, "; ".join(each.notes), each.outcome.recording)
        for each in tournament.played
    ]
    games_csv = Table(["round", "seed", *heads, "failed", "recording"], games).csv()
    replace_file(out / "games.csv", games_csv, "the games")
    recorded = [each.outcome for each in tournament.played if each.outcome.recording][:SHOWN_MAX]
    runs = shown_runs({each.name: out / each.recording for each in recorded}, workers, on_progress)
    left = SHOWN_BYTES_MAX
    for name, run in list(runs.items()):
        left -= sum(map(len, run.values()))
        if left < 0:
            del runs[name]
    text = page_template("tournament.html").render(
        tournament=tournament,
        standings=standings_table(tournament),
        meetings=_meetings_table(tournament),
        games=_games_table(tournament),
        seconds=seconds,
        **page_parts(runs, out),
    )
    replace_file(out / PAGE, text.encode("utf-8", "replace"), "the page")

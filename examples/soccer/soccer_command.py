"""The command `kiks demo soccer`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import typer
from soccer_match import Match, Report, play
from soccer_picture import draw_match

from kiks.cli.desk import open_desk
from kiks.cli.record import recorded
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import ParameterError, shown

if TYPE_CHECKING:
    from kiks.ports.program_process import Command

SECONDS = 300.0
"""Default length of a match [s]."""


def show_match(
    seconds: float | None,
    seed: int,
    files: tuple[Path, Path | None],
    left: str | None,
    right: str | None,
    *,
    on_desk: bool,
    waits: bool,
) -> None:
    """Let two programs play, print the goals, and write a picture.

    Args:
        seconds: Length of the match [s]; five minutes if left out.
        seed: Seed of all random numbers.
        files: The picture's file, and that of the recording, if there is to be one.
        left: The program of the left side with its arguments; KiKS's own player if left out.
        right: The program of the right side.
        on_desk: Whether to show the match in a browser.
        waits: Whether to begin when the first page shows it.

    Raises:
        ParameterError: If `left` or `right` names no program, or a value is out of range.
    """
    players = [player(left, 1, "left"), player(right, 2, "right")]

    def tell(report: Report) -> None:
        goal, (left_count, right_count) = report.goals[-1], report.score()
        typer.echo(f"{goal.time_s:6.1f} s   {left_count}:{right_count}   {goal.side}")

    match = Match(SECONDS if seconds is None else seconds, seed, on_goal=tell)
    if on_desk:
        from kiks.desk.server.desk import Desk

        open_desk(Desk(match), work=partial(_play, match, players, *files), waits=waits, goes_on=False)
    else:
        _play(match, players, *files)


def _play(match: Match, players: list[Command], picture: Path, record: Path | None) -> None:
    """Play the match to the end, print the result, and draw it."""
    from kiks.export.pictures import save_image

    end_as_with_ctrl_c()
    start_s = perf_counter()
    with recorded(match, record=record, programs=[each.program for each in players]):
        doubt = play(match, players, say=lambda text: typer.echo(f"kiks: {text}", err=True))
    speedup = match.time_s / (perf_counter() - start_s)
    save_image(draw_match(match), picture)
    left_count, right_count = match.report.score()
    typer.echo(
        f"soccer: left {left_count}, right {right_count}   {match.time_s:.1f} s   {speedup:.0f} x real time   "
        f"{len(match.report.drops_s)} dropped balls"
    )
    repeatable = f"not repeatable: {doubt}" if doubt else f"state {match.state_hash()}: the same on every computer"
    typer.echo(f"Picture: {picture}   Seed {match.seed}, {repeatable}.")


def player(words: str | None, robot: int, side: str) -> Command:
    """Return the program that drives a robot, with its port's name and its side before its own arguments.

    Raises:
        ParameterError: If the words name no program, or more than one.

    Example:
        >>> player(None, 2, "right").arguments
        ['kiks://2', 'right']
    """
    from kiks.cli.options import parse_words
    from kiks.ports.program_process import Command

    given = [f"kiks://{robot}", side]
    if words is None:
        return Command(Path(__file__).with_name("player.py"), given)
    is_program = bool(words.split()) and (Path(words).is_file() or Path(words.split()[0]).is_file())
    if not is_program:
        raise ParameterError(
            f"--{side} must be a Python file, with its arguments behind it in quotes, but it was {shown(words)}. "
            f"Example: --{side} 'mine.py --fast'."
        )
    command = parse_words([words])[0]
    return Command(command.program, [*given, *command.arguments])

"""`kiks tournament`."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kiks.cli.engine_start import ready_engine
from kiks.cli.job import demonstration_of
from kiks.cli.options import SeedOrOwn, Trusted, Workers, progress_bar, say
from kiks.cli.outputs import has_results, leave_out, shows_progress, tell_results
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import KiksError, ParameterError, counted, printable
from kiks.meant import nearest_file

if TYPE_CHECKING:
    from kiks.trials.submissions import Submission
    from kiks.trials.tournament import Match, Tournament


MatchName = Annotated[
    str, typer.Argument(help="A project with a robot for each player and a referee: sumo, soccer, or a .kiks file.")
]

Players = Annotated[
    list[Path],
    typer.Argument(
        help="Programs (.py), folders of them, or archives (.zip). A folder with a __main__.py is one program."
    ),
]

Rounds = Annotated[
    int | None,
    typer.Option(help="Rounds of the Swiss system; each meets each, round robin, if left out.", min=1, max=100),
]

SeedCount = Annotated[
    int, typer.Option(help="Seeds with which the same players meet, from --seed on.", min=1, max=1000)
]

OutFolder = Annotated[
    Path | None,
    typer.Option(help="Folder of tables, page and recordings; tournament-MATCH if left out."),
]

OnDesk = Annotated[
    bool, typer.Option("--desk", help="Show the games in a browser, one after the other, with the table between.")
]


@has_results
@shows_progress
def tournament(
    context: typer.Context,
    match: MatchName,
    players: Players,
    rounds: Rounds = None,
    seed: SeedOrOwn = None,
    seeds: SeedCount = 2,
    out: OutFolder = None,
    workers: Workers = None,
    trusted: Trusted = False,
    desk: OnDesk = False,
) -> None:
    """Let programs meet in a match, each on each side, and rate them.

    Each player runs in a sandbox of its own. The one with the higher score wins; one that crashes or hangs loses. What
    is left is tournament.csv, games.csv, tournament.html, where each game can be played, and a recording of each (kiks
    replay). The table is the same on every computer. A command that was stopped goes on when it starts again.

    Example: kiks tournament sumo players/

    Example: kiks tournament soccer ann.py bob.py eve.py --rounds 5 --seeds 4
    """
    from kiks.model.atomic_files import alone_in
    from kiks.model.shipped import demonstrations
    from kiks.ports.sandbox import check_sandbox
    from kiks.trials.runner import OUTCOMES
    from kiks.trials.tournament import Match, play
    from kiks.trials.tournament_report import PAGE, save_tournament, standings_table, tournament_results

    path = demonstrations()[match] if demonstration_of(match) else Path(match)
    if not path.exists():
        raise ParameterError(
            f"MATCH must be a match that comes with KiKS, such as sumo, or a project, but there is no {match!r}."
            f"{nearest_file(path, demonstrations())}"
        )
    chosen = Match.load(path)
    if not trusted:
        check_sandbox()
    out = out or Path(f"tournament-{chosen.title}")
    context.with_resource(alone_in(out, "--out", OUTCOMES))
    playing = _players(players, out / "programs")
    first = chosen.project.seed if seed is None else seed
    ready_engine()
    drawn = range(first, first + seeds)
    played = partial(play, chosen, playing, out, rounds=rounds, seeds=drawn, is_trusted=trusted, workers=workers)
    if desk:
        leave_out(context, "with --desk, where the games are shown", "json")
        _show(chosen, playing, out, played)
        return
    end_as_with_ctrl_c()
    with progress_bar(counted(len(playing), "player"), "game") as show:
        numbers = itertools.count(1)
        made = played(on_played=lambda _, count: show(next(numbers), count))
    with progress_bar("page", "game") as show:
        assert chosen.project.seconds is not None
        save_tournament(made, out, chosen.project.seconds, workers=workers, on_progress=show)
    typer.echo(standings_table(made).for_output())
    for each_played in made.played:
        for text in each_played.notes:
            say(printable(f"{' - '.join(each_played.names)}, seed {each_played.seed}: {text}."))
    if not made.played:
        raise ParameterError("a tournament must have games, but there are none. Add players or rounds.")
    tell_results(
        context,
        tournament_results(made, out),
        [f"{out / PAGE}: open it in a browser. kiks replay shows the recordings in {out}."],
    )


def _players(paths: list[Path], folder: Path) -> list[Submission]:
    """Return the programs that can play, copied below a folder, and say which ones cannot."""
    from kiks.trials.submissions import submissions_in

    found = submissions_in(paths, folder, "PLAYERS")
    for each in found:
        if each.problem:
            say(printable(f"{each.name} does not play: {each.problem}."))
    return [each for each in found if each.command is not None]


def _show(match: Match, players: Sequence[Submission], out: Path, play: Callable[..., Tournament]) -> None:
    """Show the games on a desk until Ctrl-C, while they are played ahead in another thread."""
    from kiks.cli.desk import open_desk
    from kiks.desk.server.desk import Desk
    from kiks.desk.server.hall import Hall
    from kiks.run import Run
    from kiks.trials.tournament import in_order
    from kiks.trials.tournament_report import PAGE, save_tournament

    seconds = match.project.seconds
    assert seconds is not None
    # The desk's own world stands still: a replay of thinking times, one for each player, is not looked up for it.
    desk = Desk(Run(replace(match.project, speed=1.0), match.folder, thinking="none"))
    desk.present.pause()
    desk.hall = hall = Hall(match.title, tuple(each.name for each in in_order(players)), out)

    def work() -> None:
        try:
            save_tournament(play(on_played=hall.note), out, seconds)
            say(f"all games are played: {out / PAGE}.")
        except KiksError as error:
            desk.say(f"The tournament has ended: {error}")
        finally:
            hall.end()

    threading.Thread(target=work, name="kiks tournament", daemon=True).start()
    open_desk(desk)

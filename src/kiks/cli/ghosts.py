"""`kiks ghosts`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from kiks.cli.engine_start import ready_batch
from kiks.cli.export import picture_size
from kiks.cli.options import progress_bar
from kiks.cli.outputs import leave_out, output, shows_progress
from kiks.errors import ParameterError, shown

ENDINGS = (".mp4", ".gif", ".webp", ".png", ".html")

SHOWN = 5
"""Number of generations that are shown unless some are named: at equal intervals."""


def _numbers(value: str | None) -> Any:
    """Return the numbers of 1,20,60."""
    if value is None:
        return None
    try:
        return [int(word) for word in value.split(",")]
    except ValueError:
        raise ParameterError(f"--generations must be numbers such as 1,20,60, but it was {shown(value)}.") from None


@shows_progress
def ghosts(
    context: typer.Context,
    folder: Annotated[Path, typer.Argument(help="The folder of an evolution of one controller, which may run.")],
    out: Annotated[
        Path,
        typer.Argument(
            help=f"The film, picture, or page with a player: {', '.join(ENDINGS)}.", callback=output(*ENDINGS)
        ),
    ],
    generations: Annotated[
        str | None,
        typer.Option(
            metavar="1,20,60",
            help="One after the other; five, the last one included, if left out. A picture shows the last of them.",
            callback=_numbers,
        ),
    ] = None,
    world: Annotated[int, typer.Option(help="In which of the worlds of their evaluation, from 0.", min=0)] = 0,
    task: Annotated[str | None, typer.Option(help="The file of the task, if it is a Python file or was moved.")] = None,
    size: Annotated[
        str | None, typer.Option(help="Width and height [pixels]; 1280x720 if left out.", callback=picture_size)
    ] = None,
    fps: Annotated[int | None, typer.Option(help="Film: pictures per second; 25 if left out.")] = None,
    speed: Annotated[
        float | None, typer.Option(help="Film: simulated seconds per second of it; 1 if left out.")
    ] = None,
) -> None:
    """Show whole generations: all candidates in one arena, as ghosts that drive through one another.

    Each drives as in its evaluation, alone in a world of its own. Number 1 is the best of its generation.

    Example: kiks ghosts runs/avoid generations.mp4 --generations 1,10,60 --speed 4
    """
    import numpy as np

    from kiks.export.ghost_frames import save_ghost_page
    from kiks.export.ghosts import save_ghosts
    from kiks.learn import tasks
    from kiks.learn.evolution_log import EvolutionFolder
    from kiks.learn.individual import ghosts_of

    given = None if task is None else tasks.load(task)
    chosen: Any = generations
    if chosen is None:
        count = max(EvolutionFolder(folder).generation_count(), 1)
        chosen = np.unique(np.linspace(1, count, SHOWN).round().astype(int)).tolist()
    if out.suffix == ".png":
        chosen = chosen[-1:]
    ready_batch()
    scenes = ghosts_of(folder, chosen, world=world, task=given)
    options = {name: value for name, value in (("size", size), ("fps", fps), ("speed", speed)) if value is not None}
    if out.suffix == ".html":
        leave_out(context, "of a page", "size", "fps", "speed")
        save_ghost_page(scenes, out)
    else:
        with progress_bar(out.name) as show:
            save_ghosts(scenes, out, on_progress=show, **options)  # type: ignore[arg-type] # checked there
    for scene in scenes:
        typer.echo(scene.title)

"""`kiks export`: a recording becomes a film, a picture, figures, a photo, a table or a page; an evolution, ghosts."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from kiks.cli.engine_start import ready_batch, ready_engine
from kiks.cli.options import progress_bar
from kiks.cli.outputs import leave_out, output, shows_progress
from kiks.errors import ParameterError, shown
from kiks.export.kinds import ENDINGS, EVOLUTION, KINDS, RECORDING, export_kind, option_names, source_of, with_article
from kiks.export.kinds import export as write_export
from kiks.model.ranges import numbers_of


def picture_size(value: str | None) -> Any:
    """Return width and height of 1280x720."""
    if value is None:
        return None
    words = re.fullmatch(r"([0-9]{1,5})x([0-9]{1,5})", value)
    if words is None:
        raise ParameterError(f"--size must be a width and a height like 1280x720, but it was {shown(value)}.")
    return int(words[1]), int(words[2])


def generation_numbers(value: str | None) -> Any:
    """Return the numbers of 1,20,60."""
    return None if value is None else numbers_of(value, "--generations", step=1)


@dataclass(frozen=True)
class ExportOptions:
    """The options of all kinds of exports, by the names of the arguments that they become."""

    size: Annotated[
        str | None,
        typer.Option(help="Film, photo: width and height [pixels]; 1280x720 if left out.", callback=picture_size),
    ] = None
    fps: Annotated[int | None, typer.Option(help="Film: pictures per second; 25 if left out.")] = None
    speed: Annotated[float | None, typer.Option(help="Film: simulated seconds per second of it; 1 if left out.")] = None
    start_s: Annotated[float | None, typer.Option("--start", help="Film: its beginning [s of simulated time].")] = None
    end_s: Annotated[float | None, typer.Option("--end", help="Film: its end [s of simulated time].")] = None
    time_s: Annotated[
        float | None, typer.Option("--time", help="Picture, photo: when [s of simulated time]; the end if left out.")
    ] = None
    follow: Annotated[int | None, typer.Option(help="Film, photo: the robot that stays in the middle.")] = None
    zoom: Annotated[
        float | None, typer.Option(help="With --follow: how much larger the arena is than a whole one; 3 if left out.")
    ] = None
    view: Annotated[str | None, typer.Option(help="Film: top, or 3d, in space; top if left out.")] = None
    is_plain: Annotated[
        bool | None, typer.Option("--plain", help="Film: the world alone, without trails, clock and readings.")
    ] = None
    samples: Annotated[
        int | None, typer.Option(help="Photo: rays through a pixel; more are slower and less grainy; 48 if left out.")
    ] = None
    table: Annotated[
        str | None,
        typer.Option(
            help="Table: poses, wheels, readings, wire, events, a command such as T,2,N or a sense such as camera; "
            "poses if left out."
        ),
    ] = None
    robot: Annotated[
        int | None, typer.Option(help="Film, figures, page: the robot whose readings they show. Table: of it alone.")
    ] = None
    title: Annotated[str | None, typer.Option(help="Page: its title; the programs' names if left out.")] = None
    duration_s: Annotated[
        float | None,
        typer.Option("--duration", help="Champion page: for how long it drives [s]; a minute if its world says none."),
    ] = None
    generations: Annotated[
        str | None,
        typer.Option(
            metavar="1,20,60",
            help="Ghosts: one after the other; five, the last one included, if left out. A picture shows the last.",
            callback=generation_numbers,
        ),
    ] = None
    world: Annotated[
        int | None, typer.Option(help="Ghosts: in which of the worlds of their evaluation; 0 if left out.", min=0)
    ] = None
    task: Annotated[
        str | None, typer.Option(help="Ghosts: the file of the task, if it is a Python file or was moved.")
    ] = None


@shows_progress
def export(
    context: typer.Context,
    files: Annotated[
        list[Path],
        typer.Argument(
            help="A recording (.mcap); figures may be of several. Or the folder of an evolution of one controller, "
            "which may run. Or a champion's file (.toml).",
            metavar="RECORDING...",
        ),
    ],
    out: Annotated[
        Path,
        typer.Argument(
            help=f"The file, whose ending says what it becomes: {', '.join(ENDINGS)}.", callback=output(*ENDINGS)
        ),
    ],
    kind: Annotated[
        str | None, typer.Option(help=f"{', '.join(KINDS)}; by the ending if left out, a picture of a .png.")
    ] = None,
    options: ExportOptions = ExportOptions(),
) -> None:
    """Make a film, picture, figures, photo, table or page of a run, or show whole generations of an evolution.

    The ending of OUT says which. A picture shows the world from above with all paths. Figures show paths and odometry,
    where robots were, readings, speeds, and where the milliseconds went. A photo has light and shadows, and needs
    Mitsuba. A page is one HTML file to hand in, which any browser opens without a network: the engine in it makes the
    run again and compares it with the recording; people see why sensors read what they read, drag things, and let the
    world go on with a controller. A champion becomes such a page, too. All candidates of a generation are in one arena,
    as ghosts that drive through one another: each as in its evaluation, alone in a world of its own. Number 1 is the
    best.

    Example: kiks export run.mcap run.mp4 --speed 4 --follow 1

    Example: kiks export champion.toml champion.html

    Example: kiks export runs/avoid generations.mp4 --generations 1,10,60 --speed 4
    """
    from kiks.recording.recording import Recording

    made_of = source_of(files[0]) if len(files) == 1 else RECORDING
    kind = export_kind(out, kind, made_of)
    known = option_names(kind)
    leave_out(context, f"of {with_article(kind)}", *(vars(options).keys() - known))
    given = {name: value for name, value in vars(options).items() if value is not None}
    if made_of == EVOLUTION:
        from kiks.learn.evolution_log import EvolutionFolder

        EvolutionFolder(files[0]).identity()  # refused before anything is compiled
        ready_batch()
    elif kind in ("page", "champion page"):
        ready_engine()
    source = [Recording(file) for file in files] if made_of == RECORDING else files[0]
    with progress_bar(out.name) as show:
        if "on_progress" in known:
            given["on_progress"] = show
        write_export(source, out, kind=kind, **given)
    size_kb = out.stat().st_size / 1e3
    typer.echo(f"{kind.capitalize()}: {out}, {f'{size_kb:.0f} kB' if size_kb < 1000 else f'{size_kb / 1e3:.1f} MB'}")

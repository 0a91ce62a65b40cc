"""`kiks replay`, `kiks plot`, `kiks page` and `kiks table`: what is done with recordings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kiks.cli.desk import NoWait, open_desk
from kiks.cli.engine_start import ready_engine
from kiks.cli.options import progress_bar, say
from kiks.cli.outputs import leave_out, output
from kiks.errors import ParameterError, counted
from kiks.units import TICK_NS, s_from_ns
from kiks.version import __version__

if TYPE_CHECKING:
    import numpy as np

    from kiks.recording.recording import Recording

RecordingFile = Annotated[Path, typer.Argument(help="A recording (.mcap) of --record or sim.record.", metavar="FILE")]


def replay(
    context: typer.Context,
    file: RecordingFile,
    check: Annotated[
        bool, typer.Option("--check", help="Make the run again at full speed, and compare each second, to the bit.")
    ] = False,
    start: Annotated[float, typer.Option(help="Where to begin [s of simulated time].", min=0)] = 0.0,
    speed: Annotated[float, typer.Option(help="Simulated seconds per real second.", min=0.001, max=1000)] = 1.0,
    no_wait: NoWait = False,
) -> None:
    """Show a recorded run again on the desk, or check that it is the same again.

    The world on the desk is a living one: its sensors and lines can be watched as ever. The time bar below it goes to
    any time, forwards and backwards, and to each event; from any time a person can go on without the recording.

    Example: kiks replay run.mcap --check
    """
    if check:
        leave_out(context, "with --check", "start", "speed")
    ready_engine()
    from kiks.recording.recording import Recording

    recording = Recording(file)
    if not recording.is_whole:
        say(f"the run that wrote {str(file)!r} was killed, or goes on: this is what it has written so far.")
    if check:
        raise typer.Exit(_check(recording, file))
    from kiks.desk.server.desk import Desk
    from kiks.recording.replay import Replay

    # What goes on until a person lets the recording go: a world that stands still.
    world = Replay(recording.log, recording.log.begin_ns).let_go()
    desk = Desk(world, project=recording.project, speed=speed, owns_world=True, may_run_programs=True)
    desk.looking.show_recording(file, recording.time_ns(max(start, s_from_ns(recording.log.begin_ns))))
    open_desk(desk, waits=not no_wait)


def _check(recording: Recording, file: Path) -> int:
    """Check a recording, and say what was found; return the exit code."""
    from kiks.recording.check import check_recording

    found = check_recording(recording.log)
    if found.differs_ns is None and not found.equal_count:
        raise ParameterError(
            f"a recording must have a checkpoint to be compared, but {str(file)!r} has none: its run was "
            "killed before the first one, or goes on."
        )
    version = recording.about.get("kiks", "of an unknown version")
    if found.differs_ns is None:
        typer.echo(
            f"The same run again: {counted(found.equal_count, 'checkpoint')} equal, to the bit, in "
            f"{recording.duration_s:.3f} s of simulated time."
        )
        return 0
    where = f"{counted(found.equal_count, 'checkpoint')} equal, that of {s_from_ns(found.differs_ns):.3f} s differs."
    tick = ""
    if found.first_tick is not None:
        tick_s = s_from_ns(found.first_tick * TICK_NS)
        tick = f" Tick {found.first_tick} (at {tick_s:.2f} s) is the first that moves a robot otherwise."
    typer.echo(f"Another run: {where}{tick}")
    if version != __version__:
        typer.echo(f"KiKS {version} has recorded it, and this is KiKS {__version__}.")
    return 1


def plot(
    files: Annotated[list[Path], typer.Argument(help="Recordings (.mcap), side by side.", metavar="FILE...")],
    out: Annotated[
        Path, typer.Option(help="The picture: .png, .svg or .pdf.", callback=output(".png", ".svg", ".pdf"))
    ] = Path("kiks-plot.png"),
    robot: Annotated[int, typer.Option(help="The robot whose readings, speeds and time are drawn.", min=1)] = 1,
) -> None:
    """Draw recordings: paths and odometry, where robots were, readings, speeds, and where the milliseconds went.

    Example: kiks plot avoid.mcap maze.mcap --out both.pdf
    """
    from kiks.export.figures import save_plot
    from kiks.recording.recording import Recording

    save_plot([Recording(file) for file in files], out, robot=robot)
    typer.echo(f"Picture: {out}")


def page(
    file: RecordingFile,
    out: Annotated[
        Path | None,
        typer.Argument(
            help="The page, .html; FILE with .html if left out.",
            callback=output(".html", default=lambda told: told["file"].with_suffix(".html")),
        ),
    ] = None,
    title: Annotated[str | None, typer.Option(help="Its title; the programs' names if left out.")] = None,
    robot: Annotated[int, typer.Option(help="The robot whose readings, speeds, time and wire are shown.", min=1)] = 1,
) -> None:
    """Make of a recording one HTML file to hand in: a player, figures, numbers, programs, and how to run it again.

    The page needs no network and no KiKS: any browser opens it.

    Example: kiks page run.mcap --title "Exercise 3, Ada Lovelace"
    """
    ready_engine()
    from kiks.export.page import save_page
    from kiks.recording.recording import Recording

    recording = Recording(file)
    assert out is not None  # `output` has filled it in
    with progress_bar("making the run again") as show:
        save_page(recording, out, title=title, robot=robot, on_progress=show)
    typer.echo(f"Page: {out}, {out.stat().st_size / 1e6:.1f} MB")


def table(
    file: RecordingFile,
    out: Annotated[Path, typer.Argument(help="The table: .csv or .parquet.", callback=output(".csv", ".parquet"))],
    name: Annotated[str, typer.Option("--table", help="Which: poses, wheels, readings, wire or events.")] = "poses",
    robot: Annotated[int | None, typer.Option(help="Of this robot alone.")] = None,
) -> None:
    """Write a table of a recording: where robots were, what wheels did, readings, characters, events.

    Example: kiks table run.mcap readings.csv --table readings
    """
    from kiks.recording.recording import Recording

    rows = Recording(file).table(name, robot)
    columns = {}
    for column in rows.dtype.names or ():
        values = rows[column]
        if values.ndim == 1:
            columns[column] = values
        else:
            columns |= {f"{column}_{index}": values[:, index] for index in range(values.shape[1])}
    if out.suffix.lower() == ".parquet":
        from kiks.learn.evolution_log import write_table

        write_table(columns, out, "a table")
    else:
        _write_csv(columns, out)
    typer.echo(f"{counted(len(rows), 'row')}: {out}")


def _write_csv(columns: dict[str, np.ndarray[tuple[int], np.dtype[np.generic]]], path: Path) -> None:
    import csv
    import io

    from kiks.model.atomic_files import replace_file

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    lists = [
        [each.decode("latin-1").encode("unicode_escape").decode() for each in values.tolist()]
        if values.dtype.kind == "S"
        else values.tolist()
        for values in columns.values()
    ]
    writer.writerows(zip(*lists, strict=True))
    replace_file(path, text.getvalue(), "a table")

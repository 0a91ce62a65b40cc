"""`kiks film` and `kiks photo`: films and photos of recordings."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from kiks.cli.options import progress_bar
from kiks.cli.outputs import output
from kiks.cli.replay import RecordingFile
from kiks.errors import ParameterError, counted, shown


def film(
    file: RecordingFile,
    out: Annotated[
        Path, typer.Argument(help="The film: .mp4, .gif or .webp.", callback=output(".mp4", ".gif", ".webp"))
    ],
    size: Annotated[str, typer.Option(help="Width and height [pixels].")] = "1280x720",
    fps: Annotated[int, typer.Option(help="Pictures per second.")] = 25,
    speed: Annotated[float, typer.Option(help="Simulated seconds per second of the film.")] = 1.0,
    start: Annotated[float | None, typer.Option(help="Where to begin [s of simulated time].")] = None,
    end: Annotated[float | None, typer.Option(help="Where to end [s of simulated time].")] = None,
    robot: Annotated[
        int | None, typer.Option(help="The robot whose readings are shown; the followed one, else 1, if left out.")
    ] = None,
    follow: Annotated[int | None, typer.Option(help="The robot that stays in the middle.")] = None,
    zoom: Annotated[
        float | None, typer.Option(help="With --follow: how much larger the arena is than a whole one; 3 if left out.")
    ] = None,
    view: Annotated[str, typer.Option(help="From where: top, or 3d, in space.")] = "top",
    plain: Annotated[
        bool, typer.Option("--plain", help="The world alone, without trails, clock and readings.")
    ] = False,
) -> None:
    """Make a film of a recording: the world from above with trails, and what a robot reads beside it.

    Example: kiks film run.mcap run.mp4 --speed 4 --follow 1
    """
    from kiks.export.film import save_film
    from kiks.recording.recording import Recording

    if plain and robot is not None:
        raise ParameterError(f"--robot must be left out with --plain, but it was {robot}.")
    with progress_bar(out.name) as show:
        count = save_film(
            Recording(file),
            out,
            size=_parse_size(size),
            fps=fps,
            speed=speed,
            start_s=start,
            end_s=end,
            robot=robot,
            follow=follow,
            zoom=zoom,
            view=view,
            is_plain=plain,
            on_picture=show,
        )
    typer.echo(f"Film: {out}   {counted(count, 'picture')}, {count / fps:.1f} s")


def photo(
    file: RecordingFile,
    out: Annotated[Path, typer.Argument(help="The photo: .png or .jpg.", callback=output(".png", ".jpg"))],
    time: Annotated[float | None, typer.Option(help="When [s of simulated time]; the end if left out.")] = None,
    size: Annotated[str, typer.Option(help="Width and height [pixels].")] = "1280x720",
    follow: Annotated[int | None, typer.Option(help="The robot that is in the middle.")] = None,
    zoom: Annotated[
        float | None, typer.Option(help="With --follow: how much larger the arena is than a whole one; 3 if left out.")
    ] = None,
    samples: Annotated[int, typer.Option(help="Rays through a pixel: more are slower and less grainy.")] = 48,
) -> None:
    """Take a photo of a recorded world: with light, shadows and lamps, as a camera would see it. It needs Mitsuba.

    Example: kiks photo run.mcap run.png --time 12.5 --follow 1
    """
    from kiks.export.photo import save_photo
    from kiks.recording.recording import Recording

    save_photo(Recording(file), out, time_s=time, size=_parse_size(size), follow=follow, zoom=zoom, samples=samples)
    typer.echo(f"Photo: {out}")


def _parse_size(size: str) -> tuple[int, int]:
    words = re.fullmatch(r"([0-9]{1,5})x([0-9]{1,5})", size)
    if words is None:
        raise ParameterError(f"--size must be a width and a height like 1280x720, but it was {shown(size)}.")
    return int(words[1]), int(words[2])

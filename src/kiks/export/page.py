"""Makes of a recording one HTML file that needs no network: what ran, a player, figures, numbers, programs, commands.

All texts of a recording reach the page through a template that escapes them, and the page's security policy lets
nothing run but its own script, named by its hash: what is in a recording never becomes markup or script.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import jinja2
from markupsafe import Markup

from kiks.export.bundle import bundle
from kiks.export.figures import NO_ROBOT, panels_of
from kiks.export.page_contents import contents_of
from kiks.export.run_frames import PERIOD_NS, RunFrames
from kiks.model.atomic_files import replace_file
from kiks.recording.recording import Recording
from kiks.units import clock_text, s_from_ns
from kiks.version import __version__

WEB = Path(__file__).parents[1] / "desk" / "web"

STYLES = ("arena_view.css", "monitor_view.css", "run_page.css")

FIGURES = {
    "paths": ("Paths", "Where robots drove, and where the wheels of a lone robot say that it did"),
    "places": ("Places", "How long robots were in which part of the arena"),
    "readings": ("Readings", "What the program read of the proximity sensors of robot {robot}"),
    "speeds": ("Speeds", "How fast the wheels of robot {robot} turned, and how fast they should"),
    "time": ("Time", "Where the milliseconds of robot {robot} went"),
}
"""Title of each figure, and a sentence."""


def save_page(
    recording: Recording,
    path: str | Path,
    *,
    title: str | None = None,
    robot: int = 1,
    on_progress: Callable[[float], None] = lambda share: None,
) -> None:
    """Write the page of a recording.

    Args:
        recording: The recording.
        path: The page's file.
        title: Its title; the programs' names if left out.
        robot: Number of the robot whose readings, speeds, time and wire are shown; a run without a robot has none.
        on_progress: Called now and then with the share that is done.
    """
    figures = panels_of(recording, robot=robot)
    frames = RunFrames(recording.log, on_progress)
    template, script, style = _parts()
    page = template.render(
        contents_of(recording, frames, robot),
        title=title,
        robot=robot,
        figures=[
            (name, head, text.format(robot=robot), base64.b64encode(figures[name]).decode())
            for name, (head, text) in FIGURES.items()
            if name in figures
        ],
        no_robot=NO_ROBOT,
        frames=frames,
        packed=frames.pack(),
        is_coarse=frames.period_ns > PERIOD_NS,
        period_s=s_from_ns(frames.period_ns),
        version=__version__,
        script=Markup(script),
        script_hash=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
        style=Markup(style),
    )
    # The name of a file may hold what is no text.
    replace_file(path, page.encode("utf-8", "replace"), "a page")


@lru_cache(1)
def _parts() -> tuple[jinja2.Template, str, str]:
    """Return template, script and style, which are the same for all pages and made once."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(WEB),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["clock"] = clock_text
    style = "\n".join((WEB / name).read_text("utf-8") for name in STYLES)
    return environment.get_template("run_page.html"), bundle(WEB / "run_page.js"), style

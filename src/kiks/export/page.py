"""Makes of a recording one HTML file that needs no network: what ran, a player, figures, numbers, programs, commands.

All texts of a recording reach the page through a template that escapes them, and the page's security policy lets
nothing run but its own script, named by its hash: what is in a recording never becomes markup or script.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any
from urllib.parse import quote

import jinja2
from markupsafe import Markup

from kiks.batch.loop_timing import Timing
from kiks.errors import ParameterError
from kiks.export.browser_controller import EXPLORER, describe_controller
from kiks.export.browser_engine import VEHICLE
from kiks.export.bundle import bundle
from kiks.export.event_looks import event_styles
from kiks.export.figures import NO_ROBOT, ROWS, draw_panels
from kiks.export.findings import gather_findings
from kiks.export.page_contents import page_contents
from kiks.export.page_run import PageRun, packed_engine
from kiks.export.shown_run import PERIOD_NS, ShownRun
from kiks.model.atomic_files import replace_file
from kiks.recording.recording import Recording
from kiks.units import clock_text, s_from_ns
from kiks.version import __version__

WEB = Path(__file__).parents[1] / "desk" / "web"

VEHICLE_PERIOD_S = 0.05
"""Period of the loop of a Braitenberg vehicle [s]."""

STYLES = ("arena_view.css", "monitor_view.css", "run_page.css")

_SAFE = " !$()*+,/:;=?@[]"
"""What stands in the address of a figure as it is, beside letters, numbers and -._~: most of a figure is numbers."""


def save_page(
    recording: Recording,
    path: str | Path,
    *,
    title: str | None = None,
    robot: int = 1,
    controllers: Sequence[Mapping[str, Any]] = (),
    is_kept: bool = True,
    on_progress: Callable[[float], None] = lambda share: None,
) -> None:
    """Write the page of a recording.

    Args:
        recording: The recording.
        path: The page's file.
        title: Its title; the programs' names if left out.
        robot: Number of the robot whose readings, speeds, time and wire are shown; a run without a robot has none.
        controllers: Those with which people can let the world go on (`describe_controller`), beside a Braitenberg
            vehicle.
        is_kept: Whether there will be the recording, so that the page names commands for it.
        on_progress: Called now and then with the share that is done.
    """
    if sum(each["module"] is not None for each in controllers) > 1:
        raise ParameterError("controllers must bring at most one module of code, but there are more. Leave some out.")
    run = PageRun(recording.log)
    found = gather_findings(recording, run.pieces(on_progress))
    figures = draw_panels(recording, found, robot=robot)
    page = page_template("run_page.html").render(
        page_contents(recording, found, run, robot, is_kept=is_kept),
        title=title,
        robot=robot,
        figures=[
            (name, ROWS[name].title, ROWS[name].text.format(robot=robot), quote(figure, safe=_SAFE))
            for name, figure in figures.items()
        ],
        **player_values(run),
        run=run,
        packed=run.pack(),
        controllers=[*controllers, *_vehicles(run)],
        engine=packed_engine(),
        version=__version__,
        script=Markup(player_script()),
        script_hash=script_hash(player_script()),
        style=Markup(player_style()),
    )
    # The name of a file may hold what is no text.
    replace_file(path, page.encode("utf-8", "replace"), "a page")


def _vehicles(run: PageRun) -> list[dict[str, Any]]:
    """Return a Braitenberg vehicle, where all robots are of one kind that it can drive."""
    specs = list(dict.fromkeys(run.replay.sim.specs))
    # One program drives all robots of a world, in the units of one kind.
    if len(specs) != 1:
        return []
    timing = Timing(period_s=VEHICLE_PERIOD_S, baud=None)
    return [describe_controller(VEHICLE, EXPLORER, specs[0], timing, "Braitenberg vehicle")]


def player_values(run: ShownRun) -> dict[str, Any]:
    """Return what `web/run_player.html` needs to show a run, by name."""
    return {
        "begin_s": s_from_ns(run.begin_ns),
        "end_s": s_from_ns(run.end_ns),
        "robot_count": max(len(scene["robots"]) for scene in run.scenes),
        "no_robot": NO_ROBOT,
        "is_coarse": run.period_ns > PERIOD_NS,
        "period_s": s_from_ns(run.period_ns),
    }


@lru_cache
def page_template(name: str) -> jinja2.Template:
    """Return a template of `desk/web`, which escapes all that it is given."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(WEB),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["clock"] = clock_text
    return environment.get_template(name)


@lru_cache(1)
def player_script() -> str:
    """Return the script of the player, which is the same for all runs."""
    return bundle(WEB / "run_page.js")


@lru_cache(1)
def player_style() -> str:
    """Return the style sheets of the player."""
    events = event_styles("@media (prefers-color-scheme: dark) { :root {} }")
    return "\n".join((events, *((WEB / name).read_text("utf-8") for name in STYLES)))


def script_hash(script: str) -> str:
    """Return by what a page's security policy names a script that it may run."""
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()

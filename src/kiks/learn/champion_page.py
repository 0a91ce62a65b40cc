"""A champion as a page: it drives in its own world, and people drive on with it, for `kiks.export.kinds`."""

from __future__ import annotations

import shlex
import tempfile
from collections.abc import Callable
from pathlib import Path

from kiks.export.browser_controller import describe_controller
from kiks.export.page import save_page
from kiks.learn.champion import Champion
from kiks.model.checks import check_number
from kiks.recording.recorder import RunRecorder
from kiks.recording.recording import Recording

CHAMPION_S = 60.0
"""Simulated time for which a champion drives [s] whose world does not say it."""


def save_champion_page(
    champion: Champion | str | Path,
    path: str | Path,
    *,
    title: str | None = None,
    duration_s: float | None = None,
    on_progress: Callable[[float], None] = lambda share: None,
) -> None:
    """Write a page in which a champion drives, and with which people can let its world go on.

    Args:
        champion: The champion, or its file.
        path: The page's file.
        title: Its title; the champion's task if left out.
        duration_s: Simulated time for which it drives [s]; that of its world, or a minute, if left out.
        on_progress: Called now and then with the share that is done.
    """
    made = champion if isinstance(champion, Champion) else Champion.load(champion)
    name = f"Champion of {made.task}" if made.task else made.controller.name
    if duration_s is None:
        duration_s = (made.world.seconds if made.world is not None else None) or CHAMPION_S
    duration_s = check_number("duration_s", duration_s, 0.1, 3600.0)
    sim, ports = made.simulation()
    about = {} if isinstance(champion, Champion) else {"command": shlex.join(["kiks", "run", str(champion)])}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "champion.mcap")
        with RunRecorder(sim, file, about=about):
            made.drive(ports, seconds=duration_s)
            sim.run(max(duration_s - sim.time_s, 0.0))
        driver = describe_controller(made.controller, made.parameters, sim.specs[0], made.timing, name)
        save_page(
            Recording(file), path, title=title or name, controllers=[driver], is_kept=False, on_progress=on_progress
        )

"""What all reports of trials have in common: runs that play in them, and the scripts and styles of the page.

The player's code is in a report once, and the page's security policy lets nothing run but its two scripts, named by
their hashes.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from markupsafe import Markup

from kiks.export.page import WEB, page_template, player_script, player_style, player_values, script_hash
from kiks.export.page_run import PageRun, packed_engine
from kiks.recording.recording import Recording
from kiks.trials.crew import results
from kiks.version import __version__

Run = dict[str, str]


def shown_runs(
    recordings: Mapping[str, Path],
    workers: int | None = None,
    on_progress: Callable[[int, int], object] = lambda done, count: None,
) -> dict[str, Run]:
    """Return what reports need to play recordings, by their names; nothing of one that cannot be read.

    Args:
        recordings: Files of recordings, by names.
        workers: How many processes; one for each core if left out.
        on_progress: Called with how many are ready, and of how many.
    """
    jobs = {name: partial(_shown, path.absolute()) for name, path in recordings.items()}
    runs = {}
    for done, (name, result) in enumerate(results(jobs, workers), 1):
        on_progress(done, len(jobs))
        if result.result:
            runs[name] = result.result
    # As they come is not in the same order each time.
    return {name: runs[name] for name in recordings if name in runs}


def _shown(recording: Path) -> Run:
    """Return what `web/grades.js` puts together to a page that plays a recording."""
    run = PageRun.of(Recording(recording).log)
    section = page_template("run_player.html").render(player_values(run))
    return {"section": section, "frames": run.pack()}


def page_parts(runs: Mapping[str, Run], out: Path) -> dict[str, Any]:
    """Return what the template of a report, `desk/web/report.html`, needs beside its contents, by name.

    Args:
        runs: The runs that play in it, of `shown_runs`.
        out: The folder in which their recordings are.
    """
    script = (WEB / "grades.js").read_text("utf-8")
    return {
        "player": page_template("run_frame.html").render(
            script=Markup(player_script()), style=Markup(player_style()), engine=packed_engine()
        ),
        "runs": runs,
        "replay": lambda outcome: shlex.join(["kiks", "replay", str(out / outcome.recording)]),
        "version": __version__,
        "script": Markup(script),
        "script_hash": script_hash(script),
        "player_hash": script_hash(player_script()),
        "style": Markup("\n".join((player_style(), (WEB / "grades.css").read_text("utf-8")))),
    }

"""What the page of a recording tells: facts, numbers of each robot, events, programs' texts, the wire, commands."""

from __future__ import annotations

import json
import shlex
from collections import Counter
from contextlib import suppress
from pathlib import PurePath
from typing import Any

from markupsafe import Markup
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import OctaveLexer, PythonLexer, TextLexer

from kiks.control.observed_measures import LOOKED_AT, NOTE_COUNT
from kiks.errors import counted
from kiks.export.event_looks import EVENT_LOOKS
from kiks.export.findings import Findings
from kiks.export.page_run import PageRun
from kiks.model.goal import Goal
from kiks.model.program_kinds import ProgramKind, program_kind
from kiks.recording.recording import Recording
from kiks.recording.tables import Table
from kiks.units import clock_text
from kiks.version import __version__

MOMENTS_MAX = 1000
"""Most events in the list, which then holds the first ones."""

MARKS_MAX = 20_000
"""Most marks above the slider."""

PROGRAM_CHARACTERS_MAX = 100_000
"""Most characters of a program's text on the page."""

COLOURED_CHARACTERS_MAX = 50_000
"""Most characters of all programs in colours; the rest is plain text."""

LINE_CHARACTERS_MAX = 500
"""Most characters of an event, and of a line of the wire."""

WIRE_LINES = 8
"""Lines of the wire that are shown at the beginning and at the end."""

ROBOTS_MAX = 100
"""Most robots in the table of numbers."""


def page_contents(recording: Recording, found: Findings, run: PageRun, robot: int, *, is_kept: bool) -> dict[str, Any]:
    """Return what `web/run_page.html` needs to tell of a recording, by name."""
    events, wire = found.tables["events"], found.tables["wire"]
    programs, file = _programs(recording), recording.log.reader.path.name
    names = ", ".join(dict.fromkeys(program["name"] for program in programs))
    return {
        "what_ran": names or f"A run in arena {_arena(recording)}",
        "parts": (
            _kinds(run),
            f"arena {_arena(recording)}",
            clock_text(recording.duration_s),
            f"seed {recording.start.head.seed}",
        ),
        "is_whole": recording.is_whole,
        "facts": _facts(recording, run, is_kept=is_kept),
        "numbers": _numbers(recording, found, run),
        "events": [(*row[:3], _cut(row[3])) for row in events[:MOMENTS_MAX].tolist()],
        "more_events": max(len(events) - MOMENTS_MAX, 0),
        "kinds": sorted(set(events["kind"].tolist())),
        "looks": EVENT_LOOKS,
        "moments": [[round(time_s, 3), kind] for time_s, kind in events[["time_s", "kind"]][:MARKS_MAX].tolist()],
        "programs": programs,
        "wire": _wire(wire[wire["robot"] == robot]),
        "command": recording.about.get("command", ""),
        "judged": judged(recording),
        "check": shlex.join(["kiks", "replay", "--check", file]) if is_kept else "",
        "watch": shlex.join(["kiks", "replay", file]) if is_kept else "",
    }


def judged(recording: Recording) -> dict[str, Any]:
    """Return what `web/judge.js` needs to judge a recording: the measures of the engine, and the goal if it has one."""
    goal = None
    # A recording may come from anywhere and say anything; JSON has no infinite numbers.
    with suppress(ValueError, TypeError, RecursionError):
        lists = Goal(**json.loads(recording.about.get("goal", ""))).as_lists()
        json.dumps(lists, allow_nan=False)
        goal = lists
    return {"goal": goal, "measures": {"names": [each.name for each in LOOKED_AT], "note_count": NOTE_COUNT}}


def _arena(recording: Recording) -> str:
    return recording.start.arena.name or "an arena"


def _kinds(run: PageRun) -> str:
    """Return which robots there are in the end."""
    kinds = Counter(spec.name for spec in run.replay.sim.specs)
    return ", ".join(f"{count} x {kind}" if count > 1 else kind for kind, count in kinds.items()) or "no robot"


def _facts(recording: Recording, run: PageRun, *, is_kept: bool) -> list[tuple[str, str]]:
    """Return what ran, as names and values."""
    about, arena, sim = recording.about, recording.start.arena, run.first
    turrets = [
        f"{', '.join(turret.name for turret in sim.turrets(number))} on robot {number}"
        for number in range(1, sim.robot_count + 1)
        if sim.turrets(number)
    ]
    things = Counter(body["what"] for body in run.scenes[0]["bodies"]) + Counter(lamp=len(sim.world.lamps))
    made_again = f"{run.replay.equal_count} of {counted(run.replay.check_count, 'checkpoint')} the same, to the bit"
    if not run.replay.check_count:
        made_again = "it has no checkpoint"
    rows = [
        ("Duration", f"{recording.duration_s:.3f} s of simulated time"),
        ("Arena", f"{_arena(recording)}, {arena.width_mm:g} x {arena.height_mm:g} mm"),
        ("Robots", _kinds(run)),
        ("Turrets", "; ".join(turrets)),
        ("Also in it", ", ".join(counted(count, what) for what, count in things.items())),
        ("Seed", str(recording.start.head.seed)),
        ("Thinking time", about.get("thinking", "")),
        ("State at the end", run.replay.state_hash),
        ("Made again for this page", made_again),
        ("Recorded by", f"KiKS {about.get('kiks', 'of an unknown version')}"),
        ("Page made by", f"KiKS {__version__}"),
        ("Recording", recording.log.reader.path.name if is_kept else ""),
    ]
    return [(name, value) for name, value in rows if value]


def _numbers(recording: Recording, found: Findings, run: PageRun) -> list[dict[str, Any]]:
    """Return the table of numbers: what each robot did meanwhile; shares are percent of the time."""
    wire = found.tables["wire"]
    replies = Counter(wire["robot"][~wire["is_sent"]].tolist())
    rows = []
    for number, shares in enumerate(found.shares[:ROBOTS_MAX], 1):
        was_there = number <= run.first.robot_count
        driven_mm = run.replay.sim.travelled_mm(number) - (run.first.travelled_mm(number) if was_there else 0)
        rows.append(
            {
                "number": number,
                "kind": run.replay.sim.specs[number - 1].name,
                "driven_m": driven_mm / 1000,
                "mean_mm_per_s": driven_mm / recording.duration_s if recording.duration_s else 0.0,
                "contacts": run.replay.sim.contacts(number) - (run.first.contacts(number) if was_there else 0),
                "commands": replies[number],
                "shares": [100 * share_ns / max(shares.window_ns, 1) for share_ns in shares],
            }
        )
    return rows


def _programs(recording: Recording) -> list[dict[str, Any]]:
    """Return the programs' texts, each once: cut if they are too long, in colours, with those that had it, "1, 2"."""
    drivers: dict[tuple[str, str], list[str]] = {}
    for numbered, text in recording.programs.items():
        number, _, name = numbered.partition("-")
        drivers.setdefault((name, text), []).append(number)
    programs, character_count = [], 0
    for (name, text), numbers in drivers.items():
        # Lines of blanks take Pygments time that grows with the square of their number.
        clean = "\n".join(line.rstrip() for line in text[:PROGRAM_CHARACTERS_MAX].splitlines())
        character_count += len(clean)
        is_octave = program_kind(PurePath(name)) is ProgramKind.OCTAVE
        colours: Any = OctaveLexer if is_octave else PythonLexer
        colours = colours if character_count <= COLOURED_CHARACTERS_MAX else TextLexer
        lexer = colours(stripnl=False, ensurenl=False)
        markup = Markup(highlight(clean, lexer, HtmlFormatter(nowrap=True)))  # it has escaped the text
        is_cut = len(text) > PROGRAM_CHARACTERS_MAX
        programs.append({"name": name, "drivers": ", ".join(numbers), "text": markup, "is_cut": is_cut})
    return programs


def _wire(wire: Table) -> list[tuple[float, bool, str] | None]:
    """Return the first and the last lines of a wire: when, whether sent to the robot, what. None stands between."""
    first, last = (
        [(time_s, is_sent, _printable(data)) for time_s, _, is_sent, data in rows.tolist()]
        for rows in (wire[:WIRE_LINES], wire[max(len(wire) - WIRE_LINES, WIRE_LINES) :])
    )
    return [*first, None, *last] if len(wire) > 2 * WIRE_LINES else [*first, *last]


def _printable(data: bytes) -> str:
    return _cut(data.decode("latin-1").encode("unicode_escape").decode())


def _cut(text: str) -> str:
    return text if len(text) <= LINE_CHARACTERS_MAX else f"{text[:LINE_CHARACTERS_MAX]}…"

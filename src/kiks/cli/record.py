"""What is left of a run: a picture, a table, a recording, and a line for each robot."""

from __future__ import annotations

import math
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kiks.cli.options import say
from kiks.cli.outputs import PICTURES, output
from kiks.errors import counted
from kiks.model.atomic_files import GrowingFile

if TYPE_CHECKING:
    from kiks.engine.state import State
    from kiks.sim.simulation import Simulation

TABLE_TICKS = 5
"""Ticks of 10 ms between two rows of a robot in a table."""

COLUMNS = ("time_s", "robot", "x_mm", "y_mm", "heading_deg", "driven_mm", "contacts")

PROGRAM_CHARACTERS_MAX = 1 << 20
"""Most characters of a program's text in a recording."""

POINTS_MAX, LEAST_POINTS_MAX = 200_000, 1000
"""Most points of all paths of a picture together, but of each path at least so many."""


Picture = Annotated[
    Path | None,
    typer.Option(
        help="Draw the arena with the paths of all robots here: .png, .svg, .pdf or .jpg.", callback=output(*PICTURES)
    ),
]
Table = Annotated[
    Path | None,
    typer.Option("--csv", help="Write here where each robot is every 50 ms: .csv.", callback=output(".csv")),
]


RecordFile = Annotated[
    Path | None,
    typer.Option(
        "--record",
        help="Record the whole run here, .mcap: kiks replay shows it again.",
        callback=output(".mcap"),
    ),
]


@contextmanager
def recorded(
    sim: Simulation,
    picture: Path | None = None,
    csv: Path | None = None,
    record: Path | None = None,
    programs: Sequence[Path] = (),
) -> Iterator[None]:
    """Keep what happens in a world meanwhile, also if it is interrupted; the run is the same, to the bit.

    Args:
        sim: The world.
        picture: File of the picture that is drawn at the end; none if None.
        csv: File of the table; none if None.
        record: File of the recording; none if None.
        programs: The programs that drive its robots, whose texts the recording keeps.
    """
    # A program may go to another folder.
    picture, csv, record = picture and picture.absolute(), csv and csv.absolute(), record and record.absolute()
    with ExitStack() as at_the_end:
        if record is not None:
            from kiks.recording.recorder import RunRecorder

            texts = {f"{number}-{path.name}": _text_of(path) for number, path in enumerate(programs, 1)}
            at_the_end.enter_context(RunRecorder(sim, record, programs=texts, about={"command": _command_line()}))
        if picture is not None:
            from kiks.export.pictures import Picture

            sim.record_paths(points_max=max(POINTS_MAX // max(sim.robot_count, 1), LEAST_POINTS_MAX))
            at_the_end.callback(lambda: Picture.of_simulation(sim, has_trails=True).save(picture))
        if csv is not None:
            file = GrowingFile(csv, "--csv")
            at_the_end.callback(file.close)
            rows = _Rows(file, sim.world.state)
            sim.world.watch(rows)
            at_the_end.callback(sim.world.unwatch, rows)
            # The last ticks may not have been asked for yet.
            at_the_end.callback(sim.sync)
        yield


@contextmanager
def noting_output(sim: Simulation) -> Iterator[None]:
    """Note the lines that the program of robot 1, in this process, prints meanwhile, if the world is recorded."""
    recorder = sim.loop.recorder
    if recorder is None:
        yield
        return
    with ExitStack() as at_the_end:
        for stream in (sys.stdout, sys.stderr):
            at_the_end.enter_context(_noting(stream, lambda line: recorder.say(0, line)))
        yield


@contextmanager
def _noting(stream: Any, note: Callable[[str], None]) -> Iterator[None]:
    """Note the lines that are written to a stream meanwhile; it stays the same object with the same file."""
    write, unfinished = stream.write, [""]

    def written(text: str) -> int:
        count: int = write(text)
        *lines, unfinished[0] = (unfinished[0] + text).split("\n")
        for line in lines:
            note(line)
        if len(unfinished[0]) > PROGRAM_CHARACTERS_MAX:
            unfinished[0] = ""
        return count

    stream.write = written
    try:
        yield
    finally:
        stream.write = write
        if unfinished[0]:
            note(unfinished[0])


def _text_of(program: Path) -> str:
    """Return the text of a program; nothing if it is no text, or cannot be read, which its start will tell."""
    try:
        text = program.read_text("utf-8", "replace")
    except OSError:
        return ""
    return "" if "\0" in text else text[:PROGRAM_CHARACTERS_MAX]


def _command_line() -> str:
    return shlex.join(["kiks", *sys.argv[1:]])


class _Rows:
    """Writes a row for each robot after each period, as a `kiks.sim.paths.Watcher`.

    Args:
        file: Where they go.
        state: The world, as it is at the first row.
    """

    def __init__(self, file: GrowingFile, state: State) -> None:
        self._file = file
        file.write(",".join(COLUMNS) + "\n")
        self.look(state)

    def look(self, state: State) -> None:
        """Write a row for each robot."""
        self.from_tick = self.due_tick = (state.tick_count // TABLE_TICKS + 1) * TABLE_TICKS
        time_s = f"{state.tick_count / 100:.2f}"
        robots: Any = state.robots[0]
        driven_mm = (robots["forwards_mm"] + robots["backwards_mm"]).tolist()
        places = zip(robots["x_mm"].tolist(), robots["y_mm"].tolist(), robots["heading_rad"].tolist(), strict=True)
        rows = zip(places, driven_mm, robots["contact_count"].tolist(), strict=True)
        lines = []
        for number, ((x_mm, y_mm, heading_rad), way_mm, contacts) in enumerate(rows, 1):
            heading_deg = math.degrees(heading_rad) % 360
            lines.append(f"{time_s},{number},{x_mm:.3f},{y_mm:.3f},{heading_deg:.3f},{way_mm:.3f},{contacts}\n")
        self._file.write("".join(lines))


def tell_run(sim: Simulation, doubt: str = "") -> None:
    """Say what each robot has done, then how the run has ended: its time, seed and state.

    Args:
        sim: The world.
        doubt: Why it might not be repeatable; nothing if it is.
    """
    for number in range(1, sim.robot_count + 1):
        contacts = counted(sim.contacts(number), "contact")
        say(f"robot {number}: {sim.travelled_mm(number) / 1000:.2f} m driven, {contacts}, {sim.time_s:.3f} s")
    repeatable = f"not repeatable: {doubt}" if doubt else f"state {sim.state_hash()}"
    say(f"{sim.time_s:.3f} s simulated, seed {sim.seed}, {repeatable}")

"""What is left of a run: a recording, a file made of it, and a line for each robot."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kiks.cli.options import say
from kiks.cli.outputs import output
from kiks.errors import counted
from kiks.export.kinds import ENDINGS
from kiks.model.replaceable import RECORDING

if TYPE_CHECKING:
    from kiks.model.goal import Goal
    from kiks.sim.simulation import Simulation

UNFINISHED_CHARACTERS_MAX = 1 << 20
"""Most characters of a line that a program has not finished yet."""


def _picture_of_demonstration(given: Mapping[str, Any]) -> Path | None:
    from kiks.cli.job import demonstration_of

    name = None if given["desk"] else demonstration_of(str(given["program"]))
    return Path(f"kiks-{name}.png") if name else None


RecordFile = Annotated[
    Path | None,
    typer.Option(
        "--record",
        help="Record the whole run here, .mcap: kiks replay shows it again.",
        callback=output(".mcap", kind=RECORDING),
    ),
]


ExportFile = Annotated[
    Path | None,
    typer.Option(
        "--export",
        help="Write this file of the run when it ends, as kiks export does: .png, .csv, .mp4, .html ...; kiks-NAME.png "
        "for a demonstration without --desk, if left out.",
        callback=output(*ENDINGS, default=_picture_of_demonstration),
    ),
]


@contextmanager
def recorded(
    sim: Simulation,
    record: Path | None = None,
    export: Path | None = None,
    programs: Sequence[Path] = (),
    goal: Goal | None = None,
) -> Iterator[None]:
    """Record what happens in a world meanwhile, also if it is interrupted; the run is the same, to the bit.

    Args:
        sim: The world.
        record: File of the recording; none if None.
        export: File that is made of the recording at the end; none if None.
        programs: The programs that drive its robots, whose texts the recording keeps.
        goal: What the run is for, which the recording keeps, too.
    """
    if record is None and export is None:
        yield
        return
    from kiks.recording.recorder import RunRecorder, program_texts
    from kiks.recording.recording import Recording

    with ExitStack() as at_the_end:
        if record is None:
            record = Path(at_the_end.enter_context(TemporaryDirectory(prefix="kiks-")), "run.mcap")
        file = record.absolute()  # a program may go to another folder
        if export is not None:
            path = export.absolute()
            at_the_end.callback(lambda: Recording(file).export(path))
        about = {"command": _command_line()} | ({} if goal is None else {"goal": json.dumps(asdict(goal))})
        at_the_end.enter_context(RunRecorder(sim, file, programs=program_texts(programs), about=about))
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
        if len(unfinished[0]) > UNFINISHED_CHARACTERS_MAX:
            unfinished[0] = ""
        return count

    stream.write = written
    try:
        yield
    finally:
        stream.write = write
        if unfinished[0]:
            note(unfinished[0])


def _command_line() -> str:
    return shlex.join(["kiks", *sys.argv[1:]])


def tell_run(sim: Simulation, thinking: str = "none", doubt: str = "") -> dict[str, Any]:
    """Say what each robot has done, then how the run has ended: its time, seed and state, or why not repeatable.

    Returns:
        The same, for `tell_results`.
    """
    robots, doubt = [], "thinking was live" if thinking.startswith("live") else doubt
    for number in range(1, sim.robot_count + 1):
        driven_mm, contacts = float(sim.travelled_mm(number)), sim.contacts(number)
        robots.append({"robot": number, "driven_mm": driven_mm, "contacts": contacts})
        say(f"robot {number}: {driven_mm / 1000:.2f} m driven, {counted(contacts, 'contact')}, {sim.time_s:.3f} s")
    state = None if doubt else sim.state_hash()
    say(f"{sim.time_s:.3f} s simulated, seed {sim.seed}, {f'not repeatable: {doubt}' if doubt else f'state {state}'}")
    ended = {"time_s": sim.time_s, "seed": sim.seed, "state": state, "not_repeatable": doubt or None}
    return ended | {"robots": robots}

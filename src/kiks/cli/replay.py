"""`kiks replay`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kiks.cli.desk import NoWait, open_desk
from kiks.cli.engine_start import ready_engine
from kiks.cli.options import say
from kiks.cli.outputs import has_results, leave_out, tell_results
from kiks.errors import ParameterError, counted
from kiks.units import s_from_ns
from kiks.version import __version__

if TYPE_CHECKING:
    from kiks.recording.recording import Recording


@has_results
def replay(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="A recording (.mcap) of --record or sim.record.", metavar="FILE")],
    check: Annotated[
        bool, typer.Option("--check", help="Make the run again at full speed, and compare each second, to the bit.")
    ] = False,
    start: Annotated[float, typer.Option(help="Where to begin [s of simulated time].", min=0)] = 0.0,
    speed: Annotated[float, typer.Option(help="Simulated seconds per real second.", min=0.001, max=1000)] = 1.0,
    no_wait: NoWait = False,
) -> None:
    """Show a recorded run again on the desk, or check it.

    With --check the run is made again, and compared to the bit. The world on the desk is a living one: its sensors and
    lines can be watched as ever. The time bar below it goes to any time and to each event; from any time a person can
    go on without the recording.

    Example: kiks replay run.mcap --check
    """
    if check:
        leave_out(context, "with --check", "start", "speed")
    from kiks.recording.recording import Recording

    recording = Recording(file)
    ready_engine()
    if not recording.is_whole:
        say(f"the run that wrote {str(file)!r} was killed, or goes on: this is what it has written so far.")
    if check:
        raise typer.Exit(_check(context, recording, file))
    from kiks.desk.server.desk import Desk
    from kiks.desk.server.rights import Rights
    from kiks.recording.replay import Replay
    from kiks.run import Run

    # What goes on until a person lets the recording go: a world that stands still.
    world = Replay(recording.log, recording.log.begin_ns).let_go()
    desk = Desk(Run.in_world(world, speed=speed), Rights.OWNER)
    desk.looking.show_recording(file, recording.time_ns(max(start, s_from_ns(recording.log.begin_ns))))
    open_desk(desk, waits=not no_wait)


def _check(context: typer.Context, recording: Recording, file: Path) -> int:
    """Check a recording, and say what was found; return the exit code."""
    from kiks.recording.replay import check_recording

    found = check_recording(recording.log)
    if found.differs_ns is None and not found.equal_count:
        raise ParameterError(
            f"a recording must have a checkpoint to be compared, but {str(file)!r} has none: its run was "
            "killed before the first one, or goes on."
        )
    version = recording.about.get("kiks", "of an unknown version")
    differs_s = None if found.differs_ns is None else s_from_ns(found.differs_ns)
    equal = f"{counted(found.equal_count, 'checkpoint')} equal"
    lines = [f"The same run again: {equal}, to the bit, in {recording.duration_s:.3f} s of simulated time."]
    if differs_s is not None:
        lines = [f"Another run: {equal}, that of {differs_s:.3f} s differs."]
        if version != __version__:
            lines.append(f"KiKS {version} has recorded it, and this is KiKS {__version__}.")
    results = {"is_same": differs_s is None, "equal_checkpoints": found.equal_count, "differs_s": differs_s}
    tell_results(context, {**results, "recorded_by": version}, lines)
    return 0 if differs_s is None else 1

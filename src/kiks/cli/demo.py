"""`kiks demo`."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kiks.cli.desk import NoWait, WithDesk, open_desk
from kiks.cli.engine_start import ready_engine
from kiks.cli.options import SeedOrOwn, load_arena, say, say_without_world
from kiks.cli.outputs import PICTURES, leave_out, output
from kiks.cli.record import RecordFile, recorded
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import ParameterError, nearest, shown
from kiks.version import __version__

if TYPE_CHECKING:
    from kiks.demos.scene import Scene
    from kiks.learn.champion import Champion

REPORT_S = 2.0
"""Simulated time between two updates of the display [s]: more updates would cost more than the simulation."""


DEMOS = ("avoid", "follow", "clean", "maze", "camera", "race", "swarm", "soccer")
"""The demonstrations."""


def demo(
    context: typer.Context,
    behaviour: Annotated[
        str,
        typer.Argument(help=f"The demo: {', '.join(DEMOS)}, or a champion's file or folder.", metavar="[BEHAVIOUR]"),
    ] = DEMOS[0],
    seconds: Annotated[
        float | None, typer.Option(help="Simulated time [s]; each demonstration's own if left out.", min=1, max=86400)
    ] = None,
    arena: Annotated[
        str | None, typer.Option(help="Arena file (.toml) or picture; each demonstration's own if left out.")
    ] = None,
    seed: SeedOrOwn = None,
    baud: Annotated[
        int | None,
        typer.Option(help="Speed of the simulated serial line [bit/s]; each demonstration's own if left out."),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(
            help="File of the picture; kiks-NAME.png if left out.",
            callback=output(*PICTURES, default=lambda told: Path(f"kiks-{_name_of(told['behaviour'])}.png")),
        ),
    ] = None,
    left: Annotated[
        str | None, typer.Option(help="soccer: the Python program of the left side; with its arguments, in quotes.")
    ] = None,
    right: Annotated[str | None, typer.Option(help="soccer: the program of the right side.")] = None,
    at: Annotated[
        str | None,
        typer.Option(
            help="Of a folder's archive, drive the elite of this place: a number for each axis.", metavar="X,Y"
        ),
    ] = None,
    generation: Annotated[
        int | None, typer.Option(help="In the folder of an evolution: drive one of this generation again.", min=1)
    ] = None,
    rank: Annotated[int, typer.Option(help="With --generation: 1 for its best, 2 for the next.", min=1)] = 1,
    world: Annotated[
        int, typer.Option(help="With --generation: in which of the worlds of its evaluation, from 0.", min=0)
    ] = 0,
    task: Annotated[
        str | None, typer.Option(help="With --generation: the file of the task, if it is a Python file or was moved.")
    ] = None,
    record: RecordFile = None,
    desk: WithDesk = False,
    no_wait: NoWait = False,
) -> None:
    """Run a demonstration at full speed and draw a picture of it.

    avoid: wander and touch nothing. follow: follow walls. clean: push cylinders to the walls. maze: find the way out.
    camera: watch a moving ball. race: drive round a track. swarm: twenty robots spread out.
    soccer: a match of two programs. A champion's file of `kiks evolve`, or its folder: the champion drives in its
    world. With --at X,Y, the elite of that place in the folder's archive drives. With --generation 12 --rank 3, the
    third best of generation 12 drives again as in its evaluation. Of the folder of `kiks evolve pursuit`
    or `football`, both champions drive until they touch, or until a goal.

    Example: kiks demo follow --arena examples/arenas/office.toml --seconds 300
    """
    if behaviour not in DEMOS and not Path(behaviour).exists():
        raise ParameterError(
            f"BEHAVIOUR must be one of {', '.join(DEMOS)}, or a champion's file or folder, but it was "
            f"{shown(behaviour)}.{nearest(behaviour, DEMOS)}"
        )
    is_soccer = behaviour == "soccer"
    leave_out(context, f"with {behaviour}", *(("arena", "baud") if is_soccer else ("left", "right")))
    if not desk:
        leave_out(context, "without --desk", "no_wait")
    # The folder of a co-evolution has champions, but no single one.
    is_contest = any(Path(behaviour).glob("*.toml")) and not Path(behaviour, "champion.toml").exists()
    if generation is None:
        leave_out(context, "without --generation", "rank", "world", "task")
    else:
        leave_out(context, "with --generation", "arena", "seed", "baud", "at")
    for option, value in (("--generation", generation), ("--at", at)):
        if value is not None and (behaviour in DEMOS or is_contest or not Path(behaviour).is_dir()):
            raise ParameterError(
                f"{option} must come with the folder of an evolution of one controller, but with it came "
                f"{shown(behaviour)}."
            )
    name = _name_of(behaviour)
    assert picture is not None  # `output` has filled it in
    ready_engine(as_needed=not (is_soccer or desk))
    if is_soccer:
        from kiks.model.shipped import shipped

        sys.path.append(str(shipped("examples/soccer")))
        importlib.import_module("soccer_command").show_match(
            seconds, seed or 0, (picture, record), left, right, on_desk=desk, waits=not no_wait
        )
        return
    given, default_s = None if arena is None else load_arena(arena), None
    if behaviour in DEMOS:
        from kiks.demos.scenes import SCENES

        scene = SCENES[behaviour](given, seed=seed or 0, baud=baud)
    elif is_contest:
        from kiks.demos.contest import ContestScene

        scene = ContestScene(behaviour, given, seed=seed or 0, baud=baud)
    else:
        from kiks.demos.champion import ChampionScene

        if generation is None:
            champion = _champion(Path(behaviour), at)
            say_without_world(champion, given)
        else:
            champion, default_s = _individual(behaviour, generation, rank, world, task)
        scene = ChampionScene(champion, given, seed=seed, baud=baud)
    seconds = seconds or default_s or scene.seconds

    def work() -> None:
        with recorded(scene.sim, record=record):
            _run(scene, name, seconds, picture)

    if desk:
        from kiks.desk.server.desk import Desk

        open_desk(Desk(scene.sim), work=work, waits=not no_wait)
    else:
        work()


def _name_of(behaviour: str) -> str:
    return behaviour if behaviour in DEMOS else Path(behaviour).resolve().stem


def _individual(folder: str, generation: int, rank: int, world: int, task: str | None) -> tuple[Champion, float]:
    """Return a candidate of an evolution in a world of its evaluation, and for how long it drove there [s]."""
    from kiks.learn import tasks
    from kiks.learn.individual import individual_of

    given = None if task is None else tasks.load(task)
    found = individual_of(folder, generation, rank=rank, world=world, task=given)
    typer.echo(f"Candidate {found.candidate} of generation {generation}: rank {rank}, fitness {found.fitness:.4f}")
    if found.kiks != __version__:
        say(f"KiKS {found.kiks} has evaluated it. This is KiKS {__version__}, where it may drive differently.")
    if found.champion.timing.baud is None:
        say(f"it was evaluated without a serial line; here it drives on one of {found.champion.baud} baud.")
    return found.champion, found.seconds


def _champion(path: Path, at: str | None) -> Champion:
    """Return the champion of a file or of a folder; with `at`, the elite there of the folder's archive."""
    from kiks.learn.archive import Archive
    from kiks.learn.champion import Champion
    from kiks.learn.evolution_log import CHAMPION

    if at is None:
        return Champion.load(path / CHAMPION if path.is_dir() else path)
    try:
        place = [float(word) for word in at.split(",")]
    except ValueError:
        raise ParameterError(f"--at must be numbers such as 300,450, but it was {shown(at)}.") from None
    archive = Archive.load(path)
    elite = archive.elite_at(*place)
    where = ", ".join(f"{axis.measure} {elite.values[axis.measure]:.4g}" for axis in archive.axes)
    typer.echo(f"The elite nearest to {at}: {where}, fitness {elite.fitness:.4g}, of generation {elite.generation}.")
    return archive.champion_of(elite)


def _run(scene: Scene, behaviour: str, total_s: float, picture: Path) -> None:
    """Run a demonstration to its end, print the result, and draw it."""
    from time import perf_counter

    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    from kiks.export.pictures import Picture

    end_as_with_ctrl_c()
    sim = scene.sim
    sim.record_paths(scene.slice_s)
    working_s = told_s = 0.0

    def report() -> str:
        speedup = sim.time_s / working_s if working_s else 0.0
        return f"{sim.time_s:6.1f} s   {speedup:5.0f} x real time   {scene.result()}"

    columns = (TextColumn(f"{behaviour} in '{sim.arena.name}'"), BarColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=Console(), transient=True) as progress:
        task = progress.add_task(report(), total=total_s)
        start_s = perf_counter()
        try:
            for _ in scene.slices(total_s):
                working_s += perf_counter() - start_s
                if sim.time_s - told_s >= REPORT_S:
                    told_s = sim.time_s
                    progress.update(task, completed=min(sim.time_s, total_s), description=report())
                start_s = perf_counter()
        except KeyboardInterrupt:
            say(f"{behaviour}: {report().strip()}. It was interrupted.")
            raise
    Picture.of_simulation(sim, has_trails=True).save(picture)
    typer.echo(f"{behaviour}: {report().strip()}")
    typer.echo(f"Picture: {picture}   Seed {sim.seed}, state {sim.state_hash()}: the same on every computer.")

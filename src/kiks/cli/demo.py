"""`kiks demo`."""

from __future__ import annotations

import enum
from pathlib import Path
from typing import Annotated, Any

import typer

from kiks.cli.engine_start import ready_engine
from kiks.cli.options import ArenaFile, Seed, load_arena

SLICE_S = 0.1
"""Simulated time between two points of the drawn path [s]."""

SLICES_A_REPORT = 20
"""Points of the path between two updates of the display: more would cost more than the simulation."""


class Behaviour(enum.StrEnum):
    """The demonstrations there are."""

    AVOID = "avoid"
    FOLLOW = "follow"


def demo(
    behaviour: Annotated[Behaviour, typer.Argument(help="What the robot does.")] = Behaviour.AVOID,
    seconds: Annotated[float, typer.Option(help="Simulated time [s].", min=1, max=86400)] = 120.0,
    arena: ArenaFile = None,
    seed: Seed = 0,
    baud: Annotated[int, typer.Option(help="Speed of the simulated serial line [bit/s].")] = 9600,
    picture: Annotated[Path | None, typer.Option(help="Where the picture of the path goes.")] = None,
) -> None:
    """Show a robot at work: it avoids obstacles or follows a wall, as fast as this computer can.

    Example: kiks demo follow --arena examples/arenas/office.toml --seconds 300
    """
    ready_engine()
    from kiks.demos.avoid import Avoid
    from kiks.demos.follow import Follow

    step = {Behaviour.AVOID: Avoid().step, Behaviour.FOLLOW: Follow().step}[behaviour]
    run_demo(behaviour.value, step, seconds=seconds, arena=arena, seed=seed, baud=baud, picture=picture)


def run_demo(
    name: str, step: Any, *, seconds: float, arena: str | None, seed: int, baud: int, picture: Path | None
) -> None:
    """Drive one robot with a behaviour, show the progress, and leave a picture."""
    from time import perf_counter

    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    from kiks.client.khepera import Khepera
    from kiks.drawing import draw_run, save_picture
    from kiks.sim.simulation import Simulation

    place = load_arena(arena)
    sim = Simulation(place, seed=seed)
    port = sim.port(1)
    port.baudrate = baud
    robot = Khepera(port)
    path = [sim.pose(1)]
    working_s = 0.0

    def report() -> str:
        speedup = sim.time_s / working_s if working_s else 0.0
        pace = f"{sim.time_s:6.1f} s   {speedup:5.0f} x real time"
        return f"{pace}   {sim.travelled_mm(1) / 1000:6.2f} m   {sim.contacts(1)} contacts"

    columns = (TextColumn(f"{name} in '{place.name}'"), BarColumn(), TextColumn("{task.description}"))
    console = Console()
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task(report(), total=seconds)
        while sim.time_s < seconds:
            start_s = perf_counter()
            until_s = sim.time_s + SLICE_S
            while sim.time_s < until_s:
                step(robot)
            working_s += perf_counter() - start_s
            path.append(sim.pose(1))
            if len(path) % SLICES_A_REPORT == 0:
                progress.update(task, completed=min(sim.time_s, seconds), description=report())
    target = picture or Path(f"kiks-{name}.png")
    save_picture(draw_run(place, path, diameter_mm=sim.spec.body.diameter_mm), target)
    typer.echo(f"{name}: {report().strip()}")
    typer.echo(f"Path: {target}   Seed {seed}, state {sim.state_hash()}: the same on every computer.")

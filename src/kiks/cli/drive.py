"""`kiks drive`, and champions in `kiks run`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kiks.cli.desk import open_desk
from kiks.cli.limits import LimitReached, Limits
from kiks.cli.options import World, load_arena, say, say_without_world
from kiks.cli.record import recorded, tell_run
from kiks.ending import end_as_with_ctrl_c


def drive(
    champion: Annotated[Path, typer.Argument(help="A champion's file, written by `kiks evolve`.")],
    port: Annotated[
        list[str], typer.Option(help="Port of a robot: /dev/ttyUSB0, socket://HOST:PORT, ...; once per robot.")
    ],
    seconds: Annotated[float, typer.Option(help="How long it drives [s].", min=0)] = 60.0,
) -> None:
    """Let a champion drive real robots, or any that answer on a port, and stop them at the end or at Ctrl-C.

    Example: kiks drive champion.toml --port /dev/ttyUSB0 --seconds 180
    """
    from kiks.learn.champion import Champion

    end_as_with_ctrl_c()
    loop_count = Champion.load(champion).drive(port, seconds=seconds)
    typer.echo(f"kiks: {loop_count} loops in {seconds:g} s")


def run_champion(
    file: Path,
    world: World,
    seconds: float,
    limits: Limits,
    files: tuple[Path | None, Path | None],
    *,
    on_desk: bool,
    waits: bool,
) -> None:
    """Let a champion drive all robots of a simulation, and print the result; `files` are those of `recorded`."""
    from kiks.learn.champion import Champion

    champion = Champion.load(file)
    given = None if world.arena is None else load_arena(world.arena)
    say_without_world(champion, given)
    sim, ports = champion.simulation(given, robots=world.robots, seed=world.seed)
    end_as_with_ctrl_c()

    def work() -> None:
        doubt = "it was interrupted"
        with recorded(sim, *files, [file]):
            try:
                with limits.kept(sim, LimitReached.stop):
                    loop_count = champion.drive(ports, seconds=seconds)
                say(f"{loop_count} loops")
                doubt = ""
            except LimitReached as end:
                say(end.message)
                raise typer.Exit(end.code) from None
            finally:
                tell_run(sim, limits.doubt or doubt)

    if on_desk:
        from kiks.desk.server.desk import Desk

        open_desk(Desk(sim), work=work, waits=waits)
    else:
        work()

"""`kiks warmup`."""

from __future__ import annotations

import typer

from kiks.cli.compile_note import note_compiling


def warmup() -> None:
    """Compile the engine now, so that the next start is quick.

    Example: kiks warmup
    """
    from time import perf_counter

    note_compiling()
    start_s = perf_counter()
    compile_everything()
    typer.echo(f"The engine is ready ({perf_counter() - start_s:.1f} s).")


def compile_everything() -> None:
    """Call every compiled function once, by way of what users call."""
    from kiks.client.khepera import Khepera
    from kiks.model.arena import Arena
    from kiks.sim.simulation import Simulation

    sim = Simulation(Arena.box(200, 200))
    robot = Khepera(sim.port(1))
    robot.set_speed(1, 1)
    robot.set_pwm(1, 1)
    robot.set_encoders(0, 0)
    robot.move_to(1, 1)
    robot.status()
    robot.proximity()
    robot.ambient()
    sim.proximity(1)
    sim.place(1, *sim.pose(1))

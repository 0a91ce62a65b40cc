"""Compiles the engine at the first start, and tells the user who waits for it."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from typing import Any

import typer


def ready_engine(*, as_needed: bool = False) -> None:
    """Compile the engine if it is not in the cache, and print a line before that.

    Args:
        as_needed: Whether to leave each kernel to its first call. That suits a run that calls few of them and has no
            other program waiting.
    """
    from kiks.engine.code_cache import is_compiled
    from kiks.engine.compiling import LAST

    if not is_compiled("advance" if as_needed else LAST):
        typer.echo("Compiling the engine for this computer: once, a minute or so ...", err=True)
        if not as_needed:
            compile_everything()


def ready_batch() -> None:
    """Compile the engine, and print a line if the batch, which is compiled at its first run, is not in the cache."""
    from kiks.engine.code_cache import is_compiled

    ready_engine()
    if not is_compiled("roll_out"):
        typer.echo("Compiling the batch for this computer: once, half a minute or so ...", err=True)


def compile_all() -> None:
    """Compile the engine and the batch; side by side, where there are processors for it."""
    if len(os.sched_getaffinity(0)) == 1:
        compile_everything()
        compile_batch()
        return
    # Both fill the same cache. Should the other process fail, this one compiles what is missing, and tells why it must.
    program = "from kiks.cli.engine_start import help_to_compile; help_to_compile()"
    streams: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen([sys.executable, "-c", program], **streams) as other:
        try:
            compile_everything()
            other.wait()
        finally:
            other.kill()
    compile_batch()


def help_to_compile() -> None:
    """Compile the batch for the process that has started this one; end when it ends."""

    def end_with_it() -> None:
        sys.stdin.read()
        os._exit(1)

    threading.Thread(target=end_with_it, daemon=True).start()
    compile_batch()


def compile_batch() -> None:
    """Run and step a batch, with lone robots and with robots that may collide."""
    from kiks.batch.batch import Batch
    from kiks.control.controllers import linear
    from kiks.model.arena import Arena

    controller = linear()
    for robots in (1, 2):
        batch = Batch(Arena.box(300, 300), 1, robots=robots)
        batch.run(controller, [0.0] * (controller.parameter_count or 0), seconds=0.1)
        batch.reset()


def compile_everything() -> None:
    """Call every compiled function once, through the public functions."""
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
    sim.ambient(1)
    sim.proximity_at(1, sim.poses())
    sim.look()
    sim.explain(1, 0)
    sim.explain_light(1, 0)
    sim.fit(1, "k213")
    robot.image()
    sim.image(1)
    sim.place(1, *sim.pose(1))
    sim.fit(1, "gripper")
    robot.turret(1, "G")
    sim.fit(1, "battle")
    robot.turret(99, "S")
    sim.add_cylinder(40, 40)
    sim.run(0.1)
    Simulation(Arena.box(200, 200), response="fast")  # last, for it calls `kiks.engine.compiling.LAST`

"""Compiles the engine at the first start, and tells the user who waits for it."""

from __future__ import annotations

import contextlib
import os
import queue
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from kiks.sim.simulation import Simulation


def ready_engine(*, as_needed: bool = False) -> None:
    """Compile the engine if it is not in the cache, and print a line before that.

    Args:
        as_needed: Whether to compile only what one robot among walls needs, in half of the time.
    """
    from kiks.engine.code_cache import is_compiled
    from kiks.engine.compiling import LAST

    if not is_compiled("advance" if as_needed else LAST):
        typer.echo("Compiling the engine for this computer: once, a minute or so ...", err=True)
        if not as_needed:
            _compile_together(_OF_ENGINE)
            compile_everything()
    if as_needed:
        # Now, as compiling within the run would take from the chance of its program.
        _roam()


def ready_batch() -> None:
    """Compile the engine, and print a line if the batch, which is compiled at its first run, is not in the cache."""
    from kiks.engine.code_cache import is_compiled

    ready_engine()
    if not is_compiled("roll_out"):
        typer.echo("Compiling the batch for this computer: once, half a minute or so ...", err=True)


def compile_all() -> None:
    """Compile the engine and the batch, side by side, where there are processors for it."""
    _compile_together(range(len(_PIECES)))
    compile_everything()
    compile_batch()


def compile_everything() -> None:
    """Call every compiled function of the engine once, through the public functions."""
    from kiks.model.arena import Arena
    from kiks.sim.simulation import Simulation

    for number in _OF_ENGINE:
        _PIECES[number]()
    Simulation(Arena.box(200, 200), response="fast")  # last, for it calls `kiks.engine.compiling.LAST`


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


def help_to_compile() -> None:
    """Compile the pieces whose numbers come in, a line each; answer each with a line, and end with the input."""
    orders: queue.SimpleQueue[int] = queue.SimpleQueue()

    def receive() -> None:
        for line in sys.stdin:
            orders.put(int(line))
        os._exit(0)

    threading.Thread(target=receive, daemon=True).start()
    while True:
        _PIECES[orders.get()]()
        print(flush=True)


def _compile_together(numbers: Sequence[int]) -> None:
    """Compile pieces by this process and one more for each other processor; do nothing where there is no other.

    All fill the same cache. This process begins with the first piece, the others with the last: neighbours in the list
    call the same kernels, and each process compiles those for itself. A piece whose process fails is left out.
    """
    from kiks.ports.file_descriptors import processor_count
    from kiks.ports.program_process import python_line

    left = deque(numbers)

    def feed(helper: subprocess.Popen[bytes]) -> None:
        assert helper.stdin
        assert helper.stdout
        with contextlib.suppress(IndexError, OSError, ValueError):
            while True:
                # A buffer would keep what a dead process does not take, and then could not be closed.
                os.write(helper.stdin.fileno(), b"%d\n" % left.pop())
                if not helper.stdout.readline():
                    break

    line = python_line("-c", "from kiks.cli.engine_start import help_to_compile; help_to_compile()")
    streams: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with contextlib.ExitStack() as stack:
        feeders = []
        for _ in range(min(processor_count(), _MOST_PROCESSES) - 1):
            helper = stack.enter_context(subprocess.Popen(line, **streams))
            stack.callback(helper.kill)
            feeders.append(threading.Thread(target=feed, args=(helper,), daemon=True))
            feeders[-1].start()
        if not feeders:
            return
        with contextlib.suppress(IndexError):
            while True:
                _PIECES[left.popleft()]()
        for feeder in feeders:
            feeder.join()


def _simulation() -> Simulation:
    from kiks.model.arena import Arena
    from kiks.sim.simulation import Simulation

    return Simulation(Arena.box(200, 200))


def _roam() -> None:
    from kiks.client.khepera import Khepera

    robot = Khepera(_simulation().port(1))
    robot.proximity()
    robot.set_speed(1, 1)
    robot.pause(0.1)


def _drive() -> None:
    from kiks.client.khepera import Khepera

    sim = _simulation()
    robot = Khepera(sim.port(1))
    robot.set_speed(1, 1)
    robot.set_pwm(1, 1)
    robot.set_encoders(0, 0)
    robot.move_to(1, 1)
    robot.status()
    sim.place(1, *sim.pose(1))
    sim.fit(1, "gripper")
    robot.turret(1, "G")
    sim.fit(1, "battle")
    robot.turret(99, "S")
    sim.add_cylinder(40, 40)
    sim.run(0.1)


def _take_image() -> None:
    sim = _simulation()
    sim.fit(1, "k213")
    sim.image(1)


def _look() -> None:
    _simulation().look()


def _explain() -> None:
    sim = _simulation()
    sim.explain(1, 0)
    sim.explain_light(1, 0)


def _read_light() -> None:
    _simulation().ambient(1)


def _read_proximity() -> None:
    sim = _simulation()
    sim.proximity(1)
    sim.proximity_at(1, sim.poses())


_PIECES = (_drive, _take_image, _look, _explain, _read_light, _read_proximity, compile_batch)
"""What one process compiles in one go. The longest are at the ends: time passes in them, and ticks take longest."""

_OF_ENGINE = tuple(number for number, piece in enumerate(_PIECES) if piece is not compile_batch)

_MOST_PROCESSES = 4
"""More would compile the same kernels again rather than others."""

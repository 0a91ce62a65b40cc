"""Compiles the engine at the first start, on all processors. The compiler itself says so (`kiks.engine.compiling`)."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from kiks.ending import end_with_parent

if TYPE_CHECKING:
    from kiks.sim.simulation import Simulation


def ready_engine(*, as_needed: bool = False) -> None:
    """Compile the engine if it is not in the cache.

    Args:
        as_needed: Whether to compile only what one robot among walls needs, in a third of the time.
    """
    from kiks.engine.code_cache import is_compiled
    from kiks.engine.compiling import LAST

    if as_needed:
        if not is_compiled("advance"):
            _compile_together((_roam, _sense))
        # Now, as compiling within the run would take from the chance of its program.
        _roam()
        _sense()
    elif not is_compiled(LAST):
        _compile_together([piece for piece in _PIECES if piece is not compile_batch])
        compile_everything()


def ready_batch() -> None:
    """Compile the engine and the batch if they are not in the cache."""
    from kiks.engine.code_cache import is_compiled

    if not is_compiled("roll_out"):
        compile_all()


def compile_all() -> None:
    """Compile the engine and the batch, side by side, where there are processors for it."""
    from kiks.engine.code_cache import is_compiled
    from kiks.engine.compiling import LAST

    if not (is_compiled(LAST) and is_compiled("roll_out")):
        _compile_together(_PIECES)
    compile_everything()
    compile_batch()


def compile_everything() -> None:
    """Call every compiled function of the engine once, through the public functions."""
    from kiks.model.arena import Arena
    from kiks.sim.simulation import Simulation

    for piece in _PIECES:
        if piece is not compile_batch:
            piece()
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
    """Call the functions whose names come in, a line each; answer each with a line, and end with the input."""
    end_with_parent()  # in the middle of a piece, too
    for line in sys.stdin:
        globals()[line.strip()]()
        print(flush=True)


def _compile_together(pieces: Iterable[Callable[[], None]]) -> None:
    """Compile pieces by this process and one more for each other processor; do nothing where there is no other.

    All fill the same cache. This process begins with the first piece, the others with the last: each piece needs the
    machine code of those before it rather than of those after it. A piece whose process fails is left out.
    """
    from kiks.ports.program_process import python_line
    from kiks.ports.resources import processor_count

    left = deque(pieces)

    def feed(helper: subprocess.Popen[bytes]) -> None:
        assert helper.stdin
        assert helper.stdout
        with contextlib.suppress(IndexError, OSError, ValueError):
            while True:
                # A buffer would keep what a dead process does not take, and then could not be closed.
                os.write(helper.stdin.fileno(), f"{left.pop().__name__}\n".encode())
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
                left.popleft()()
        for feeder in feeders:
            feeder.join()


def _simulation() -> Simulation:
    from kiks.model.arena import Arena
    from kiks.sim.simulation import Simulation

    return Simulation(Arena.box(200, 200))


def _roam() -> None:
    from kiks.client.khepera import Khepera

    robot = Khepera(_simulation().port(1))
    robot.set_speed(1, 1)
    robot.pause(0.1)


def _sense() -> None:
    from kiks.sim.sensors import readings

    sim = _simulation()
    sim.proximity(1)
    # Of the other senses, a debugger looks at this one at each stop.
    readings(sim.world, 0, "positions", False)


def _drive() -> None:
    from kiks.client.khepera import Khepera
    from kiks.model.walls import Zone
    from kiks.sim.simulation import Simulation

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
    # The tables of a floor are made of one that is not the same everywhere.
    Simulation(replace(sim.arena, zones=Zone(line_mm=((60, 60), (90, 60)))))


def _take_image() -> None:
    sim = _simulation()
    sim.fit(1, "k213")
    sim.image(1)


def _look() -> None:
    from kiks.export.frames import pack_frame

    sim = _simulation()
    sim.look()
    pack_frame(sim, scene=0)


def _explain() -> None:
    sim = _simulation()
    sim.explain(1, 0)
    sim.explain_light(1, 0)


def _read_light() -> None:
    from kiks.export.light import light_map

    sim = _simulation()
    sim.ambient(1)
    sim.add_lamp(100, 100)
    light_map(sim.arena, sim.world.lamps, sim.specs)


def _read_elsewhere() -> None:
    sim = _simulation()
    sim.proximity_at(1, sim.poses())


_PIECES = (_roam, _drive, compile_batch, _look, _explain, _take_image, _read_elsewhere, _read_light, _sense)
"""What one process compiles in one go."""

_MOST_PROCESSES = 4
"""More would compile the same kernels again rather than others."""

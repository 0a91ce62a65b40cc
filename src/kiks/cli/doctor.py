"""`kiks doctor`."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import typer

from kiks.cli.outputs import has_results, tell_results
from kiks.table import Table

if TYPE_CHECKING:
    from kiks.client.khepera import Khepera

LIBRARIES = ("numba", "llvmlite", "numpy", "scipy", "pyserial", "nicegui", "matplotlib", "greenlet")
"""Libraries on whose versions most depends."""

EXTRAS = {
    "film": ("av", "films"),
    "learn": ("ribs", "evolution, Gymnasium and PettingZoo"),
    "ray": ("ray", "evolution on several computers"),
    "tournament": ("openskill", "ratings of tournaments"),
    "render": ("vtk", "films in space and photos"),
}
"""A library of each extra, and what the extra is for."""

PROGRAMS = {
    "octave": (("octave", "octave-cli"), "programs for the Matlab KiKS"),
    "a browser": (("chromium", "google-chrome", "firefox", "firefox-esr"), "the desk"),
    "make": (("make",), "developers"),
}
"""Programs, by the names that they may have, and what they are for."""

REFERENCE_SPEED, REFERENCE = 2000, "2 cores of an AMD EPYC, benchmarks/results/2026-11-26-light.md"
"""How many times faster than the robot a program on a line in memory is on the computer of the documents."""

LOOPS = 4000
"""Loops of the program that is measured."""


class Part(NamedTuple):
    """What may be installed.

    Attributes:
        name: Its name.
        is_there: Whether it is.
        use: What it is for.
        cure: How to get it.
    """

    name: str
    is_there: bool
    use: str
    cure: str


@has_results
def doctor(context: typer.Context) -> None:
    """Print what is installed, what is missing, and how fast it is.

    Example: kiks doctor
    """
    import importlib.metadata
    import platform

    from kiks.version import __version__

    versions = {name: importlib.metadata.version(name) for name in LIBRARIES}
    simulated_s, real_s = driven_s(_wander, LOOPS)
    parts, speed = [*_parts()], simulated_s / real_s
    share = 100 * speed / REFERENCE_SPEED
    found = {
        "kiks": __version__,
        "folder": str(Path(__file__).parents[1]),
        "python": platform.python_version(),
        "environment": sys.prefix,
        "system": platform.platform(),
        "libraries": versions,
        "parts": [part._asdict() for part in parts],
        "speed": speed,
        "reference_speed": REFERENCE_SPEED,
    }
    lines = [
        f"KiKS {found['kiks']} in {found['folder']}",
        f"Python {found['python']} in {sys.prefix}, {found['system']}",
        ", ".join(f"{name} {version}" for name, version in versions.items()),
        str(Table((), map(_row, parts), left_count=3)),
        f"A program drives {speed:.0f} times as fast as the robot: {share:.0f} % of the reference ({REFERENCE}).",
    ]
    tell_results(context, found, lines)


def _row(part: Part) -> tuple[str, str, str]:
    name, is_there, use, cure = part
    return ("found", name, use) if is_there else ("missing", name, f"{use}: {cure}")


def _parts() -> Iterator[Part]:
    import importlib.util

    from kiks.engine.code_cache import cache_folders, is_compiled
    from kiks.engine.compiling import LAST
    from kiks.errors import KiksError
    from kiks.ports.sandbox import Sandbox, limits_in_force

    for extra, (library, use) in EXTRAS.items():
        is_there = importlib.util.find_spec(library) is not None
        yield Part(f"extra {extra}", is_there, f"for {use}", f"pip install 'kiks[{extra}]'")
    for name, (commands, use) in PROGRAMS.items():
        yield Part(name, any(map(shutil.which, commands)), f"for {use}", "install it with your system's packages")
    use, why = "programs of others: kiks grade, room and tournament", ""
    try:
        with Sandbox() as sandbox:
            sandbox.warm()
    except KiksError as error:
        why = str(error)
    yield Part("a sandbox", not why, f"{use}; it holds by {limits_in_force()}" if not why else use, why)
    is_there = is_compiled(LAST) and is_compiled("roll_out")
    yield Part("the compiled engine", is_there, f"in {next(cache_folders(), None)}", "kiks warmup compiles it")


def driven_s(step: Callable[[Khepera], object], loops: int, first_loops: int = 200) -> tuple[float, float]:
    """Return the simulated and the real time [s] that a program on a line in memory takes.

    Args:
        step: A loop of the program, which asks the robot and tells it what to do.
        loops: How often it is called.
        first_loops: How often it is called before that; compiles or loads the engine.
    """
    from time import perf_counter

    from kiks.client.khepera import Khepera
    from kiks.model.arena import Arena
    from kiks.sim.simulation import Simulation

    sim = Simulation(Arena.load("office"), seed=1)
    robot = Khepera(sim.port(1))
    for _ in range(first_loops):
        step(robot)
    begin_s, start_s = sim.time_s, perf_counter()
    for _ in range(loops):
        step(robot)
    return sim.time_s - begin_s, perf_counter() - start_s


def _wander(robot: Khepera) -> None:
    near = max(robot.proximity()[1:5])
    robot.set_speed(*((4, -4) if near > 200 else (6, 6)))

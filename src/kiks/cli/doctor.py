"""`kiks doctor`."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import typer

LIBRARIES = ("numba", "llvmlite", "numpy", "scipy", "pyserial", "nicegui", "matplotlib", "greenlet")
"""Libraries on whose versions most depends."""

EXTRAS = {
    "film": ("av", "films"),
    "learn": ("ribs", "evolution, Gymnasium and PettingZoo"),
    "ray": ("ray", "evolution on several computers"),
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

SECONDS = 200.0
"""Simulated time of the measurement [s]."""


def doctor() -> None:
    """Print what is installed, what is missing and what for, and how fast this computer is.

    Example: kiks doctor
    """
    import importlib.metadata
    import importlib.util
    import platform

    from kiks.engine.code_cache import cache_folders, is_compiled
    from kiks.engine.compiling import LAST
    from kiks.version import __version__

    typer.echo(f"KiKS {__version__} in {Path(__file__).parents[1]}")
    typer.echo(f"Python {platform.python_version()} in {sys.prefix}, {platform.platform()}")
    typer.echo(", ".join(f"{name} {importlib.metadata.version(name)}" for name in LIBRARIES))
    for extra, (library, use) in EXTRAS.items():
        found = importlib.util.find_spec(library) is not None
        _say(found, f"extra {extra}", f"for {use}", f"pip install 'kiks[{extra}]'")
    for name, (commands, use) in PROGRAMS.items():
        _say(any(map(shutil.which, commands)), name, f"for {use}", "install it with your system's packages")
    has_engine = is_compiled(LAST) and is_compiled("roll_out")
    folder = next(cache_folders(), None)
    _say(has_engine, "the compiled engine", f"in {folder}", "kiks warmup compiles it")
    speed = _speed()
    share = 100 * speed / REFERENCE_SPEED
    typer.echo(
        f"A program drives {speed:.0f} times as fast as the robot: {share:.0f} % of the reference ({REFERENCE})."
    )


def _say(is_there: bool, name: str, use: str, cure: str) -> None:
    typer.echo(f"{'found  ' if is_there else 'missing'}  {name}, {use}{'' if is_there else ': ' + cure}")


def _speed() -> float:
    """Return how many times faster than the robot a program in memory is that reads sensors and sets speeds."""
    from time import perf_counter

    from kiks.client.khepera import Khepera
    from kiks.model.arena import Arena
    from kiks.sim.simulation import Simulation

    sim = Simulation(Arena.load("office"), seed=1)
    robot = Khepera(sim.port(1))

    def drive(until_s: float) -> None:
        while sim.time_s < until_s:
            near = max(robot.proximity()[1:5])
            robot.set_speed(*((4, -4) if near > 200 else (6, 6)))

    drive(1.0)  # compiles, or loads
    begin_s, start_s = sim.time_s, perf_counter()
    drive(begin_s + SECONDS)
    return (sim.time_s - begin_s) / (perf_counter() - start_s)

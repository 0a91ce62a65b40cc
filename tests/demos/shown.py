"""Runs a demonstration of one program in this process, as `kiks demo` does."""

from dataclasses import replace
from typing import Any

from kiks.model.project import Project
from kiks.model.shipped import demonstrations
from kiks.run import Run
from kiks.script.runner import run_here
from kiks.sim.from_project import simulation_of
from kiks.sim.simulation import Simulation


def world_of(name: str, **changes: Any) -> Simulation:
    """Return the world of a demonstration at its start; `changes` are those of its project."""
    path = demonstrations()[name]
    return simulation_of(replace(Project.load(path), **changes), path.parent)


def run(sim: Simulation, name: str, seconds: float | None = None) -> int:
    """Run its program in that world, for its own time if none is given, and return the program's exit code."""
    path = demonstrations()[name]
    with Run.of(Project.load(path), path.parent, sim=sim) as run:
        run.seconds = seconds or run.seconds
        if run.supervisor is not None:
            run.supervise()
        command = run.commands[0]
        assert command is not None
        return run_here(sim, command.program, command.arguments, {}, limited=run.limited)


def shown(name: str, seconds: float | None = None, **changes: Any) -> Simulation:
    """Return the world of a demonstration at its end."""
    sim = world_of(name, **changes)
    assert run(sim, name, seconds) == 0
    return sim

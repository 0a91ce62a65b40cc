"""Runs a demonstration of one program in this process, as `kiks demo` does."""

from dataclasses import replace
from functools import partial
from typing import Any

from kiks.cli.limits import Limits
from kiks.model.project import Project
from kiks.model.shipped import demonstrations
from kiks.ports.program_command import project_commands, project_supervisor
from kiks.script.runner import run_here
from kiks.sim.from_project import simulation_of
from kiks.sim.simulation import Simulation
from kiks.sim.supervision import Supervision


def world_of(name: str, **changes: Any) -> Simulation:
    """Return the world of a demonstration at its start; `changes` are those of its project."""
    path = demonstrations()[name]
    return simulation_of(replace(Project.load(path), **changes), path.parent)


def run(sim: Simulation, name: str, seconds: float | None = None) -> int:
    """Run its program in that world, for its own time if none is given, and return the program's exit code."""
    path = demonstrations()[name]
    project = Project.load(path)
    command = project_commands(project, path.parent)[0]
    supervisor = project_supervisor(project, path.parent)
    supervision = None if supervisor is None else Supervision(sim, supervisor)
    limits = Limits(seconds or project.seconds, None)
    try:
        return run_here(sim, command.program, command.arguments, {}, limited=partial(limits.kept, sim))
    finally:
        if supervision is not None:
            supervision.close()


def shown(name: str, seconds: float | None = None, **changes: Any) -> Simulation:
    """Return the world of a demonstration at its end."""
    sim = world_of(name, **changes)
    assert run(sim, name, seconds) == 0
    return sim

"""KiKS Is a Khepera Simulator.

    import kiks

    sim = kiks.Simulation(kiks.Arena.from_image("maze.png"), seed=1)
    robot = kiks.Khepera(sim.port(1))
    robot.set_speed(5, 5)

With `kiks` imported, pyserial knows simulated ports too: `serial.serial_for_url("kiks://1")`.
Every public call raises a `KiksError` for an argument or a file that it cannot use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from kiks.version import __version__  # before all others, because it says which Python it must be

# isort: split

import serial  # noqa: TID253  (pyserial has to be told where our plug-in is)

from kiks import upwards

if TYPE_CHECKING:
    from kiks.batch.batch import Batch
    from kiks.batch.loop_timing import Timing
    from kiks.client.drive import drive
    from kiks.client.khepera import Khepera, Status
    from kiks.client.matlab_functions import kclose, kopen, ksend, ktime, pause
    from kiks.control import controllers, measures
    from kiks.control.controller import Controller, controller
    from kiks.control.measure import Measure, measure
    from kiks.errors import ArenaError, KiksError, LinkError, ParameterError
    from kiks.learn import tasks
    from kiks.learn.archive import Archive
    from kiks.learn.champion import Champion
    from kiks.learn.coevolution import Coevolution
    from kiks.learn.contest import Contest, Side
    from kiks.learn.evolution import Evolution
    from kiks.learn.exam import Exam
    from kiks.learn.executors import executor_for
    from kiks.learn.policy_export import champion_of_policy
    from kiks.learn.task import Axis, Task
    from kiks.model.arena import Arena
    from kiks.model.robot import RobotSpec
    from kiks.recording.recording import Recording
    from kiks.sim.simulation import Simulation

__all__ = [
    "Archive",
    "Arena",
    "ArenaError",
    "Axis",
    "Batch",
    "Champion",
    "Coevolution",
    "Contest",
    "Controller",
    "Evolution",
    "Exam",
    "Khepera",
    "KiksError",
    "LinkError",
    "Measure",
    "ParameterError",
    "Recording",
    "RobotSpec",
    "Side",
    "Simulation",
    "Status",
    "Task",
    "Timing",
    "__version__",
    "champion_of_policy",
    "controller",
    "controllers",
    "drive",
    "executor_for",
    "kclose",
    "kopen",
    "ksend",
    "ktime",
    "measure",
    "measures",
    "pause",
    "tasks",
]

_HOMES = {
    "Archive": "kiks.learn.archive",
    "Arena": "kiks.model.arena",
    "ArenaError": "kiks.errors",
    "Axis": "kiks.learn.task",
    "Batch": "kiks.batch.batch",
    "Champion": "kiks.learn.champion",
    "Coevolution": "kiks.learn.coevolution",
    "Contest": "kiks.learn.contest",
    "Controller": "kiks.control.controller",
    "Evolution": "kiks.learn.evolution",
    "Exam": "kiks.learn.exam",
    "Khepera": "kiks.client.khepera",
    "KiksError": "kiks.errors",
    "LinkError": "kiks.errors",
    "Measure": "kiks.control.measure",
    "ParameterError": "kiks.errors",
    "Recording": "kiks.recording.recording",
    "RobotSpec": "kiks.model.robot",
    "Side": "kiks.learn.contest",
    "Simulation": "kiks.sim.simulation",
    "Status": "kiks.client.khepera",
    "Task": "kiks.learn.task",
    "Timing": "kiks.batch.loop_timing",
    "champion_of_policy": "kiks.learn.policy_export",
    "controller": "kiks.control.controller",
    "controllers": "kiks.control.controllers",
    "drive": "kiks.client.drive",
    "executor_for": "kiks.learn.executors",
    "kclose": "kiks.client.matlab_functions",
    "kopen": "kiks.client.matlab_functions",
    "ksend": "kiks.client.matlab_functions",
    "ktime": "kiks.client.matlab_functions",
    "measure": "kiks.control.measure",
    "measures": "kiks.control.measures",
    "pause": "kiks.client.matlab_functions",
    "tasks": "kiks.learn.tasks",
}

_MODULES = {"controllers", "measures", "tasks"}
"""Names of whole modules."""

upwards.load_arena_file.provide("kiks.model.arena_formats", "load_arena_file")
upwards.draw_arena.provide("kiks.export.pictures", "arena_for_notebook")
upwards.draw_simulation.provide("kiks.export.pictures", "simulation_for_notebook")
upwards.draw_recording.provide("kiks.export.figures", "recording_for_notebook")
upwards.record_simulation.provide("kiks.recording.recorder", "RunRecorder")
upwards.plot_simulation.provide("kiks.export.figures", "figure_of_run")
upwards.plot_recordings.provide("kiks.export.figures", "figure_of")
upwards.show_in_browser.provide("kiks.desk.server.show", "show")

if "kiks.ports.pyserial" not in serial.protocol_handler_packages:
    serial.protocol_handler_packages.append("kiks.ports.pyserial")


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: `kiks --help` needs no engine."""
    if name not in _HOMES:
        raise AttributeError(f"module 'kiks' has no attribute {name!r}")
    import importlib

    module = importlib.import_module(_HOMES[name])
    value = module if name in _MODULES else getattr(module, name)
    globals()[name] = value
    return value

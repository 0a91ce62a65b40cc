"""KiKS Is a Khepera Simulator.

    import kiks

    sim = kiks.Simulation(kiks.Arena.from_image("maze.png"), seed=1)
    robot = kiks.Khepera(sim.port(1))
    robot.set_speed(5, 5)

With `kiks` imported, pyserial knows simulated ports too: `serial.serial_for_url("kiks://1")`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import serial  # noqa: TID253  (pyserial has to be told where our plug-in is)

if TYPE_CHECKING:
    from kiks.client.functions import kclose, kopen, ksend, ktime, pause
    from kiks.client.khepera import Khepera, Status
    from kiks.errors import ArenaError, KiksError, LinkError, ParameterError
    from kiks.model.arena import Arena
    from kiks.model.robot import RobotSpec
    from kiks.sim.simulation import Simulation

__version__ = "3.0.0.dev0"

__all__ = [
    "Arena",
    "ArenaError",
    "Khepera",
    "KiksError",
    "LinkError",
    "ParameterError",
    "RobotSpec",
    "Simulation",
    "Status",
    "kclose",
    "kopen",
    "ksend",
    "ktime",
    "pause",
]

_HOMES = {
    "Arena": "kiks.model.arena",
    "ArenaError": "kiks.errors",
    "Khepera": "kiks.client.khepera",
    "KiksError": "kiks.errors",
    "LinkError": "kiks.errors",
    "ParameterError": "kiks.errors",
    "RobotSpec": "kiks.model.robot",
    "Simulation": "kiks.sim.simulation",
    "Status": "kiks.client.khepera",
    "kclose": "kiks.client.functions",
    "kopen": "kiks.client.functions",
    "ksend": "kiks.client.functions",
    "ktime": "kiks.client.functions",
    "pause": "kiks.client.functions",
}

if "kiks.ports.pyserial" not in serial.protocol_handler_packages:
    serial.protocol_handler_packages.append("kiks.ports.pyserial")


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: `kiks --help` needs no engine."""
    if name not in _HOMES:
        raise AttributeError(f"module 'kiks' has no attribute {name!r}")
    import importlib

    value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value

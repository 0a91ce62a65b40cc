"""KiKS Is a Khepera Simulator.

    import kiks

    sim = kiks.Simulation(kiks.Arena.from_image("maze.png"), seed=1)
    robot = kiks.Khepera(sim.port(1))
    robot.set_speed(5, 5)

With `kiks` imported, pyserial knows simulated ports too: `serial.serial_for_url("kiks://1")`.
Every public call raises a `KiksError` for an argument or a file that it cannot use.
"""

from __future__ import annotations

from kiks.version import __version__ as __version__  # before all others, because it says which Python it must be

# isort: split

import lazy_loader
import serial  # noqa: TID253  (pyserial has to be told where our plug-in is)

from kiks.unknown_names import hinting as _hinting

_get, _, __all__ = lazy_loader.attach_stub(__name__, __file__)  # the names of __init__.pyi
__getattr__, __dir__ = _hinting(__name__, __all__, _get)

if "kiks.ports.pyserial" not in serial.protocol_handler_packages:
    serial.protocol_handler_packages.append("kiks.ports.pyserial")

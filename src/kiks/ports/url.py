"""Names of simulated ports: `kiks://1`, `kiks://sim2/1`, `kiks://1?arena=maze.toml&seed=3&thinking=fixed:2`.

`kiks://HOST:PORT/1?token=TOKEN` is a robot on another computer.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl, urlsplit

from kiks.errors import LinkError, ParameterError, shown
from kiks.meant import nearest
from kiks.model.checks import check_choice

if TYPE_CHECKING:
    from kiks.sim.port import VirtualPort
    from kiks.sim.simulation import SimPort, Simulation

_SHOWN_NAMES = 5
"""Most simulations that a message names: the newest."""

_DIGITS_MAX = 9
"""Most digits of a robot's number."""

_OPTIONS = ("arena", "robots", "robot", "seed", "thinking")


def is_elsewhere(url: str) -> bool:
    """Return whether a name is that of a robot on another computer: it has a TCP port.

    Example:
        >>> is_elsewhere("kiks://192.168.1.7:8123/1?token=x"), is_elsewhere("kiks://1"), is_elsewhere("kiks://sim2/1")
        (True, False, False)
    """
    return url.startswith("kiks:") and ":" in url.removeprefix("kiks:").partition("?")[0]


def find_port(url: str) -> VirtualPort:
    """Return a new port for a name: see `find_sim_port`; `kiks://HOST:PORT/ROBOT?token=TOKEN` is on another computer.

    Raises:
        LinkError: If the name is malformed, or there is no such robot.
    """
    if is_elsewhere(url):
        from kiks.ports.joining import HostedPort

        return HostedPort(url)
    return find_sim_port(url)


def find_sim_port(url: str, newest: Simulation | None = None) -> SimPort:
    """Return a new port for a name in this process.

    A number alone is a robot of the newest simulation, or of a new one in the default arena if there is none. Options
    after a question mark always create a new simulation.

    Args:
        url: 'kiks://ROBOT', 'kiks://SIMULATION/ROBOT' or 'kiks://ROBOT?arena=FILE&robots=2&seed=3&thinking=none'.
        newest: Takes the place of the newest simulation.

    Raises:
        LinkError: If the name is malformed, or the simulation or the robot does not exist.
    """
    if is_elsewhere(url):
        raise LinkError(
            "a program in simulated time must have the robots of one world, but "
            f"{shown(url.partition('?')[0])} is on another computer. Run it there: kiks run --join ADDRESS PROGRAM."
        )
    # Imported here: a program in a process of its own finds its ports by another function, and needs no simulation.
    from kiks.sim.simulation import SIMULATIONS, SimPort, Simulation

    try:
        parts = urlsplit(url)
    except ValueError:  # a bracket that is not closed
        parts = urlsplit("")
    path = parts.path.strip("/")
    name, number = (parts.netloc, path) if path else ("", parts.netloc)
    if parts.scheme != "kiks" or not (number.isascii() and number.isdigit() and len(number) <= _DIGITS_MAX):
        raise LinkError(
            f"a simulated port must be named like 'kiks://1', but it was {shown(url)}. The number is the robot's, "
            "from 1."
        )
    options = dict(parse_qsl(parts.query, keep_blank_values=True))
    # Options describe a world, so a world that is there already cannot be meant.
    if options:
        sim = _new_simulation(options, url)
    else:
        alive = dict(SIMULATIONS.items())
        if name and name not in alive:
            known = " or ".join(list(alive)[-_SHOWN_NAMES:]) or "none now"
            raise LinkError(
                f"a simulation's name must be one that is alive, such as {known}, but it was {shown(name)}. "
                f"'kiks://1' without a name is robot 1 of the newest simulation.{nearest(name, alive)}"
            )
        sim = alive[name] if name else newest or next(reversed(alive.values()), None) or Simulation()
    robot = int(number)
    if not 1 <= robot <= sim.robot_count:
        if not sim.robot_count:
            raise LinkError(
                f"a port must belong to an existing robot, but {shown(url)} names robot {robot} and the simulation has "
                "none. Add one with add_robot()."
            )
        known = "robot 1 only" if sim.robot_count == 1 else f"robots 1 to {sim.robot_count}"
        raise LinkError(
            f"a port must belong to an existing robot, but {shown(url)} names robot {robot} and the simulation has "
            f"{known}. Open {sim.url(min(max(robot, 1), sim.robot_count))!r}, or create it with more robots."
        )
    return SimPort(sim, robot)


def _new_simulation(options: dict[str, str], url: str) -> Simulation:
    from kiks.model.arena import Arena
    from kiks.sim.simulation import Simulation

    settings: dict[str, Any] = {}
    for key, value in options.items():
        check_choice(f"an option of {shown(url)}", key, _OPTIONS, f"one of {list(_OPTIONS)}")
        if key in ("robots", "seed"):
            if not (value.isascii() and value.isdigit()):
                raise ParameterError(
                    f"option {key} of {shown(url)} must be a whole number, but it was {shown(value)}. Write {key}=1."
                )
            settings[key] = int(value)
        else:
            settings[key] = value
    arena = Arena.load(settings.pop("arena")) if "arena" in settings else None
    return Simulation(arena, **settings)

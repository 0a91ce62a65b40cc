"""Assigns robots to the port names that programs open."""

from __future__ import annotations

from kiks.errors import LinkError, printable, shown
from kiks.meant import closest
from kiks.ports.url import find_sim_port, is_elsewhere
from kiks.sim.simulation import Simulation

_COLONS = 5
"""Those of an address of Bluetooth."""


def bluetooth_address(robot: int) -> str:
    """Return the address of Bluetooth that we make up for a robot: one that no maker of devices has.

    Example:
        >>> bluetooth_address(1)
        '02:4B:49:4B:00:01'
    """
    return f"02:4B:49:4B:{robot >> 8:02X}:{robot & 0xFF:02X}"


class PortNames:
    """Robots by port name: as given; other names get robots in the order in which programs open them.

    The first new name of a program gets its own robot. Further names get robots that belong to no program.

    Args:
        sim: The simulation.
        by_name: Robots by port name, for all programs; `ttyUSB0` is `/dev/ttyUSB0`, too.
        programs: Number of programs; the first owns robot 1, and so on.
        are_apart: Whether no program may take the own robot of another one, as in a match.
    """

    def __init__(self, sim: Simulation, by_name: dict[str, int], programs: int = 1, *, are_apart: bool = False) -> None:
        for robot in by_name.values():
            sim.port(robot)
        self._sim = sim
        self._by_name = dict(by_name)
        self._are_apart = are_apart
        self._own = set(range(1, programs + 1))
        self._alone: set[int] = set()
        self._found: dict[tuple[int, str], int] = {}

    def offered(self) -> list[str]:
        """Return the port names for a program that lists ports: one for its robot, and one for each free robot."""
        count = 1 + sum(robot not in self._own for robot in range(1, self._sim.robot_count + 1))
        return [*self._by_name, *(f"/dev/ttyUSB{number}" for number in range(count))][:count]

    def addresses(self, program: int = 1) -> dict[str, str]:
        """Return the addresses at which a program finds robots in a network, each with a name for the robot.

        Those of `--map`, and Bluetooth's, made up, of its own robot and of each free one.
        """
        names = [f"{spec.name}_{number:04}" for number, spec in enumerate(self._sim.specs, 1)]
        given = {robot for name, robot in self._by_name.items() if name.count(":") == _COLONS}
        free = [] if program in self._alone else [each for each in range(1, len(names) + 1) if each not in self._own]
        found = {name: names[robot - 1] for name, robot in self._by_name.items()}
        return found | {bluetooth_address(each): names[each - 1] for each in (program, *free) if each not in given}

    def own(self, robot: int, *, is_alone: bool = False) -> None:
        """Give a robot to a new program as its own, and forget the names of the program that had it.

        Args:
            robot: Number of the robot.
            is_alone: Whether the program may take no other one.
        """
        self._own.add(robot)
        (self._alone.add if is_alone else self._alone.discard)(robot)
        self._found = {(program, name): found for (program, name), found in self._found.items() if program != robot}

    def disown(self, robot: int) -> None:
        """Free the robot of a program that has ended."""
        self.own(robot)
        self._own.discard(robot)

    def check(self, robot: int, program: int) -> None:
        """Check that a program may take a robot.

        Args:
            robot: Number of the robot.
            program: The program, by the number of its own robot.

        Raises:
            LinkError: If it may not.
        """
        if robot != program and (program in self._alone or (self._are_apart and robot in self._own)):
            raise LinkError(
                f"a program must drive its own robot, which is robot {program} here, but it asked for robot {robot}. "
                f"Open 'kiks://{program}'."
            )

    def robot(self, name: str, program: int = 1) -> int:
        """Return the robot behind a name that a program opens.

        Args:
            name: Any name; those that begin with `kiks:` are this simulation's own.
            program: The program, by the number of its own robot.

        Raises:
            LinkError: If every robot has a name already, or the robot does not exist or belongs to another program.
        """
        robot = self._robot(name, program)
        self.check(robot, program)
        return robot

    def _robot(self, name: str, program: int) -> int:
        if name.startswith("kiks:"):
            return self._robot_at_url(name)
        for mapped in (name, name.removeprefix("/dev/")):
            if mapped in self._by_name:
                return self._by_name[mapped]
        made_up = {bluetooth_address(robot): robot for robot in range(1, self._sim.robot_count + 1)}
        if name in made_up:
            return made_up[name]
        if (program, name) not in self._found:
            taken = {*self._by_name.values(), *self._found.values()}
            # Its own robot first, then those that no program has.
            others = (robot for robot in range(1, self._sim.robot_count + 1) if robot not in self._own)
            free = [robot for robot in (program, *others) if robot not in taken]
            if not free:
                known = self._by_name | {found: robot for (of, found), robot in self._found.items() if of == program}
                meant = known.get(closest(name, known) or "", program)
                found = ", ".join(f"{shown(each)} is robot {robot}" for each, robot in known.items())
                raise LinkError(
                    f"a port must belong to a robot, but {shown(name)} is one more than there are robots: {found}. "
                    f"Run it with --robots {self._sim.robot_count + 1}, "
                    f"or name its robot: --map {printable(name)}={meant}."
                )
            self._found[program, name] = free[0]
        return self._found[program, name]

    def _robot_at_url(self, name: str) -> int:
        if "?" in name and not is_elsewhere(name):
            raise LinkError(
                f"a port's name must be without options where several programs share a world, but it was "
                f"{shown(name)}. Give the options to kiks run."
            )
        port = find_sim_port(name, self._sim)
        if port.sim is not self._sim:
            raise LinkError(
                f"a port must belong to the world that the programs share, but it was {shown(name)}. Open 'kiks://1'."
            )
        return port.robot

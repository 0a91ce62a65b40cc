"""Which robot answers on which port name."""

from __future__ import annotations

from kiks.errors import LinkError, shown
from kiks.sim.simulation import Simulation


class PortNames:
    """Robots by port name: as told, and otherwise in the order in which new names are opened.

    Each program has a robot of its own first; what is left belongs to whoever opens one more name.

    Args:
        sim: The simulation.
        told: Robots by port name, for every program.
        programs: How many programs there are; the first has robot 1, and so on.

    Raises:
        ParameterError: If `told` names a robot that is not there.
    """

    def __init__(self, sim: Simulation, told: dict[str, int], programs: int = 1) -> None:
        for robot in told.values():
            sim.port(robot)
        self._sim = sim
        self._told = dict(told)
        self._own = set(range(1, programs + 1))
        self._found: dict[tuple[int, str], int] = {}

    def offered(self) -> list[str]:
        """Return the port names that a program finds which looks for ports: for its robot, and those left over."""
        count = 1 + sum(robot not in self._own for robot in range(1, self._sim.robot_count + 1))
        return [*self._told, *(f"/dev/ttyUSB{number}" for number in range(count))][:count]

    def own(self, robot: int) -> None:
        """Give a robot to a program that comes, as its own; nothing is left of the one that had it."""
        self._own.add(robot)
        self._found = {(who, name): found for (who, name), found in self._found.items() if who != robot}

    def disown(self, robot: int) -> None:
        """Let a program's robots belong to others again: it has gone."""
        self.own(robot)
        self._own.discard(robot)

    def robot(self, name: str, program: int = 1) -> int:
        """Return the robot behind a name that a program opens.

        Args:
            name: Any name; those that begin with `kiks:` are this simulation's own.
            program: The program, by the number of its own robot.

        Raises:
            LinkError: If every robot has a name already, or there is no such robot.
        """
        if name.startswith("kiks:"):
            return self._of_url(name)
        if name in self._told:
            return self._told[name]
        if (program, name) not in self._found:
            taken = {*self._told.values(), *self._found.values()}
            others = (robot for robot in range(1, self._sim.robot_count + 1) if robot not in self._own)
            free = [robot for robot in (program, *others) if robot not in taken]
            if not free:
                known = self._told | {found: robot for (who, found), robot in self._found.items() if who == program}
                raise LinkError(
                    f"a port must belong to a robot, but {shown(name)} is one more than there are: {known}. "
                    f"Run it with --robots {self._sim.robot_count + 1}, or map two names to one robot with --map."
                )
            self._found[program, name] = free[0]
        return self._found[program, name]

    def _of_url(self, name: str) -> int:
        from kiks.ports.url import find_port

        if "?" in name:
            raise LinkError(
                f"a port's name must be without options where several programs share a world, but it was "
                f"{shown(name)}. "
                f"Give the options to kiks run."
            )
        port = find_port(name)
        if port.sim is not self._sim:
            raise LinkError(
                f"a port must belong to the world that the programs share, but it was {shown(name)}. Open 'kiks://1'."
            )
        return port.robot

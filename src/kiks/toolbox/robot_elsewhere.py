"""A robot on another computer that a session's program drives, as `kiks('--join', ADDRESS)` says."""

from __future__ import annotations

from kiks.errors import LinkError
from kiks.ports.joining import Address, HostLink, HostSocket
from kiks.ports.messages import AwaitedAnswer


class RobotElsewhere:
    """A robot on another computer. The host knows of the program as soon as this is made.

    Args:
        address: Its address, which `kiks host` prints there.

    Attributes:
        robot: Number of the robot there.
        pulse_mm: Way of its wheels for a pulse of their encoders [mm].
        thinking: The policy for the program's thinking time.
        visit: What open ports belong to: another object when the host has ended the connection.
        why_not: Why the program cannot see or change the world.

    Raises:
        LinkError: If the host does not let the program in.
    """

    why_not = (
        "the world must be on this computer for that, but the joined robot is on another one. Drive it with commands: "
        "its host sees and changes the world. kiks_quit leaves it."
    )

    def __init__(self, address: str) -> None:
        self._address = Address.parse(address)
        self._host: HostSocket | None = HostSocket(self._address)
        self.robot, self.pulse_mm = self._host.robot, self._host.start.pulse_mm
        self.thinking = self._host.start.thinking
        self.visit = object()

    def robot_of(self, number: int) -> int:
        """Return the robot of a port: it has one, port -1.

        Raises:
            LinkError: If it is another port.
        """
        if number != 1:
            raise LinkError(
                f"a program that has joined a robot elsewhere must open port -1, for it has one robot, but it was port "
                f"{-number}. Open [-1 9600 1]."
            )
        return self.robot

    def connect(self, number: int, awaited: AwaitedAnswer) -> HostLink:
        """Return the link to the host, or a new one if the program has left meanwhile.

        Args:
            number: Number of the port for which it is.
            awaited: The answer that the program waits for.
        """
        self.robot_of(number)
        host, self._host = self._host or HostSocket(self._address), None
        self.thinking = host.start.thinking
        return HostLink(host, awaited.check, self._end_visit)

    def close(self) -> None:
        """Leave, if the program has opened no port yet."""
        if self._host is not None:
            self._host.close()

    def _end_visit(self) -> None:
        self.visit = object()

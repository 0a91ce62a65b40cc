"""Commands that a person types to a robot: KiKS 2.2.0 called this active mode."""

from __future__ import annotations

from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.errors import LinkError, ParameterError, shown
from kiks.firmware.receiver import LINE_LIMIT
from kiks.sim.simulation import Simulation
from kiks.units import s_from_ns


class Typed:
    """A command that a person has typed.

    Attributes:
        robot: Number of the robot, from 1.
        text: What was typed.
        time_s: When [s].
    """

    def __init__(self, sim: Simulation, robot: int, text: str) -> None:
        self.robot = robot
        self.text = text
        self.time_s = sim.time_s
        self._sim = sim
        self._reply = b""
        self._arrival_ns: int | None = None

    @property
    def reply(self) -> str | None:
        """The robot's answer without the line's end; None until it has arrived."""
        if self._arrival_ns is None or self._sim.now_ns < self._arrival_ns:
            return None
        return self._reply.decode("latin-1").replace("\r\n", "\n").rstrip("\n")

    @property
    def reply_s(self) -> float | None:
        """When its last character has arrived [s]; None as long as it has not."""
        return None if self.reply is None or self._arrival_ns is None else s_from_ns(self._arrival_ns)

    def take_reply(self, reply: bytes, arrival_ns: int) -> None:
        """Take the reply, which has arrived at a time [ns]."""
        self._reply, self._arrival_ns = reply, arrival_ns


def type_lines(sim: Simulation, robot: int, text: str) -> list[Typed]:
    r"""Send what a person has typed, on the robot's line, at the present time. The caller lets that time pass.

    A program that has the line gets no reply to it. Its own next command waits until the line is free.

    Args:
        sim: The world.
        robot: Number of the robot, from 1.
        text: A command without its end, like `D,5,5`; or several lines.

    Returns:
        What was sent, each with its reply when that has arrived.

    Raises:
        LinkError: If a program has sent a part of a command, or the line is full.

    Example:
        >>> sim = Simulation()
        >>> (typed,) = type_lines(sim, 1, "D,2,2")
        >>> typed.reply is None
        True
        >>> sim.run(0.1)
        >>> typed.reply
        'd'
    """
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    if not lines:
        raise ParameterError("a command must have a letter at least, but nothing was typed. Type D,5,5 to drive.")
    for line in lines:
        if not (line.isascii() and line.isprintable() and len(line) <= LINE_LIMIT):
            raise ParameterError(
                f"a command must be at most {LINE_LIMIT} plain letters, digits and signs, but it was {shown(line)}. "
                "Type D,5,5 to drive."
            )
    with sim.lock:
        wire = sim.wires[sim.index_of(robot)]
        wire.kind.must_take_lines("the console")
        # On one line, half a command of a program and one of a person would become a third.
        if partial := wire.firmware.receiver.partial:
            raise LinkError(
                f"what you type must stand between the commands of a program, but the one on robot {robot} has sent "
                f"{shown(partial.decode('latin-1'))} and no line's end yet. Try again, or stop that program first."
            )
        line_ns = wire.line.character_ns * (BACKLOG_LIMIT - sum(len(line) + 1 for line in lines))
        if wire.line.sending_until_ns - sim.now_ns > line_ns:
            raise LinkError(
                f"the line of robot {robot} must have room for what you type, but {BACKLOG_LIMIT} characters are on "
                "it or would be. Let time pass first."
            )
        sent = [Typed(sim, robot, line) for line in lines]
        for typed in sent:
            wire.send(typed.text.encode() + b"\n", sim.now_ns, typed.take_reply)
    return sent

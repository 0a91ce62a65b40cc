"""The robot of a program of Octave in a world that the program has not begun."""

from __future__ import annotations

from kiks.clock.program_clock import EPOCH_S, ProgramClock
from kiks.ports.link import Link, RemoteLine
from kiks.ports.messages import Start, Verb
from kiks.sim.port import VirtualPort
from kiks.toolbox.session_clock import SessionClock
from kiks.units import NS_PER_S


class GivenRobot:
    """The robot of a program in a world that the program has not begun; open ports belong to it.

    Args:
        link: The link to the world.
        start: What the program finds.
        program: The cost of its thinking.

    Attributes:
        link: The link to the world, which stays until the program ends.
        timer: A port that tells the program's time.
        clock: What the clocks of the program tell.
        pulse_mm: Way of the wheels for a pulse of their encoders [mm].
        program: The cost of its thinking.
        why_not: Why the program cannot see or change the world.
    """

    why_not = (
        "this program must have begun the world for that, but the world was there before it. Drive the robot with "
        "commands."
    )

    def __init__(self, link: Link, start: Start, program: ProgramClock) -> None:
        self.link = link
        self.pulse_mm, self.thinking, self.program = start.pulse_mm, start.thinking, program
        self.timer = VirtualPort(RemoteLine(link, 1), program)
        self.clock = SessionClock(wall_ns=lambda: link.now_ns, date_ns=EPOCH_S * NS_PER_S)

    def robot_of(self, number: int) -> int:
        """Return the robot of a port: the program's own, then those that are free."""
        return int(self.link.ask(Verb.FIND, 0, f"port -{number}").result)

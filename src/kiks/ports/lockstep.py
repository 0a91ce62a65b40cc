"""Lockstep: the world waits for each of the programs on real ports.

A command acts one thinking time after the previous reply, and the program waits for its own reply. Neither the way in
which the operating system splits the bytes nor the real time that a program takes has an influence.
`program_scheduler.py` describes how several programs share the world.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable

from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.firmware.receiver import LINE_ENDS
from kiks.ports.live import IDLE_S, ServedRobot, TimePolicy
from kiks.ports.program_scheduler import Participant, ProgramScheduler
from kiks.sim.simulation import Simulation
from kiks.units import NS_PER_S

LEFT_BEHIND_COUNT = 50
"""Number of remaining commands of a client above which the log says how long the next client waits."""

REPLY_LENGTH = 64
"""Longest usual reply [characters]."""

_log = logging.getLogger("kiks.serve")


class Lockstep(TimePolicy):
    """The world moves while commands and replies are on the lines, and for the thinking times between them.

    Args:
        sim: The world.
        thinking_ns: Thinking time before each command [ns].
        scheduler: Decides when each client acts.
    """

    def __init__(self, sim: Simulation, thinking_ns: int, scheduler: ProgramScheduler) -> None:
        self._sim = sim
        self._thinking_ns = thinking_ns
        self._scheduler = scheduler

    def enter(self, served: ServedRobot) -> LockstepClient:
        """Return the client that has come to a robot, which the world waits for from now on."""
        client = LockstepClient(served, self._sim, self._scheduler, self._thinking_ns)
        self._scheduler.join(client)
        return client

    def advance(self, served_robots: Iterable[ServedRobot]) -> float:
        """Send the commands that are due, and hand over their replies."""
        wait_s = self._scheduler.advance()
        return IDLE_S if wait_s is None else min(wait_s, IDLE_S)


class LockstepClient(Participant):
    """The client of a robot, as the scheduler sees it: it sends characters, not requests."""

    def __init__(self, served: ServedRobot, sim: Simulation, scheduler: ProgramScheduler, thinking_ns: int) -> None:
        super().__init__(f"the client of robot {served.robot}", served.robot)
        self._served = served
        self._sim = sim
        self._scheduler = scheduler
        self._thinking_ns = thinking_ns
        self._stored = bytearray()
        self._next = b""
        self._last_end = b"\n"
        self._is_leaving = False
        self._go_on(sim.now_ns)

    @property
    def is_full(self) -> bool:
        """Whether the stored characters would fill a line."""
        return len(self._stored) >= BACKLOG_LIMIT

    def receive(self, data: bytes) -> None:
        """Store characters until their turn."""
        self._stored += data
        self.patience.renew()
        self._take_command()

    def leave(self) -> None:
        """Let complete commands act, and drop the rest."""
        self._is_leaving = True
        self._update_has_left()
        count = sum(map(self._stored.count, LINE_ENDS))
        if count > LEFT_BEHIND_COUNT:
            # No command is dropped: which ones had come when the server noticed the end depends on real time.
            most_ns = (len(self._stored) + count * REPLY_LENGTH) * self._served.wire.line.character_ns
            _log.warning(
                "%s has gone and left %d commands behind, which still act: the next client may come after that, at "
                "most %.0f s of simulated time from now.",
                self.name,
                count,
                most_ns / NS_PER_S,
            )

    def drop(self) -> None:
        """Disconnect the client."""
        self._served.is_dropped = True
        self.is_waited_for = False

    # ---- events ----

    def next_ns(self) -> int | None:
        """Return the time at which the next complete command is sent [ns]; None without one."""
        return max(self.acts_from_ns, self._sim.now_ns) if self._next else None

    def act(self) -> None:
        """Send a command, and wait until its reply is known."""
        wire, line = self._served.wire, self._served.wire.line
        at_ns = max(self.acts_from_ns, self._sim.now_ns)
        last_end, piece = self._last_end, self._next
        self._last_end, self._next = piece[-1:], b""
        self._take_command()
        self.acts_from_ns = at_ns
        if piece in LINE_ENDS and last_end in LINE_ENDS and not wire.firmware.spec.quirks.answer_empty_lines:
            # The robot does not answer an empty line, so it costs no thinking time and no wait. The LF of CR LF left
            # right behind the CR.
            wire.send(piece, line.sending_until_ns if last_end + piece == b"\r\n" else self._free_ns)
            self._go_on(self._free_ns)
        else:
            wire.send(piece, at_ns)
            self.waits = True
            self.check_wait()

    def check_wait(self) -> None:
        """Hand over the reply and go on, if every command has acted."""
        wire, line = self._served.wire, self._served.wire.line
        # A command has not acted yet, so its reply is not known; or the robot is about to send the next packet.
        if wire.pending or (wire.may_speak and not line.waiting):
            return
        # The world is at the instant at which the command has acted, or was sent if it was no command.
        end_ns = max(self.acts_from_ns, self._sim.now_ns)
        count = len(line.waiting)
        if count:
            end_ns = line.arrival_ns(count) or end_ns
            reply = line.take(count)
            if self._served.channel is not None:
                self._served.channel.write(reply)
        self.waits = False
        self._scheduler.note_seen(end_ns)
        self._go_on(end_ns)

    # ---- inside ----

    def _go_on(self, time_ns: int) -> None:
        """Think, from a time [ns] on, or from when there is room on the line."""
        line = self._served.wire.line
        self._free_ns = max(time_ns, line.room_ns())
        self.acts_from_ns = self._free_ns + self._thinking_ns
        self._update_has_left()

    def _update_has_left(self) -> None:
        self.has_left = self._is_leaving and not self._next and not self.waits

    def _take_command(self) -> None:
        """Take the next command from the stored characters, if it is complete."""
        if self._next:
            return
        stored = self._stored
        end = self._served.wire.firmware.receiver.complete_length(stored[:BACKLOG_LIMIT])
        if not end:
            if len(stored) < BACKLOG_LIMIT:
                return
            end = BACKLOG_LIMIT  # no command is this long: send it for the robot to drop
        self._next = bytes(stored[:end])
        del stored[:end]

"""Lockstep: real programs on real ports, each of which the world waits for.

A command acts the thinking time after the reply before it, and the program waits until its own reply is there. How the
operating system cuts the bytes, and how long a program really took, has no influence; how several programs share the
world stands in `program_scheduler.py`.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Iterable

from kiks.clock.patience import Patience
from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.ports.live import IDLE_S, Link
from kiks.ports.program_scheduler import PATIENCE_S, Participant, ProgramScheduler
from kiks.sim.simulation import Simulation
from kiks.units import NS_PER_S

TERMINATORS = (b"\r", b"\n")

LEFT_BEHIND_COUNT = 50
"""When a client leaves more commands behind, the next one waits for so long that a person is told."""

REPLY_LENGTH = 64
"""Longest usual reply [characters]."""

_TERMINATOR = re.compile(rb"[\r\n]")

_log = logging.getLogger("kiks.serve")


class Lockstep:
    """The world moves while commands and replies are on the lines, and for the thinking times between them.

    Args:
        sim: The world.
        thinking_ns: What a program needs before each command [ns].
        programs: How many begin together.
        missing: Returns who of them is not there yet, in words for a person.
        when_silent: What happens to a program that is silent while others wait: 'wait', 'drop' or 'ignore'.
        patience_s: How long it may be [s of real time].
        new_patience: For tests: makes patiences with their own wall clock.

    Raises:
        ParameterError: If there is no such policy, or the patience is out of range.
    """

    forgets = False

    def __init__(
        self,
        sim: Simulation,
        thinking_ns: int,
        *,
        programs: int = 1,
        missing: Callable[[], str] = lambda: "",
        when_silent: str = "ignore",
        patience_s: float = PATIENCE_S,
        new_patience: Callable[[float], Patience] = Patience,
    ) -> None:
        self._sim = sim
        self._thinking_ns = thinking_ns
        self._clients: dict[int, Client] = {}
        self._scheduler = ProgramScheduler(
            sim,
            expected=programs,
            missing=missing,
            log=_log,
            when_silent=when_silent,
            patience_s=patience_s,
            new_patience=new_patience,
        )

    def start(self) -> None:
        """Do nothing: time passes with the first command."""

    def enter(self, link: Link) -> None:
        """Let a client take part from now on."""
        client = self._clients[link.robot] = Client(link, self._sim, self._scheduler, self._thinking_ns)
        self._scheduler.join(client)

    def leave(self, link: Link) -> None:
        """Let the commands that a client has left behind act; `has_left` when they have."""
        self._clients[link.robot].leave()

    def has_left(self, link: Link) -> bool:
        """Say whether everything that a client has left behind is done."""
        return self._clients[link.robot].has_left

    def advance(self, links: Iterable[Link]) -> float:
        """Carry out the commands whose turn it is, and hand over their replies."""
        wait_s = self._scheduler.advance()
        return IDLE_S if wait_s is None else min(wait_s, IDLE_S)

    def receive(self, link: Link, data: bytes) -> None:
        """Keep characters until their turn."""
        self._clients[link.robot].receive(data)

    def is_full(self, link: Link) -> bool:
        """Say whether the client is that far ahead of the robot."""
        return self._clients[link.robot].is_full


class Client(Participant):
    """The client of a link, as one that takes its turn."""

    def __init__(self, link: Link, sim: Simulation, scheduler: ProgramScheduler, thinking_ns: int) -> None:
        super().__init__(f"the client of robot {link.robot}", link.robot)
        self._link = link
        self._sim = sim
        self._scheduler = scheduler
        self._thinking_ns = thinking_ns
        self._kept = bytearray()
        self._next = b""
        self._last = b"\n"
        self._is_leaving = False
        self._go_on(sim.now_ns)

    @property
    def is_full(self) -> bool:
        """Say whether as much as a line holds waits for its turn."""
        return len(self._kept) >= BACKLOG_LIMIT

    def receive(self, data: bytes) -> None:
        """Keep characters until their turn."""
        self._kept += data
        self.patience.renew()
        self._cut()

    def leave(self) -> None:
        """Let what came whole still act, and forget the rest."""
        self._is_leaving = True
        self._look_around()
        count = len(_TERMINATOR.findall(self._kept))
        if count > LEFT_BEHIND_COUNT:
            # None is dropped: which were left when it was noticed that the client has gone is a matter of real time.
            most_ns = (len(self._kept) + count * REPLY_LENGTH) * self._link.wire.line.character_ns
            _log.warning(
                "%s has gone and left %d commands behind, which still act: the next one is let in after that, at most "
                "%.0f s of simulated time from now.",
                self.name,
                count,
                most_ns / NS_PER_S,
            )

    def drop(self) -> None:
        """Hang up on the client."""
        self._link.is_dropped = True
        self.is_waited_for = False

    # ---- its turn ----

    def next_ns(self) -> int | None:
        """Return when the next command is sent [ns], if it has come whole."""
        return max(self.acts_from_ns, self._sim.now_ns) if self._next else None

    def act(self) -> None:
        """Send a command, and wait until its reply is known."""
        wire, line = self._link.wire, self._link.wire.line
        at_ns = max(self.acts_from_ns, self._sim.now_ns)
        last, piece = self._last, self._next
        self._last, self._next = piece[-1:], b""
        self._cut()
        self.acts_from_ns = at_ns
        if piece in TERMINATORS and last in TERMINATORS and not wire.firmware.spec.quirks.answer_empty_lines:
            # The robot is silent about an empty line, so nobody thinks before it or waits after it. The LF of CR LF
            # left right behind the CR.
            wire.send(piece, line.sending_until_ns if last + piece == b"\r\n" else self._free_ns)
            self._go_on(self._free_ns)
        else:
            wire.send(piece, at_ns)
            self.waits = True
            self.look()

    def look(self) -> None:
        """Hand over the reply and go on, if every command has acted."""
        wire, line = self._link.wire, self._link.wire.line
        if wire.pending:
            return
        # The world stands at the instant at which the command has acted, or where it was sent if it was none.
        end_ns = max(self.acts_from_ns, self._sim.now_ns)
        count = len(line.waiting)
        if count:
            end_ns = line.arrival_ns(count) or end_ns
            reply = line.take(count)
            if self._link.channel is not None:
                self._link.channel.write(reply)
        self.waits = False
        self._scheduler.see(end_ns)
        self._go_on(end_ns)

    # ---- inside ----

    def _go_on(self, time_ns: int) -> None:
        """Think, from a time [ns] on, or from when there is room on the line."""
        line = self._link.wire.line
        self._free_ns = max(time_ns, line.room_ns)
        self.acts_from_ns = self._free_ns + self._thinking_ns
        self._look_around()

    def _look_around(self) -> None:
        self.has_left = self._is_leaving and not self._next and not self.waits

    def _cut(self) -> None:
        """Take the next command from what is kept, if it is whole."""
        if self._next:
            return
        kept = self._kept
        match = _TERMINATOR.search(kept, 0, BACKLOG_LIMIT)
        if match is not None:
            end = match.end()
        elif len(kept) >= BACKLOG_LIMIT:
            # No command is as long as that: the robot may drop it, so that it is not kept for ever.
            end = BACKLOG_LIMIT
        else:
            return
        self._next = bytes(kept[:end])
        del kept[:end]

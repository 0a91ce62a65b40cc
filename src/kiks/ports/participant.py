"""Programs that keep their own time, as the scheduler sees them; `remote_link.py` is their end of the connection."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable

from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.errors import KiksError
from kiks.ports.messages import ASKING, Answer, Kind, Request
from kiks.ports.port_names import PortNames
from kiks.ports.program_scheduler import Participant, ProgramScheduler
from kiks.sim.local_line import claim
from kiks.sim.read_completion import NEVER_NS, Read, end_of_read, end_of_wait, is_complete, never_ends
from kiks.units import NS_PER_S

STOPPING_NS = NS_PER_S // 2
"""Time that a robot's wheels have to come to rest when its program was stopped [ns]."""

LINE_REQUESTS: dict[int, Callable[..., object]] = {
    Kind.SEND: lambda wire, at_ns, data: wire.send(data, at_ns),
    Kind.COUNT: lambda wire, at_ns: wire.line.arrived_count(at_ns),
    Kind.DROP: lambda wire, at_ns: wire.line.take(wire.line.arrived_count(at_ns)),
    Kind.SENT: lambda wire, at_ns: max(at_ns, wire.line.sending_until_ns),
    Kind.SET_BAUD: lambda wire, at_ns, baud: wire.set_baud(baud),
    Kind.BAUD: lambda wire, at_ns: wire.line.baud,
}
"""What requests that concern the line alone do to a robot's wire at a time [ns], and their results."""

_log = logging.getLogger("kiks.run")


class ProgramParticipant(Participant):
    """A program that sends requests, each with the simulated time at which it is made.

    This class serves a program in a thread of this process, whose end is `LocalConnection`.

    Args:
        name: Its name in messages.
        rank: Its number, from 1.
        robot: Number of its own robot; 0 if it has none until it claims one.
        scheduler: Decides when it acts.
        names: Which robot answers on which port name.

    Attributes:
        is_silenced: Whether it was disconnected because it was silent.
        is_stopped: Whether a person has stopped it; then its robots stop when it has left.
        is_closed: Whether the connection is closed.
        answer: The last answer to a program in a thread; None until it is there.
    """

    answer: Answer | None = None
    is_closed = False

    def __init__(self, name: str, rank: int, robot: int, scheduler: ProgramScheduler, names: PortNames) -> None:
        super().__init__(name, rank)
        self.robot = robot
        self.is_here = False
        self.is_silenced = False
        self.is_stopped = False
        self._world, self._wires = scheduler.loop.world, scheduler.loop.wires
        self._scheduler = scheduler
        self._names = names
        self._requests: deque[Request] = deque()
        self._pending_read: Request | None = None
        self._robots: set[int] = set()
        self._used: set[int] = set()
        self._ticket = 0
        self._has_been_warned = False

    def close(self) -> None:
        """Close the connection."""
        self.is_closed = True

    def reply(self, answer: Answer) -> None:
        """Hand an answer over to the program."""
        self.answer = answer

    # ---- requests ----

    def leave(self) -> None:
        """Disconnect the program after its requests are done."""
        self.add_request(Request(Kind.END, 0, self.acts_from_ns))

    def disconnect(self) -> None:
        """Disconnect the program at once, and drop its requests that are not done yet."""
        if self.has_left:
            return
        self._requests.clear()
        self._pending_read = None
        self.waits = False
        self._free_robots()
        self.has_left = True

    def add_request(self, request: Request) -> None:
        """Take a request of the program."""
        if self.has_left:
            return
        if not self.is_here:
            self.is_here = True
            self.is_waited_for = not self.is_silenced
            self.acts_from_ns = self._world.now_ns
        self.patience.renew()
        if request.kind == Kind.REACHED and not self._requests and not self.waits:
            self._note_thinking(request)
            self.acts_from_ns = max(self.acts_from_ns, request.at_ns)
        else:
            self._requests.append(request)

    def drop(self) -> None:
        """Disconnect the program."""
        self.is_silenced = True
        self.is_waited_for = False

    # ---- events ----

    def next_ns(self) -> int | None:
        """Return the time at which its next request is done [ns]."""
        if not self._requests:
            return None
        # Comparisons: this is asked several times for each exchange, and `max` takes three times as long.
        at_ns, now_ns = self._requests[0].at_ns, self._world.now_ns
        if self.acts_from_ns > at_ns:
            at_ns = self.acts_from_ns
        return at_ns if at_ns > now_ns else now_ns

    @property
    def is_held_up(self) -> bool:
        """Whether it waits for an answer, which it does after each request that asks for one."""
        return self.waits or bool(self._requests and self._requests[-1].kind in ASKING)

    def act(self) -> None:
        """Do its next request, and those of the same instant that follow it: nothing else can come between them."""
        at_ns = self.next_ns()
        assert at_ns is not None
        self._do(at_ns)
        while self._requests and not self.waits and self.next_ns() == at_ns:
            self._do(at_ns)

    def _do(self, at_ns: int) -> None:
        """Do its next request at a time [ns]."""
        request = self._requests[0]
        self._note_thinking(request)
        self.acts_from_ns = at_ns
        self._requests.popleft()
        self._ticket = request.ticket
        try:
            self._execute(request)
        except KiksError as error:
            self._answer(at_ns, error=str(error))

    def check_wait(self) -> None:
        """Answer a read, or a wait for several reads, if its end is known."""
        request = self._pending_read
        if request is None:
            return
        if request.kind == Kind.WAIT:
            self._check_wait_for_all(request)
            return
        wire = self._wires[request.robot - 1]
        size, terminator, timeout_ns, poll_ns = request.arguments
        deadline_ns = NEVER_NS if timeout_ns is None else self.acts_from_ns + timeout_ns
        end = end_of_read(wire, size, terminator, deadline_ns, self.acts_from_ns + poll_ns)
        if end is None:
            return
        self._pending_read = None
        self.waits = False
        end_ns, count = end
        if end_ns == NEVER_NS:
            self._answer(self.acts_from_ns, error=str(never_ends(request.robot)))
        else:
            data = wire.line.take(count)
            self._answer(max(end_ns, self.acts_from_ns), (data, wire.line.taken_ns), robot=request.robot)

    def _check_wait_for_all(self, request: Request) -> None:
        wires, (reads, until_ns) = self._wires, request.arguments
        reads = [Read(*read) for read in reads]
        end_ns, is_known = end_of_wait(wires, reads, until_ns)
        if not is_known:
            return
        self._pending_read = None
        self.waits = False
        now_ns = self.acts_from_ns if end_ns == NEVER_NS else max(end_ns, self.acts_from_ns)
        self._answer(now_ns, [is_complete(wires[read.robot - 1], read, now_ns) for read in reads])

    def _warn_of_backlog(self, robot: int) -> None:
        """Log that the program sends faster than the line carries, once."""
        if not self._has_been_warned:
            self._has_been_warned = True
            _log.warning(
                "%s must wait for its replies, but it is more than %d characters ahead of robot %d; what it sends now "
                "has to wait. Read a line after each command.",
                self.name,
                BACKLOG_LIMIT,
                robot,
            )

    def _note_thinking(self, request: Request) -> None:
        """Record the thinking time on the wires of its robots."""
        if request.thought_ns:
            until_ns = min(self.acts_from_ns + request.thought_ns, request.at_ns)
            for robot in self._robots:
                self._wires[robot - 1].think(self.acts_from_ns, until_ns)

    def _execute(self, request: Request) -> None:
        """Execute a request, at the instant at which the program acts."""
        at_ns, kind = self.acts_from_ns, request.kind
        if kind in (Kind.READ, Kind.WAIT):
            self._pending_read = request
            self.waits = True
            self.check_wait()
        elif kind == Kind.END:
            self._end()
        elif kind == Kind.MEET:
            self._answer(at_ns)
        elif kind == Kind.FIND:
            self._answer(at_ns, self._names.robot(request.arguments[0], self.robot))
        elif kind == Kind.ROOM:
            room_ns = self._wires[request.robot - 1].line.room_ns(request.arguments[0])
            if room_ns > at_ns:
                self._warn_of_backlog(request.robot)
            self._answer(at_ns, room_ns, robot=request.robot)
        elif kind == Kind.CLAIM:
            claim(self._wires[request.robot - 1], request.robot, request.arguments[0])
            self._robots.add(request.robot)
            self._used.add(request.robot)
            self._answer(at_ns, robot=request.robot)
        elif kind == Kind.HANG_UP:
            wire = self._wires[request.robot - 1]
            if request.arguments[0]:
                wire.holder = None
                self._robots.discard(request.robot)
            wire.hang_up()
        elif kind != Kind.REACHED:
            result = LINE_REQUESTS[kind](self._wires[request.robot - 1], at_ns, *request.arguments)
            if kind in ASKING:
                self._answer(at_ns, result, robot=request.robot)

    def _end(self) -> None:
        """Release the robots of the program, which has left, and close the connection."""
        self._free_robots()
        self._scheduler.note_seen(self.acts_from_ns)
        self.close()
        self.has_left = True

    def _free_robots(self) -> None:
        """Release its robots; they drive on, unless a person has stopped the program."""
        wires = self._wires
        for robot in self._robots:
            wires[robot - 1].holder = None
            wires[robot - 1].hang_up()
        self._robots.clear()
        if self.is_stopped:
            now_ns = self._world.now_ns
            for robot in {self.robot, *self._used} - {0}:
                if wires[robot - 1].holder is None:
                    wires[robot - 1].halt(now_ns)
            # Without another program nothing else would let the time pass that the wheels take to stop.
            self._scheduler.note_seen(now_ns + STOPPING_NS)

    def _answer(self, now_ns: int, result: object = None, *, robot: int = 0, error: str = "") -> None:
        """Answer a request, so the program goes on."""
        ahead_count = 0
        if robot:
            line = self._wires[robot - 1].line
            ahead_count = max(-((now_ns - line.sending_until_ns) // line.character_ns), 0)
        self.acts_from_ns = now_ns
        self.reply(Answer(self._ticket, now_ns, result, ahead_count, error))

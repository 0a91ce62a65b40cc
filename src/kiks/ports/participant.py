"""Programs that keep their own time, as the scheduler sees them; `link.py` is their own end."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable

from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.errors import KiksError
from kiks.model.checks import CLOCK_END_NS
from kiks.ports.messages import ASKING, Answer, MessageError, Request, Verb
from kiks.ports.port_names import PortNames
from kiks.ports.program_scheduler import Participant, ProgramScheduler
from kiks.sim.local_line import claim
from kiks.sim.port import BAUD_MAX
from kiks.sim.read_completion import NEVER_NS, Read, end_of_read, end_of_wait, is_complete, never_ends
from kiks.sim.robot_state import state_of
from kiks.sim.wire import Wire
from kiks.units import BITS_MIN, NS_PER_S, character_ns

STOPPING_NS = NS_PER_S // 2
"""Time that a robot's wheels have to come to rest when its program was stopped [ns]."""

PENDING_MAX = 4 * BACKLOG_LIMIT
"""Most commands on their way to a robot: `BACKLOG_LIMIT` characters are half as many."""

BURST_MAX = 16 * BACKLOG_LIMIT
"""Most characters that a program sends beyond those that its lines would carry at `BAUD_MAX`."""

_SHORTEST_NS = character_ns(BAUD_MAX, BITS_MIN)

LINE_REQUESTS: dict[int, Callable[..., object]] = {
    Verb.COUNT: lambda wire, at_ns: wire.arrived_count(at_ns),
    Verb.DROP: lambda wire, at_ns: wire.line.take(wire.line.arrived_count(at_ns)),
    Verb.SENT: lambda wire, at_ns: max(at_ns, wire.line.sending_until_ns),
    Verb.SET_BAUD: lambda wire, at_ns, baud: wire.set_baud(baud),
    Verb.BAUD: lambda wire, at_ns: wire.line.baud,
}
"""What requests that concern the line alone do to a robot's wire at a time [ns], and their results."""

_log = logging.getLogger("kiks.run")


class _ClaimedLines(dict[int, Wire]):
    """The lines of the robots that a program has claimed, by their numbers."""

    def __missing__(self, robot: int) -> Wire:
        raise MessageError(f"used the line of robot {robot} without having opened it")


class ProgramParticipant(Participant):
    """A program that sends requests, each with the simulated time at which it is made.

    This class serves a program in a thread of this process, whose own end is a `ThreadLink`.

    Args:
        name: Its name in messages.
        rank: Its number, from 1.
        robot: Number of its own robot; 0 if it has none until it claims one.
        scheduler: Decides when it acts.
        names: Which robot answers on which port name.

    Attributes:
        is_silenced: Whether it was disconnected because it was silent.
        is_stopped: Whether a person has stopped it; then its robots stop when it has left.
        reason: Why KiKS has ended it, such as 'used more than 512 MB of memory'; then its robots stop, too. Else empty.
        is_closed: Whether the connection is closed.
        may_stand: Whether the world believes it that a debugger has stopped it.
        holds_world: Whether the world waits for it while it thinks.
        answer: The last answer to a program in a thread; None until it is there.
        consult: Called with a request for the debugger; None if the program has none.
        is_consulting: Whether it waits for its debugger.
        thinking_ns: Shortest time between what it has read of a robot and its next command to that robot [ns]. It says
            itself when its commands come; the world makes those wait that come sooner.
    """

    _sent_limit = NEVER_NS
    """Characters sent beyond which it is checked whether the lines take as many."""

    may_stand = False
    answer: Answer | None = None
    consult: Callable[[Request], object] | None = None
    is_closed = is_consulting = False
    holds_world = True
    thinking_ns = 0

    def __init__(self, name: str, rank: int, robot: int, scheduler: ProgramScheduler, names: PortNames) -> None:
        super().__init__(name, rank)
        self.robot = robot
        self.is_here = False
        self.is_silenced = False
        self.is_stopped = False
        self.reason = ""
        self._world, self._wires = scheduler.loop.world, scheduler.loop.wires
        self._scheduler = scheduler
        self._names = names
        self._requests: deque[Request] = deque()
        self._pending_read: Request | None = None
        self._lines = _ClaimedLines()
        self._sent_count = 0
        self._used: set[int] = set()
        self._thinks_until_ns: dict[int, int] = {}
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
        self.add_request(Request(Verb.END, 0, self.acts_from_ns))

    def disconnect(self) -> None:
        """Disconnect the program at once, and drop its requests that are not done yet."""
        if self.has_left:
            return
        self._requests.clear()
        self._pending_read = None
        self.waits = False
        self._free_robots()
        self.has_left = True

    def end_because(self, reason: str) -> None:
        """End the program at once: it has broken a rule.

        Args:
            reason: What it has done, such as 'used more than 512 MB of memory'.
        """
        if not self.reason:
            self.reason = reason
            self.abort()
            self.expel()

    def abort(self) -> None:
        """Disconnect the program at once, or as the world begins: it waits for as many programs as are to come."""
        # The count of programs with which the world begins must not fall: it would begin without the others.
        if self._scheduler.has_begun:
            self.disconnect()
        else:
            self._requests.clear()
            self.leave()

    def expel(self) -> None:
        """Close the connection to a program that has broken a rule."""
        self.close()

    def add_request(self, request: Request) -> None:
        """Take a request of the program."""
        if self.has_left:
            return
        # One comparison, as this is asked for each request.
        if request.kind >= Verb.STAND and self._take_at_once(request):
            return
        # A program takes part from its first request on: imports take a real time that no other one shall feel.
        if not self.is_here:
            self.is_here = True
            self.is_waited_for = self.holds_world and not self.is_silenced
            self.acts_from_ns = self._world.now_ns
        self.patience.renew()
        # It only moves the program's time, so nothing has to be done in the order of events.
        if request.kind == Verb.REACHED and not self._requests and not self.waits:
            self._note_thinking(request)
            self.acts_from_ns = max(self.acts_from_ns, request.at_ns)
        else:
            self._requests.append(request)

    def _take_at_once(self, request: Request) -> bool:
        """Do a request for a debugger, which has no place in the order of events; return whether it is done."""
        if request.kind == Verb.STAND:
            self.stands = self.may_stand and request.arguments[0]
            self._scheduler.note_standing()
            self._scheduler.note_seen(request.at_ns if self.stands else 0)
        elif request.kind == Verb.DEBUG:
            if self.consult is None:
                raise MessageError("asked for a debugger that it does not have")
            self.is_consulting = True
            self.consult(request)
        elif self._stand_others:
            self._look(request, is_late=True)
        else:
            return False
        return True

    @property
    def _stand_others(self) -> bool:
        return any(each.stands for each in self._scheduler.participants if each is not self)

    def note_standing(self) -> None:
        """Look at a robot as the world is now, as the program's turn would not come while another one stands."""
        requests = self._requests
        if requests and requests[-1].kind == Verb.LOOK and self._stand_others:
            self._look(requests.pop(), is_late=True)

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
            _ACTS[request.kind](self, request)
        except MessageError as error:
            self.end_because(str(error))
        except KiksError as error:
            self._answer(at_ns, error=str(error))

    def check_wait(self) -> None:
        """Answer a read, or a wait for several reads, if its end is known."""
        request = self._pending_read
        if request is not None and request.kind == Verb.WAIT:
            self._check_wait_for_all(request)
        elif request is not None:
            self._check_read(request)

    def _check_read(self, request: Request) -> None:
        wire = self._lines[request.robot]
        size, terminator, timeout_ns, poll_ns = request.arguments
        deadline_ns = NEVER_NS if timeout_ns is None else self.acts_from_ns + timeout_ns
        end = end_of_read(wire, size, terminator, deadline_ns, self.acts_from_ns, poll_ns)
        if end is None:
            return
        self._pending_read = None
        self.waits = False
        end_ns, count = end
        if end_ns == NEVER_NS:
            self._answer(self.acts_from_ns, error=str(never_ends(request.robot, wire)))
        else:
            data = wire.line.take(count)
            if not data:
                wire.note_wait(end_ns)
            self._answer(max(end_ns, self.acts_from_ns), (data, wire.line.taken_ns), robot=request.robot)
            self._note_reading(request.robot)

    def _check_wait_for_all(self, request: Request) -> None:
        wires, (reads, until_ns) = self._wires, request.arguments
        reads = [Read(*read) for read in reads]
        end_ns, is_known = end_of_wait(wires, reads, until_ns)
        if not is_known:
            return
        self._pending_read = None
        self.waits = False
        now_ns = self.acts_from_ns if end_ns == NEVER_NS else max(end_ns, self.acts_from_ns)
        are_complete = [is_complete(wires[read.robot - 1], read, now_ns) for read in reads]
        self._answer(now_ns, are_complete)
        for read, is_read in zip(reads, are_complete, strict=True):
            # By its terminator, a program may ask for what has arrived.
            if is_read:
                self._note_reading(read.robot)

    def _note_reading(self, robot: int) -> None:
        """Note that the program has an answer of a robot now: its next command to it may follow from that."""
        if self.thinking_ns:
            self._thinks_until_ns[robot] = self.acts_from_ns + self.thinking_ns

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
            # What it says it has thought cannot be longer than the time that has passed.
            until_ns = max(min(self.acts_from_ns + request.thought_ns, request.at_ns), self.acts_from_ns)
            for wire in self._lines.values():
                wire.think(self.acts_from_ns, until_ns)

    # ---- what it does for a request, at the instant at which the program acts ----

    def _read(self, request: Request) -> None:
        self._pending_read = request
        self.waits = True
        self._check_read(request)

    def _wait(self, request: Request) -> None:
        # Before anything waits for one of them.
        for read in request.arguments[0]:
            _ = self._lines[read[0]]  # an error if the program may not use it
        self._pending_read = request
        self.waits = True
        self._check_wait_for_all(request)

    def _send_characters(self, request: Request) -> None:
        at_ns, data = self.acts_from_ns, request.arguments[0]
        wire = self._lines[request.robot]
        until_ns = self._thinks_until_ns.get(request.robot, 0)
        if until_ns > at_ns:
            # Too soon after the reading from which the command may follow: it comes again then.
            self._requests.appendleft(request._replace(at_ns=until_ns, thought_ns=until_ns - at_ns))
            return
        self._sent_count += len(data)
        # Counted in steps, as the exact count of what is on the line costs more than the exchange.
        if self._sent_count > self._sent_limit:
            self._check_room(wire)
        wire.send(data, at_ns)

    def _look(self, request: Request, *, is_late: bool = False) -> None:
        loop, now_ns, found, error = self._scheduler.loop, max(self.acts_from_ns, request.at_ns), None, ""
        if not self.may_stand or not 1 <= request.robot <= len(self._wires):
            error = (
                f"a program must look at a robot that it may see, from 1 to {len(self._wires)} in a world of its own "
                f"user, but it was robot {request.robot}. Look at another one."
            )
        else:
            if not is_late:
                loop.advance_to(now_ns)
            found = state_of(loop, request.robot)
        self.reply(Answer(request.ticket, now_ns, found, 0, error))

    def _find(self, request: Request) -> None:
        self._answer(self.acts_from_ns, self._names.robot(request.arguments[0], self.robot))

    def _answer_room(self, request: Request) -> None:
        room_ns = self._lines[request.robot].line.room_ns(request.arguments[0])
        if room_ns > self.acts_from_ns:
            self._warn_of_backlog(request.robot)
        self._answer(self.acts_from_ns, room_ns, robot=request.robot)

    def _claim(self, request: Request) -> None:
        robot = request.robot
        if not 1 <= robot <= len(self._wires):
            raise MessageError(f"asked for robot {robot}, which there is not")
        self._names.check(robot, self.robot)
        wire = self._wires[robot - 1]
        claim(wire, robot, request.arguments[0])
        self._lines[robot] = wire
        self._used.add(robot)
        self._answer(self.acts_from_ns, robot=robot)
        self._note_reading(robot)

    def _hang_up(self, request: Request) -> None:
        # A program whose claim has failed hangs up, too.
        if (wire := self._lines.pop(request.robot, None)) is not None:
            wire.holder = None
            wire.hang_up()

    def _use_line(self, request: Request) -> None:
        at_ns, robot = self.acts_from_ns, request.robot
        result = LINE_REQUESTS[request.kind](self._lines[robot], at_ns, *request.arguments)
        if request.kind in ASKING:
            self._answer(at_ns, result, robot=robot)

    def _end(self, _request: Request) -> None:
        """Release the robots of the program, which has left, and close the connection."""
        self._free_robots()
        self._scheduler.note_seen(self.acts_from_ns)
        self.close()
        self.has_left = True

    # ---- inside ----

    def _check_room(self, wire: Wire) -> None:
        """Check that a line has room by far for what the program sends: it should have asked.

        Raises:
            MessageError: If it has not.
        """
        count = self._sent_count
        if count > BURST_MAX + self.acts_from_ns // _SHORTEST_NS * len(self._lines) or len(wire.pending) > PENDING_MAX:
            raise MessageError("sent more characters than its line takes")
        self._sent_limit = count + BACKLOG_LIMIT

    def _free_robots(self) -> None:
        """Release its robots; they drive on, unless a person or KiKS has ended the program."""
        wires = self._wires
        for wire in self._lines.values():
            wire.holder = None
            wire.hang_up()
        self._lines.clear()
        if self.is_stopped or self.reason:
            now_ns = heard_ns = self._world.now_ns
            for robot in {self.robot, *self._used} - {0}:
                if wires[robot - 1].holder is None:
                    wires[robot - 1].halt(now_ns)
                    heard_ns = max(heard_ns, wires[robot - 1].line.hearing_until_ns)
            # Without another program nothing else would let the time pass that the wheels take to stop.
            self._scheduler.note_seen(heard_ns + STOPPING_NS)

    def _answer(self, now_ns: int, result: object = None, *, robot: int = 0, error: str = "") -> None:
        """Answer a request, so the program goes on."""
        # A stranger's request may name any time, and a time beyond the clock's end has no place in a message.
        if now_ns > CLOCK_END_NS:
            now_ns = CLOCK_END_NS
        ahead_count = 0
        # How far it is ahead lets the program send without asking, as long as there is room by far.
        if robot:
            line = self._wires[robot - 1].line
            ahead_count = max(-((now_ns - line.sending_until_ns) // line.character_ns), 0)
        self.acts_from_ns = now_ns
        self.reply(Answer(self._ticket, now_ns, result, ahead_count, error))


_ACTS: dict[int, Callable[[ProgramParticipant, Request], None]] = {
    **dict.fromkeys(LINE_REQUESTS, ProgramParticipant._use_line),
    Verb.REACHED: lambda program, request: None,
    Verb.MEET: lambda program, request: program._answer(program.acts_from_ns),
    Verb.FIND: ProgramParticipant._find,
    Verb.CLAIM: ProgramParticipant._claim,
    Verb.HANG_UP: ProgramParticipant._hang_up,
    Verb.SEND: ProgramParticipant._send_characters,
    Verb.ROOM: ProgramParticipant._answer_room,
    Verb.READ: ProgramParticipant._read,
    Verb.WAIT: ProgramParticipant._wait,
    Verb.LOOK: ProgramParticipant._look,
    Verb.DOUBT: lambda program, request: program._scheduler.note_doubt(request.arguments[0]),
    Verb.END: ProgramParticipant._end,
}
"""What is done for each kind of request."""

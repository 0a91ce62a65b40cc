"""A recorded run again: a simulation that its inputs move, from any time on.

The simulation is a living one: what stands in the recording comes to it at the same instants, between the same events.
It can be looked at, made to pass at any speed, and let go on without the recording.
"""

from __future__ import annotations

from collections.abc import Callable
from threading import RLock

from kiks.model.checks import CLOCK_END_NS
from kiks.recording.entries import Entry, parse_score
from kiks.recording.log import HASH_LENGTH, EntryPlace, RecordedLog, has_state
from kiks.recording.recorder import CHECK_NS
from kiks.sim.port import BAUD_MAX, BAUD_MIN
from kiks.sim.read_completion import NEVER_NS
from kiks.sim.run_log import Kind
from kiks.sim.saved_state import SavedState
from kiks.sim.simulation import Simulation
from kiks.sim.wire import Wire, ignore_reply
from kiks.units import s_from_ns


class Replay:
    """A recorded run from a time on, as a `kiks.sim.event_loop.Supervisor` of its simulation.

    At each checkpoint it compares its state with the recorded one. Where it differs, it goes on from the recorded one,
    if that is there.

    Args:
        log: The log of a recording.
        time_ns: Where it begins [ns].
        lock: That of a simulation whose place this one takes; a new one if left out.

    Attributes:
        sim: The simulation.
        next_ns: When the next input is due [ns].
        equal_count: Number of checkpoints that were the same, to the bit.
        check_count: Number of checkpoints that it has passed.
        differs_ns: Time of the first one that was not the same [ns]; None if all were.
        state_hash: The recorded hash of the state at the last one.
        on_change: Called before and after a state is taken from the recording.
        on_check: Called at each checkpoint, before the states are compared.
    """

    def __init__(self, log: RecordedLog, time_ns: int = 0, *, lock: RLock | None = None) -> None:
        self._log = log
        self.on_change: Callable[[], None] = lambda: None
        self.on_check: Callable[[], None] = lambda: None
        self.equal_count = self.check_count = 0
        self.differs_ns: int | None = None
        self.state_hash = ""
        place = log.place_before(time_ns)
        saved = log.state_of(log.entry(place))
        self.sim = saved.simulation(lock)
        for wire in self.sim.wires:
            wire.firmware.gives_hints = False  # they were given when it was recorded
        self._begin(place, saved)
        self.sim.loop.supervisor = self
        self.sim.advance_to(time_ns)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self._log.reader.what}: {self.sim!r}>"

    def go_to(self, time_ns: int) -> bool:
        """Go to another time of the recording, back or on, with the same simulation.

        Args:
            time_ns: The time [ns].

        Returns:
            Whether that was possible: a simulation gets robots and turrets, but never loses them. Where the world has
            fewer of them, nothing has changed, and another replay can begin there.
        """
        sim = self.sim
        place = self._log.place_before(time_ns)
        if time_ns < sim.now_ns or place > self._place:
            saved = self._log.state_of(self._log.entry(place))
            if not saved.can_restore(sim):
                return False
            self._begin(place, saved)
            for wire in sim.wires:
                wire.restart_log(sim.now_ns)
        sim.advance_to(time_ns)
        return True

    def _begin(self, place: EntryPlace, saved: SavedState) -> None:
        self._restore(saved)
        self._place, self._place_ns = place, saved.now_ns
        self._find_next()

    def _restore(self, saved: SavedState) -> None:
        self.on_change()
        saved.restore(self.sim)
        self.on_change()

    def let_go(self) -> Simulation:
        """Return the simulation, which goes on without the recording from now on; its programs have hung up."""
        self.sim.loop.supervisor = None
        for wire in self.sim.wires:
            wire.hang_up()
        return self.sim

    def advance(self) -> bool:
        """Let time pass up to the next input; return whether there was one."""
        if self._next is None:
            return False
        self.sim.advance_to(self.next_ns)
        return True

    def act(self) -> None:
        """Let the inputs come that are due, up to the next one before which robots act."""
        is_due, time_ns = True, self.next_ns
        while is_due and self._next is not None:
            self._apply(self._next)
            self._place, self._place_ns = self._next_place, self.next_ns
            has_acted = self._find_next()
            is_due = self.next_ns == time_ns and not has_acted

    def _find_next(self) -> bool:
        """Find the next input, if there is one; return whether robots act before it."""
        self._next: Entry | None = None
        self.next_ns, has_acted = NEVER_NS, False
        if (found := self._log.next_input(self._place)) is not None:
            self._next_place, self._next, has_acted = found
            self.next_ns = self._next.time_ns
            if not 0 <= self.next_ns - self._place_ns <= CHECK_NS:
                raise self._log.damaged(f"a part is missing after {s_from_ns(self._place_ns):.3f} s")
        return has_acted

    def _sent_ns(self, entry: Entry) -> int:
        if not 0 <= entry.number <= CLOCK_END_NS:
            raise self._log.damaged("characters were sent at no time of its clock")
        return entry.number

    def _apply(self, entry: Entry) -> None:
        sim = self.sim
        match entry.kind:
            case Kind.SEND | Kind.TYPE | Kind.HANG_UP | Kind.SET_BAUD | Kind.DROP:
                if entry.robot >= len(sim.wires):
                    raise self._log.damaged(f"it uses the line of robot {entry.robot + 1}, which is not there")
                self._apply_to(sim.wires[entry.robot], entry)
            case Kind.CHECK:
                sim.sync()
                for each in sim.wires:
                    each.line.forget()  # unread replies would fill the line
                self._compare(entry)
            case Kind.STATE:
                sim.sync()
                self._restore(self._log.state_of(entry))
            case Kind.SCORE:
                sim.set_score(*parse_score(entry))

    def _compare(self, checkpoint: Entry) -> None:
        self.check_count += 1
        self.state_hash = checkpoint.data[:HASH_LENGTH].decode("ascii", "replace")
        self.on_check()
        if self.sim.state_hash() == self.state_hash:
            self.equal_count += 1
            return
        if self.differs_ns is None:
            self.differs_ns = checkpoint.time_ns
        if has_state(checkpoint):
            self._restore(self._log.state_of(checkpoint))

    def _apply_to(self, wire: Wire, entry: Entry) -> None:
        match entry.kind:
            case Kind.SEND:
                wire.send(entry.data, self._sent_ns(entry))
            case Kind.TYPE:
                wire.send(entry.data, self._sent_ns(entry), ignore_reply)
            case Kind.HANG_UP:
                wire.hang_up()
            case Kind.SET_BAUD:
                if not BAUD_MIN <= entry.number <= BAUD_MAX:
                    raise self._log.damaged(f"it sets a line to {entry.number} bit/s")
                wire.set_baud(entry.number)
            case Kind.DROP:
                wire.drop_after(entry.number, entry.other)


def check_recording(log: RecordedLog) -> Replay:
    """Make a recorded run again, up to its end or the first checkpoint at which it is another one; return the replay.

    Args:
        log: The log of the recording.
    """
    replay = Replay(log, log.begin_ns)
    while replay.differs_ns is None and replay.advance():
        pass
    return replay

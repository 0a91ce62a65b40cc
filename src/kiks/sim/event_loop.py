"""The event loop of a simulation: time passes from one event on a robot's serial line to the next."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from heapq import heappop, heappush
from typing import Protocol

from kiks.clock.gate import Gate
from kiks.clock.radio_delay import delay_of
from kiks.firmware.firmware import Firmware
from kiks.model.checks import CLOCK_END_NS, check_count
from kiks.model.radio_link import RadioLink
from kiks.sim.read_completion import NEVER_NS
from kiks.sim.run_log import WireRecorder
from kiks.sim.wire import Wire
from kiks.sim.world import World
from kiks.units import TICK_NS


class Supervisor(Protocol):
    """Acts in the world at instants of its own choice, after all events of that instant."""

    next_ns: int

    def act(self) -> None:
        """Act, and choose a later `next_ns`, or raise to end the run."""


class LoopRecorder(WireRecorder, Protocol):
    """Records a run without a change of it.

    Attributes:
        next_ns: When `check` is due [ns].
    """

    next_ns: int

    def note_act(self) -> None:
        """Note that a robot acts now, maybe between two inputs of this instant."""

    def note_changes(self) -> None:
        """Note what was changed from outside."""

    def say(self, robot: int, line: str) -> None:
        """Note a line that the program of a robot's index has printed; from any thread, which waits for nothing."""

    def check(self) -> None:
        """Note the state, after all events up to `next_ns`, and choose a later `next_ns`."""


class EventLoop:
    """Lets time pass in a world: does the events on its serial lines in their order.

    Args:
        world: The world.
        sync: Brings the world up to date before an event.

    Attributes:
        wires: The robots' serial lines.
        gate: Decides how far time may go while it is watched; None while nothing watches it.
        supervisor: Acts in the world at certain instants, such as a referee; None without one.
        end_ns: Where time ends [ns]; see `end_at`.
        on_slice: Called after each slice of a long time; may raise to stop there.
    """

    def __init__(self, world: World, sync: Callable[[], None]) -> None:
        self.world = world
        self.lock = world.lock
        self.wires: list[Wire] = []
        self._link = RadioLink()
        self.gate: Gate | None = None
        self.supervisor: Supervisor | None = None
        self._recorder: LoopRecorder | None = None
        # From when on the recorder must be asked: one comparison for each piece of time.
        self._record_ns = NEVER_NS
        self.on_slice: Callable[[], None] = lambda: None
        self.end_ns = CLOCK_END_NS
        self._end: Callable[[], object] = lambda: None
        # Up to when time may pass in one piece: one comparison, too.
        self._near_ns = -1
        world.on_change = self._look_again
        self._sync = sync
        # A heap of times [ns], with the indices of wires: the earliest event is found without asking every wire.
        self._events: list[tuple[int, int]] = []

    @property
    def recorder(self) -> LoopRecorder | None:
        """Records the run; None while nothing does."""
        return self._recorder

    @recorder.setter
    def recorder(self, recorder: LoopRecorder | None) -> None:
        self._recorder = recorder
        self._look_again()

    def _look_again(self) -> None:
        """Let the recorder look for changes before time passes, and find out anew how far it may in one piece."""
        self._record_ns = NEVER_NS if self._recorder is None else -1
        self._near_ns = -1

    def end_at(self, time_ns: int, end: Callable[[], object]) -> None:
        """Let time end at an instant [ns]: when it would pass beyond, `end` is called there, to raise or to move it."""
        self.end_ns, self._end = time_ns, end
        self._near_ns = -1

    def check_end(self, time_ns: int) -> None:
        """End the run if all that is still to come is at an instant [ns] beyond the end of time."""
        if NEVER_NS > time_ns > self.end_ns:
            self.advance_to(self.end_ns + 1)

    def add_wire(self, firmware: Firmware) -> None:
        """Add the serial line of one more robot."""
        wire = Wire(firmware, partial(heappush, self._events), len(self.wires))
        wire.line.delay = delay_of(self._link, self.world.seed, len(self.wires))
        self.wires.append(wire)

    @property
    def link(self) -> RadioLink:
        """The link between each program and its robot."""
        return self._link

    @link.setter
    def link(self, link: RadioLink) -> None:
        self._link = link
        for index, wire in enumerate(self.wires):
            wire.line.delay = delay_of(link, self.world.seed, index)

    def advance_to(self, time_ns: int) -> None:
        """Let time pass up to a time [ns]; does nothing if that has passed already."""
        # Nearly always near: one comparison in place of a check and a loop.
        if not (time_ns.__class__ is int and time_ns <= self._near_ns):
            time_ns = self._come_near(time_ns)
        supervisor = self.supervisor
        if supervisor is not None:
            # Events up to its instant come first: a referee judges what has happened.
            while supervisor.next_ns <= time_ns:
                self._pass_gate_to(supervisor.next_ns)
                supervisor.act()
        self._pass_gate_to(time_ns)

    def _come_near(self, time_ns: int) -> int:
        """Let time pass in slices until one more is left to a time [ns]; return that time.

        The engine is behind the clock until the state is read. After each slice it catches up, so that never more than
        some milliseconds of work are due, and a signal or a request need not wait for a long sleep of a program.
        """
        time_ns = check_count("time_ns", time_ns, -CLOCK_END_NS, CLOCK_END_NS)
        world = self.world
        while True:
            self._near_ns = min(world.state.tick_count * TICK_NS + world.slice_ns, self.end_ns)
            if time_ns <= self._near_ns:
                return time_ns
            if world.now_ns >= self.end_ns:
                self._end()
            self.advance_to(self._near_ns)
            self._sync()
            self.on_slice()

    def _pass_gate_to(self, time_ns: int) -> None:
        gate = self.gate
        if gate is not None and gate.is_up:
            # The gate admits time in pieces: people change the world between two of them.
            while (until_ns := gate.admit(self.world.now_ns, time_ns)) < time_ns:
                self._advance_to(until_ns)
        self._advance_to(time_ns)

    def _advance_to(self, time_ns: int) -> None:
        recorder = self._recorder
        if time_ns >= self._record_ns and recorder is not None:
            # What was changed from outside lies before the events that are still to come.
            recorder.note_changes()
            while recorder.next_ns <= time_ns:
                self._do_events_to(recorder.next_ns)
                recorder.check()
            # A program that holds the array of lamps can write to it at any time, without a call.
            self._record_ns = -1 if self.world.lamps_exposed else recorder.next_ns
        self._do_events_to(time_ns)

    def _do_events_to(self, time_ns: int) -> None:
        world, wires = self.world, self.wires
        while (event := self._next_event()) is not None and event[0] <= time_ns:
            due_ns, index = event
            if due_ns > world.now_ns:
                world.now_ns = due_ns
            # Inputs and acts of one instant have an order, which a replay must repeat.
            elif self._recorder is not None:
                self._recorder.note_act()
            self._sync()
            wires[index].act(world.now_ns)
        if time_ns > world.now_ns:
            world.now_ns = time_ns

    def catch_up(self) -> None:
        """Bring the world up to date, so that its state may be read."""
        self._sync()

    def next_event_ns(self) -> int | None:
        """Return when a robot acts next [ns]; None while all of them wait for characters."""
        event = self._next_event()
        return None if event is None else event[0]

    def _next_event(self) -> tuple[int, int] | None:
        """Return the time [ns] of the earliest event and the index of its wire; None if there is no event.

        At the same instant, the wire with the lower number comes first.
        """
        events, wires = self._events, self.wires
        # A wire that has acted, or acts sooner than it was added for, leaves an outdated entry behind.
        while events and wires[events[0][1]].next_ns != events[0][0]:
            heappop(events)
        return events[0] if events else None

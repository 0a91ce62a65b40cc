"""The server of real ports: one thread that waits for clients and for the simulation."""

from __future__ import annotations

import logging
import selectors
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import chain

from kiks.clock.pace import Pace
from kiks.clock.patience import Patience
from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.clock.thinking import ThinkingFixed, parse_thinking
from kiks.ending import postponing_endings
from kiks.errors import ParameterError, shown
from kiks.ports.endpoint import Channel, Endpoint
from kiks.ports.live import Live, ServedRobot, TimePolicy
from kiks.ports.lockstep import Lockstep
from kiks.ports.program_scheduler import PATIENCE_S, ProgramScheduler
from kiks.ports.resources import check_files
from kiks.sim.port import BAUD_MAX, BAUD_MIN
from kiks.sim.simulation import Simulation

_log = logging.getLogger("kiks.serve")


class Server:
    """Serves the robots of a simulation to programs in other processes.

    Args:
        sim: The simulation; others may use it at the same time if they hold its lock.
        endpoints: The endpoints of each robot, by its number from 1. The server closes them.
        speed: Simulated seconds per real second (live only).
        thinking: 'live': the world runs all the time. 'none' or 'fixed:MS': the world waits for each command, before
            which no or a fixed time passes; repeatable to the bit for programs that wait for their replies.
        programs: Number of programs that begin together; the number of robots if left out (not live).
        when_silent: What happens to a program that is silent while others wait for it: 'wait': the world waits for it;
            'drop': it is disconnected; 'ignore': the world no longer waits for it (not live).
        patience_s: How long a program may be silent [s of real time].
        pace: A pace to share, instead of `speed`.
        new_patience: Makes patiences with another wall clock, such as one that stands still while the world does.

    Example:
        >>> from kiks.ports.tcp import TcpEndpoint
        >>> server = Server(Simulation(), {1: [TcpEndpoint(0)]}, thinking="none")
        >>> server.serve(until=lambda: True)
        >>> server.close()
    """

    def __init__(
        self,
        sim: Simulation,
        endpoints: Mapping[int, Sequence[Endpoint]],
        *,
        speed: float = 1.0,
        thinking: str = "live",
        programs: int | None = None,
        when_silent: str = "ignore",
        patience_s: float = PATIENCE_S,
        pace: Pace | None = None,
        new_patience: Callable[[float], Patience] = Patience,
    ) -> None:
        # Its selector takes one, the pair of sockets that wakes it two, and a client of each endpoint one.
        check_files("the server of ports", 3 + sum(map(len, endpoints.values())))
        self.sim = sim
        self._timing: TimePolicy
        if thinking == "live":
            self._timing = Live(sim, Pace(speed) if pace is None else pace)
        else:
            scheduler = ProgramScheduler(
                sim,
                expected=_check_programs(len(endpoints) if programs is None else programs, len(endpoints)),
                missing=self._missing,
                log=_log,
                when_silent=when_silent,
                patience_s=patience_s,
                new_patience=new_patience,
            )
            self._timing = Lockstep(sim, _fixed_ns(thinking), scheduler)
        self._served = {robot: ServedRobot(robot, sim.wires[sim.index_of(robot)]) for robot in endpoints}
        self._endpoints = {robot: list(each) for robot, each in endpoints.items()}
        self._selector = selectors.DefaultSelector()
        for served in self._served.values():
            self._listen(served)

    def serve(self, until: threading.Event | Callable[[], bool] | None = None) -> None:
        """Serve until an event is set, a function returns True, or Ctrl-C; checked at least every 50 ms."""
        is_over = until.is_set if isinstance(until, threading.Event) else until or (lambda: False)
        served_robots = list(self._served.values())
        self._timing.start()
        while not is_over():
            with self.sim.lock:
                wait_s = self._timing.advance(served_robots)
                for served in served_robots:
                    if served.is_dropped:
                        self._disconnect(served)
                    if served.is_leaving and served.client.has_left:
                        self._free(served)
                    if served.channel is not None and served.channel.has_ahead and not served.client.is_full:
                        self._exchange(served, selectors.EVENT_READ)
                    self._select_events(served)
            ready = self._selector.select(wait_s)
            with self.sim.lock:
                self._timing.catch_up()
                for key, events in ready:
                    key.data(events)

    def drop_clients(self) -> None:
        """Disconnect all clients soon; from any thread. Their robots drive on."""
        for served in self._served.values():
            served.is_dropped = served.channel is not None

    @postponing_endings()
    def close(self) -> None:
        """Disconnect all clients, close all endpoints and remove their files."""
        with self.sim.lock:
            for served in self._served.values():
                if served.channel is not None:
                    self._disconnect(served)
                if served.is_leaving:
                    self._free(served)
        self._selector.close()
        for endpoint in chain.from_iterable(self._endpoints.values()):
            endpoint.close()
        self._endpoints.clear()

    # ---- clients; Ctrl-C in the middle of these would leave descriptors of which the selector knows a half ----

    def _listen(self, served: ServedRobot) -> None:
        """Wait for a client at all endpoints of a robot."""
        for endpoint in self._endpoints[served.robot]:
            self._selector.register(endpoint.fileno(), selectors.EVENT_READ, partial(self._accept, served, endpoint))

    @postponing_endings()
    def _accept(self, served: ServedRobot, endpoint: Endpoint, _events: int) -> None:
        """Accept a client if the robot has none."""
        wire = served.wire
        if served.is_leaving:
            return
        # The server does not read while the line is full, so it does not see the end of a client that has sent ahead.
        if self._has_gone_unnoticed(served):
            self._disconnect(served)
            return
        if wire.holder is not None:
            endpoint.reject()
            if endpoint.name not in served.refused:
                served.refused.add(endpoint.name)
                _log.warning(
                    "robot %d must have one client at a time, but another came to %s while %s has it. "
                    "Close that one first.",
                    served.robot,
                    endpoint.name,
                    wire.holder,
                )
            return
        channel = endpoint.accept()
        if channel is None:
            return
        # A pseudo-terminal has one descriptor for both.
        if channel.fileno() == endpoint.fileno():
            self._selector.unregister(endpoint.fileno())
        served.clear()
        served.channel = channel
        wire.enter_client(f"the client of {endpoint.name}", self.sim.now_ns)
        served.client = self._timing.enter(served)
        _log.info("robot %d has a client at %s", served.robot, endpoint.name)
        self._select_events(served)

    @postponing_endings()
    def _disconnect(self, served: ServedRobot) -> None:
        """Disconnect a client. The next one waits until its commands have acted."""
        channel = served.channel
        if channel is None:
            return
        if served.events:
            self._selector.unregister(channel.fileno())
            served.events = 0
        for endpoint in self._endpoints[served.robot]:
            if endpoint.fileno() in self._selector.get_map():
                self._selector.unregister(endpoint.fileno())
        channel.close()
        served.channel = None
        served.is_dropped = False
        served.is_leaving = True
        served.client.leave()
        _log.info("robot %d has lost its client at %s", served.robot, channel.name)
        if served.client.has_left:
            self._free(served)

    def _has_gone_unnoticed(self, served: ServedRobot) -> bool:
        """Return whether a client has gone whose end the server has not read, because the line is full."""
        channel = served.channel
        return channel is not None and self._timing.forgets and served.client.is_full and channel.find_end()

    @postponing_endings()
    def _free(self, served: ServedRobot) -> None:
        """Free the robot for the next client."""
        served.clear()
        served.wire.leave_client(self.sim.now_ns)
        self._listen(served)

    def _missing(self) -> str:
        """Return the names of the missing programs."""
        robots = [
            str(served.robot) for served in self._served.values() if served.channel is None and not served.is_leaving
        ]
        return f"that of robot {' or '.join(robots)}"

    # ---- bytes ----

    def _exchange(self, served: ServedRobot, events: int) -> None:
        """Read or write, as the channel's descriptor is ready for it."""
        channel = served.channel
        if channel is None:
            return
        if events & selectors.EVENT_WRITE:
            channel.flush()
        if events & selectors.EVENT_READ:
            data = channel.read()
            if data is None:
                self._disconnect(served)
                return
            baud = channel.baud
            # A speed that no robot has is no reason to disconnect: the line keeps its own.
            if baud is not None and baud != served.wire.line.baud and BAUD_MIN <= baud <= BAUD_MAX:
                served.wire.set_baud(baud)
            if data:
                served.client.receive(data)

    def _select_events(self, served: ServedRobot) -> None:
        """Select the events of the channel: reading if the line has room, writing if characters wait.

        A descriptor that is registered with no event would still report a hang-up, again and again: it is removed.
        """
        channel = served.channel
        if channel is None:
            return
        is_full = served.client.is_full
        if is_full:
            channel.warn(
                f"the client of {channel.name} must wait for its replies, but it is more than {BACKLOG_LIMIT - 1} "
                "characters ahead of its robot; what it sends now has to wait. Read a line after each command."
            )
        events = (0 if is_full else selectors.EVENT_READ) | (selectors.EVENT_WRITE if channel.has_unsent else 0)
        if events != served.events:
            self._select(served, channel, events)

    @postponing_endings()
    def _select(self, served: ServedRobot, channel: Channel, events: int) -> None:
        if not events:
            self._selector.unregister(channel.fileno())
        elif served.events:
            self._selector.modify(channel.fileno(), events, partial(self._exchange, served))
        else:
            self._selector.register(channel.fileno(), events, partial(self._exchange, served))
        served.events = events


def _fixed_ns(thinking: str) -> int:
    policy = parse_thinking(thinking)
    if not isinstance(policy, ThinkingFixed):
        raise ParameterError(
            f"thinking of a server must be 'live', 'none' or 'fixed:MS', but it was {shown(thinking)}. "
            "The other policies are for ports in memory."
        )
    return policy.time_ns


def _check_programs(programs: int, robots: int) -> int:
    if not isinstance(programs, int) or not 1 <= programs <= max(robots, 1):
        raise ParameterError(
            f"programs must be a whole number from 1 to {max(robots, 1)}, the number of robots, but it was "
            f"{shown(programs)}. Each program has a robot of its own."
        )
    return programs

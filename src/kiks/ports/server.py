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
from kiks.ports.live import Link, Live, TimePolicy
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
        self._links = {robot: Link(robot, sim.wires[sim.index_of(robot)]) for robot in endpoints}
        self._endpoints = {robot: list(each) for robot, each in endpoints.items()}
        self._selector = selectors.DefaultSelector()
        for link in self._links.values():
            self._listen(link)

    def serve(self, until: threading.Event | Callable[[], bool] | None = None) -> None:
        """Serve until an event is set, a function returns True, or Ctrl-C; checked at least every 50 ms."""
        is_over = until.is_set if isinstance(until, threading.Event) else until or (lambda: False)
        links = list(self._links.values())
        self._timing.start()
        while not is_over():
            with self.sim.lock:
                wait_s = self._timing.advance(links)
                for link in links:
                    if link.is_dropped:
                        self._disconnect(link)
                    if link.is_leaving and self._timing.has_left(link):
                        self._free(link)
                    if link.channel is not None and link.channel.has_ahead and not self._timing.is_full(link):
                        self._exchange(link, selectors.EVENT_READ)
                    self._select_events(link)
            ready = self._selector.select(wait_s)
            with self.sim.lock:
                self._timing.catch_up()
                for key, events in ready:
                    key.data(events)

    def drop_clients(self) -> None:
        """Disconnect all clients soon; from any thread. Their robots drive on."""
        for link in self._links.values():
            link.is_dropped = link.channel is not None

    @postponing_endings()
    def close(self) -> None:
        """Disconnect all clients, close all endpoints and remove their files."""
        with self.sim.lock:
            for link in self._links.values():
                if link.channel is not None:
                    self._disconnect(link)
                if link.is_leaving:
                    self._free(link)
        self._selector.close()
        for endpoint in chain.from_iterable(self._endpoints.values()):
            endpoint.close()
        self._endpoints.clear()

    # ---- clients; Ctrl-C in the middle of these would leave descriptors of which the selector knows a half ----

    def _listen(self, link: Link) -> None:
        """Wait for a client at all endpoints of a robot."""
        for endpoint in self._endpoints[link.robot]:
            self._selector.register(endpoint.fileno(), selectors.EVENT_READ, partial(self._accept, link, endpoint))

    @postponing_endings()
    def _accept(self, link: Link, endpoint: Endpoint, _events: int) -> None:
        """Accept a client if the robot has none."""
        wire = link.wire
        if link.is_leaving:
            return
        if self._has_gone_unnoticed(link):
            self._disconnect(link)
            return
        if wire.holder is not None:
            endpoint.reject()
            if endpoint.name not in link.refused:
                link.refused.add(endpoint.name)
                _log.warning(
                    "robot %d must have one client at a time, but another came to %s while %s has it. "
                    "Close that one first.",
                    link.robot,
                    endpoint.name,
                    wire.holder,
                )
            return
        channel = endpoint.accept()
        if channel is None:
            return
        if channel.fileno() == endpoint.fileno():
            self._selector.unregister(endpoint.fileno())
        link.clear()
        link.channel = channel
        wire.enter_client(f"the client of {endpoint.name}", self.sim.now_ns)
        self._timing.enter(link)
        _log.info("robot %d has a client at %s", link.robot, endpoint.name)
        self._select_events(link)

    @postponing_endings()
    def _disconnect(self, link: Link) -> None:
        """Disconnect a client. The next one waits until its commands have acted."""
        channel = link.channel
        if channel is None:
            return
        if link.events:
            self._selector.unregister(channel.fileno())
            link.events = 0
        for endpoint in self._endpoints[link.robot]:
            if endpoint.fileno() in self._selector.get_map():
                self._selector.unregister(endpoint.fileno())
        channel.close()
        link.channel = None
        link.is_dropped = False
        link.is_leaving = True
        self._timing.leave(link)
        _log.info("robot %d has lost its client at %s", link.robot, channel.name)
        if self._timing.has_left(link):
            self._free(link)

    def _has_gone_unnoticed(self, link: Link) -> bool:
        """Return whether a client has gone whose end the server has not read, because the line is full."""
        channel = link.channel
        return channel is not None and self._timing.forgets and self._timing.is_full(link) and channel.find_end()

    @postponing_endings()
    def _free(self, link: Link) -> None:
        """Free the link for the next client."""
        link.clear()
        link.wire.leave_client(self.sim.now_ns)
        self._listen(link)

    def _missing(self) -> str:
        """Return the names of the missing programs."""
        robots = [str(link.robot) for link in self._links.values() if link.channel is None and not link.is_leaving]
        return f"that of robot {' or '.join(robots)}"

    # ---- bytes ----

    def _exchange(self, link: Link, events: int) -> None:
        """Read or write, as the channel's descriptor is ready for it."""
        channel = link.channel
        if channel is None:
            return
        if events & selectors.EVENT_WRITE:
            channel.flush()
        if events & selectors.EVENT_READ:
            data = channel.read()
            if data is None:
                self._disconnect(link)
                return
            baud = channel.baud
            if baud is not None and baud != link.wire.line.baud and BAUD_MIN <= baud <= BAUD_MAX:
                link.wire.set_baud(baud)
            if data:
                self._timing.receive(link, data)

    def _select_events(self, link: Link) -> None:
        """Select the events of the channel: reading if the line has room, writing if characters wait.

        A descriptor that is registered with no event would still report a hang-up, again and again: it is removed.
        """
        channel = link.channel
        if channel is None:
            return
        is_full = self._timing.is_full(link)
        if is_full:
            channel.warn(
                f"the client of {channel.name} must wait for its replies, but it is more than {BACKLOG_LIMIT - 1} "
                "characters ahead of its robot; what it sends now has to wait. Read a line after each command."
            )
        events = (0 if is_full else selectors.EVENT_READ) | (selectors.EVENT_WRITE if channel.has_unsent else 0)
        if events != link.events:
            self._select(link, channel, events)

    @postponing_endings()
    def _select(self, link: Link, channel: Channel, events: int) -> None:
        if not events:
            self._selector.unregister(channel.fileno())
        elif link.events:
            self._selector.modify(channel.fileno(), events, partial(self._exchange, link))
        else:
            self._selector.register(channel.fileno(), events, partial(self._exchange, link))
        link.events = events


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

"""Programs in one world: unchanged Python programs, each in a process of its own, and visitors. They come and go."""

from __future__ import annotations

import contextlib
import logging
import selectors
import socket
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

from kiks.clock.patience import Patience
from kiks.clock.thinking import parse_thinking
from kiks.ending import INTERRUPTED, noting_endings
from kiks.errors import KiksError, ParameterError
from kiks.ports.descriptors import opening
from kiks.ports.guest import NearGuest, SocketGuest
from kiks.ports.handle import Handle
from kiks.ports.names import Names
from kiks.ports.permission import Anything, Permission
from kiks.ports.process import LATE, PUNCTUAL, Command, Labels, Process
from kiks.ports.turns import PATIENCE_S, START_PATIENCE_S, VISIT_PATIENCE_S, Turns
from kiks.sim.simulation import Simulation

IDLE_S = 0.05
"""Longest sleep [s]: a second Ctrl-C is noticed within it."""

GRACE_S = 1.0
"""How long a program may tidy up after Ctrl-C [s of real time]."""

_log = logging.getLogger("kiks.run")


class Programs:
    """Programs that share a world.

    `round` moves the world for them; who calls it again and again is the driver, in one thread. `start` and `stop` may
    be called by other threads at any time, and with the simulation's lock held.

    Args:
        sim: The world.
        commands: Programs that begin together, with `begin` or `run`; the first one drives robot 1, whatever port it
            opens, and so on. None where a robot has none.
        told: Robots by port name, for whichever program opens it.
        thinking: What the computing of each costs: 'none', 'fixed:MS', 'live', 'live:FACTOR', or 'replay:FILE'; where
            several begin together, with the number of the program appended: FILE.1.
        record: File for the thinking times of live runs, with the same numbers appended.
        when_silent: What happens to a program that is silent while others wait: 'wait', 'drop' (its process is ended)
            or 'ignore'.
        patience_s: How long it may be [s of real time].
        say: Where a person is told how each program ended.
        is_heard: Whether what they print is kept, in their handles; else it goes where that of this process goes. What
            a heard program starts ends with it.
        new_patience: Makes patiences with another wall clock: one that stands still while the world does.
        visitors: How many programs that were started elsewhere begin together with these; see `admit`.
        labels: What writes where this process prints what they print, if it is not kept; they do so themselves if None.

    Attributes:
        handles: The programs; of those that have ended the last one of each robot.
        permission: What may start; anything if nobody says otherwise.

    Raises:
        ParameterError: If a value is out of range or unknown.
        KiksError: If the computer has no file descriptors left for it.
    """

    def __init__(
        self,
        sim: Simulation,
        commands: Sequence[Command | None] = (),
        *,
        told: dict[str, int] | None = None,
        thinking: str = "none",
        record: Path | None = None,
        when_silent: str = "ignore",
        patience_s: float = PATIENCE_S,
        say: Callable[[str], None] = lambda text: None,
        is_heard: bool = False,
        new_patience: Callable[[float], Patience] = Patience,
        visitors: int = 0,
        labels: Labels | None = None,
    ) -> None:
        self.sim = sim
        self.permission: Permission = Anything()
        self.handles: list[Handle] = []
        self._visitors: list[NearGuest] = []
        self._is_moving = False
        self._moved = threading.Condition(sim.lock)
        self._say, self._thinking, self._record = say, thinking, record
        self._is_heard, self._labels = is_heard, labels
        self._signals, self._count, self._was_touched, self._is_closed = 0, 0, False, False
        self._beginners = [(robot, command) for robot, command in enumerate(commands, 1) if command is not None]
        self._are_numbered = len(self._beginners) > 1
        for number in range(1, len(self._beginners) + 1):
            parse_thinking(self._policy(number))
        self._turns = Turns(
            sim,
            expected=len(self._beginners) + visitors,
            missing=self._missing,
            log=_log,
            is_once=True,
            when_silent=when_silent,
            patience_s=patience_s,
            new_patience=new_patience,
            start_patience_s=VISIT_PATIENCE_S if visitors else START_PATIENCE_S,
        )
        self._names = Names(sim, told or {}, 0)
        for robot, _ in self._beginners:
            self._names.own(robot)
        with opening("the programs of a world"):
            self._bell, self._bell_rope = socket.socketpair()
            self._selector = selectors.DefaultSelector()
        self._bell.setblocking(False)
        self._bell_rope.setblocking(False)
        self._selector.register(self._bell, selectors.EVENT_READ)

    def begin(self) -> None:
        """Start the programs that begin together, unless they have been.

        Raises:
            KiksError: If the computer does not let one start.
        """
        with self.sim.lock:
            beginners, self._beginners = self._beginners, []
            try:
                for robot, command in beginners:
                    self._add(command, robot)
            except KiksError:
                self.close()
                raise

    @property
    def drive(self) -> bool:
        """Say whether programs move the world's time: then nobody else may."""
        return self._turns.drive

    @property
    def doubt(self) -> str:
        """Say why the same programs might not do the same again; nothing if they would, but for live thinking."""
        if self._signals:
            return "it was interrupted"
        if self._was_touched:
            return "a program was started or stopped while the world was there"
        return "" if self._turns.is_repeatable else "the world did not wait for every program"

    # ---- they come and go ----

    def start(self, command: Command, robot: int = 1) -> Handle:
        """Start a program; it takes part from the simulated time on at which its first word comes.

        Args:
            command: The program.
            robot: Number of the robot that is its own, whatever port it opens.

        Raises:
            ParameterError: If it may not start, there is no such file or robot, or another program has that robot.
            KiksError: If the computer does not let it start.
        """
        command.check_file()
        with self.sim.lock:
            self._check_open(command.program.name)
            self.sim.index_of(robot)
            there = [handle for handle in self.handles if handle.robot == robot]
            for handle in there:
                if handle.is_running:
                    raise ParameterError(
                        f"robot {robot} must be free for another program, but {handle.name} has it. Stop that one "
                        "first, or take another robot."
                    )
                handle.guest.part()
            parse_thinking(self._policy(self._count + 1))
            for each in self.handles:
                if not each.is_running:
                    self._names.disown(each.robot)
            self._names.own(robot)
            handle = self._add(command, robot)
            self.handles = [each for each in self.handles if each not in there or not each.has_been_noticed]
            self._was_touched = True
        self._ring()
        return handle

    def admit(self, name: str, rank: int) -> NearGuest:
        """Let a program take part, from its first word on, that was started elsewhere: a thread here speaks for it.

        Args:
            name: Who it is, for a person.
            rank: Its place among those who act at the same instant.

        Raises:
            KiksError: If the world has ended.
        """
        with self.sim.lock:
            self._check_open(name)
            guest = NearGuest(name, rank, 0, self.sim, self._turns, self._names)
            guest.is_waited_for = False
            self._turns.join(guest)
            self._visitors = [each for each in self._visitors if not each.has_left] + [guest]
            self._was_touched = True
        return guest

    @property
    def is_shared(self) -> bool:
        """Say whether more than one program takes part, or is waited for to begin."""
        return len(self._turns.players) > 1 or not self._turns.has_begun

    def move(self) -> float | None:
        """Do what may be done now, unless another thread is at it; the caller holds the lock. See `Turns.advance`."""
        # The gate may make a thread wait in the middle, and then lets others look at the world.
        if self._is_moving:
            return None
        self._is_moving = True
        try:
            return self._turns.advance()
        finally:
            self._is_moving = False
            self._moved.notify_all()

    def wait(self, seconds: float | None) -> None:
        """Wait until somebody has moved the world, or for some time [s]; the caller holds the lock."""
        self._moved.wait(seconds)

    def stop(self, handle: Handle) -> None:
        """End a program, as Ctrl-C would; if it does not end within a second, or this is said again, at once.

        One that has not used a port yet ends at once. When it has ended its robots stop, and are free.
        """
        if not handle.is_running:
            return
        is_tidying, handle.guest.is_stopped = handle.guest.is_stopped, True
        self._was_touched = True
        if is_tidying or not handle.guest.is_here:
            handle.process.kill()
            return
        handle.process.interrupt()
        grace = threading.Timer(GRACE_S, handle.process.kill)
        grace.daemon = True
        grace.start()

    def run(self) -> int:
        """Let them run until the last has ended; return 0 if all went well, else the first exit code that tells.

        Raises:
            KiksError: If the computer does not let one start.
        """
        self.begin()
        try:
            self._grace = Patience(GRACE_S)
            # The programs have got it, too, and may still stop their robots.
            with noting_endings(self._note_signal):
                while any(not handle.has_been_noticed for handle in self.handles) or self._turns.players:
                    if self._signals and (self._signals > 1 or self._grace.left_s() == 0):
                        return INTERRUPTED
                    self.round(IDLE_S)
        finally:
            self.close()
        return INTERRUPTED if self._signals else next((each.code for each in self.handles if each.code), 0)

    def round(self, wait_limit_s: float) -> None:
        """Do what may be done now, and listen to the programs.

        Args:
            wait_limit_s: Longest time that is waited for a word of theirs [s of real time].
        """
        with self.sim.lock:
            wait_s = self.move()
            over = self._look_around()
        wait_s = wait_limit_s if wait_s is None else min(wait_s, wait_limit_s)
        ready = self._selector.select(wait_s)
        with self.sim.lock:
            for key, events in ready:
                if key.data is None:
                    self._quieten()
                elif events & selectors.EVENT_WRITE:
                    key.data.flush()
                if key.data is not None and events & selectors.EVENT_READ and not key.data.receive():
                    self._hang_up(key.data)
            heard = [key.data for key, _ in ready]
            for guest in over:
                # A process that it has started may still hold the connection.
                if guest not in heard and not guest.has_hung_up:
                    guest.leave()
                    self._hang_up(guest)
            noticed = self._notice_ends()
        for handle in noticed:
            self._tell_end(handle)

    def close(self) -> None:
        """End all processes that still run, say how those ended that had gone before, and close the connections."""
        self._is_closed = True
        for handle in self.handles:
            if handle.guest.has_hung_up:
                handle.has_ended.wait(GRACE_S)  # the operating system is at it, and its exit code will be told
            handle.process.kill()
        for handle in self._notice_ends():
            self._tell_end(handle)
        for handle in self.handles:
            handle.process.wait()
            handle.guest.close()
        with self.sim.lock:
            for guest in self._visitors:
                guest.close()
            self._moved.notify_all()
        self._selector.close()
        self._bell.close()
        self._bell_rope.close()

    # ---- inside ----

    def _check_open(self, name: str) -> None:
        if self._is_closed:
            raise KiksError(f"a program must have a world, but that of {name} has ended. Try again.")

    def _policy(self, number: int) -> str:
        return self._thinking + (self._suffix(number) if self._thinking.startswith("replay:") else "")

    def _suffix(self, number: int) -> str:
        """Return what is appended to the names of files that each program has of its own."""
        return f".{number}" if self._are_numbered else ""

    def _add(self, command: Command, robot: int) -> Handle:
        """Start a program's process, if it may, and let it take part."""
        self.permission.check(command)
        number = self._count + 1
        name = f"program {number} ({command.program.name})"
        here, there = socket.socketpair()
        guest = SocketGuest(here, name, number, robot, self.sim, self._turns, self._names)
        handle = Handle(command, guest)
        lateness = LATE if self._turns.has_begun else PUNCTUAL
        record = f"{self._record}{self._suffix(number)}" if self._record is not None else ""
        with there:
            try:
                handle.process = Process(
                    [lateness, self._policy(number), record, " ".join(self._names.offered())],
                    command,
                    there,
                    is_heard=self._is_heard,
                    voice=None if self._labels is None else self._labels.voice(number, command.program.name),
                    ended=lambda: self._end(handle),
                )
            except KiksError:
                guest.close()
                raise
        # A world that runs already does not stand still until somebody's imports are done.
        guest.is_waited_for = not self._turns.has_begun
        self._count = number
        self._turns.join(guest)
        self.handles.append(handle)
        return handle

    def _end(self, handle: Handle) -> None:
        """Free the robots of a program that a person has stopped: here, as `round` may be waiting for time to go on."""
        if handle.guest.is_stopped and not self._is_closed:
            with self.sim.lock:
                handle.guest.part()
        handle.has_ended.set()
        self._ring()

    def _look_around(self) -> list[SocketGuest]:
        """See to it that every connection is listened to for what matters; return those whose process has ended."""
        over = []
        for handle in self.handles:
            guest = handle.guest
            if guest.is_silenced and handle.is_running:
                handle.process.kill()
            if guest.is_stopped and handle.process.code is not None:
                guest.part()
                handle.has_ended.set()
            if not guest.has_hung_up:
                self._listen_to(guest)
                if not handle.is_running:
                    over.append(guest)
        return over

    def _listen_to(self, guest: SocketGuest) -> None:
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if guest.has_unsent else 0)
        if guest not in self._selector.get_map():
            self._selector.register(guest, events, guest)
        elif self._selector.get_key(guest).events != events:
            self._selector.modify(guest, events, guest)

    def _hang_up(self, guest: SocketGuest) -> None:
        self._selector.unregister(guest)
        guest.has_hung_up = True
        if guest.has_left:
            guest.close()

    def _notice_ends(self) -> list[Handle]:
        """Return the programs that have ended since the last time."""
        there = [handle for handle in self.handles if handle.guest.has_hung_up and not handle.is_running]
        noticed = [handle for handle in there if not handle.has_been_noticed]
        for handle in noticed:
            handle.has_been_noticed = True
        return noticed

    def _tell_end(self, handle: Handle) -> None:
        """Say how a program has ended."""
        self._say(f"{handle.name} {'was stopped' if handle.guest.is_stopped else f'has ended {handle.how}'}.")
        left = [other.guest for other in self.handles if other.is_running and other.guest.is_here]
        if left and not any(guest.is_waited_for for guest in left):
            names = ", ".join(guest.name for guest in left)
            _log.warning("%s, which the world does not wait for, still runs. Ctrl-C ends it.", names)

    def _missing(self) -> str:
        return ", ".join(each.name for each in self.handles if not each.guest.is_here) or "a program elsewhere"

    def _ring(self) -> None:
        """Let `round` look up."""
        with contextlib.suppress(OSError):
            self._bell_rope.send(b"!")

    def _quieten(self) -> None:
        with contextlib.suppress(OSError):
            self._bell.recv(1 << 10)

    def _note_signal(self) -> None:
        self._signals += 1

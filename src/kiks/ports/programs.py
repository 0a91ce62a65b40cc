"""Programs that share a world: Python programs, each in a process of its own, and threads of this process."""

from __future__ import annotations

import contextlib
import logging
import selectors
import socket
import threading
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NoReturn

from kiks.clock.gate import Gate
from kiks.clock.patience import Patience
from kiks.clock.thinking import charged_ns, own_file, own_policy, parse_thinking
from kiks.ending import INTERRUPTED, noting_endings
from kiks.errors import KiksError, ParameterError
from kiks.ports.messages import Request, Start
from kiks.ports.participant import ProgramParticipant
from kiks.ports.port_names import PortNames
from kiks.ports.program_command import ProgramCommand
from kiks.ports.program_output import Labels, OutputLine
from kiks.ports.program_permission import Permission
from kiks.ports.program_process import Process, chance_seed
from kiks.ports.program_scheduler import PATIENCE_S, START_PATIENCE_S, VISIT_PATIENCE_S, ProgramScheduler
from kiks.ports.resources import opening
from kiks.ports.sandbox import Sandbox
from kiks.ports.socket_participant import SocketParticipant
from kiks.sim.ring_buffer import RingBuffer
from kiks.sim.simulation import Simulation

IDLE_S = 0.05
"""Longest wait of a round [s of real time]: KiKS notices a second Ctrl-C within it."""

GRACE_S = 1.0
"""Time that a program has to end after a person has stopped it [s of real time]."""

CTRL_C_GRACE_S = 0.6
"""Time that all programs and the world have to end after Ctrl-C [s of real time]: a second with what follows."""

WORLD_SHARE = 0.3
"""Share of that time in which the world comes to where they have ended."""

_log = logging.getLogger("kiks.run")


class Handle(SocketParticipant):
    """A started program, in a process of its own.

    Args:
        command: The command that starts it.
        connection: This end of the socket to it.
        number: Its number, from 1, in the order of starts.
        robot: Number of its own robot.
        scheduler: See `ProgramParticipant`.
        names: See `ProgramParticipant`.
        selector: See `SocketParticipant`.

    Attributes:
        has_ended: Set when the process has ended.
    """

    process: Process

    def __init__(
        self,
        command: ProgramCommand,
        connection: socket.socket,
        number: int,
        robot: int,
        scheduler: ProgramScheduler,
        names: PortNames,
        selector: selectors.BaseSelector,
    ) -> None:
        super().__init__(f"program {number} ({command.name})", connection, robot, scheduler, names, selector)
        self.command = command
        self.is_end_reported = False
        self.has_ended = threading.Event()

    @property
    def is_running(self) -> bool:
        """Whether it still runs. After its end, its output is complete, and its robots are free if it was stopped."""
        return not self.has_ended.is_set()

    @property
    def code(self) -> int | None:
        """Its exit code, or 128 plus the number of the signal that ended it; None while it runs."""
        code = None if self.is_running else self.process.code
        return code if code is None or code >= 0 else 128 - code

    @property
    def output(self) -> RingBuffer[OutputLine] | None:
        """Its output; None if it is not kept."""
        return self.process.output

    @property
    def state(self) -> str:
        """Its state: 'running', 'stopping', 'stopped', 'silenced', or how it has ended."""
        if self.is_running:
            return "stopping" if self.is_stopped or self.is_silenced else "running"
        if self.is_stopped:
            return "stopped"
        return "silenced" if self.is_silenced else f"ended {self.how}"

    def progress(self) -> tuple[int, bool]:
        """Return its time [ns], and whether it waits for the world or its debugger; for any thread."""
        try:
            return self.acts_from_ns, self.is_held_up or self.is_consulting
        except IndexError:  # the request that was last is done meanwhile
            return self.acts_from_ns, True

    @property
    def how(self) -> str:
        """How it has ended; empty while it runs."""
        if self.reason:
            return f"because it {self.reason}"
        code = self.process.code
        if code is None:
            return ""
        return f"with exit code {code}" if code >= 0 else f"by signal {-code}"

    def leave(self) -> None:
        """Disconnect the program after its requests are done; its sandbox has noted why it ended it, if it did."""
        self.reason = self.reason or self.process.reason
        super().leave()

    def drop(self) -> None:
        """Disconnect the program, and kill its process."""
        self.is_silenced = True
        self.is_waited_for = False
        self.process.kill()

    def expel(self) -> None:
        """Close the connection, and kill its process."""
        super().expel()
        self.process.kill()


class _OverError(Exception):
    """`run` is to end in the middle of a round."""


class Programs:
    """Programs that share a world.

    `round` moves the world for them; one thread, the driver, calls it again and again. Other threads may call `start`
    and `stop` at any time, and with the simulation's lock held.

    Args:
        sim: The world.
        commands: Programs that begin together, with `begin` or `run`: the first one drives robot 1, and so on,
            independent of the ports that they open. None for a robot without one.
        robots_by_name: Robots by port name, for all programs.
        thinking: Thinking time of each: 'none', 'fixed:MS', 'live', 'live:FACTOR', or 'replay:FILE'; if several begin
            together, the number of the program is appended: FILE.1.
        record: File for the thinking times of live runs, with the same numbers appended.
        when_silent: What happens to a program that is silent while others wait: 'wait', 'drop' (its process is ended)
            or 'ignore'.
        patience_s: How long a program may be silent [s of real time].
        say: Called with a line of text about each program that has ended.
        keeps_output: Whether the handles keep the output; otherwise it goes to the output of this process. If they do,
            and there are no labels, a program has no keyboard, and its child processes end with it.
        visitors: Number of programs in threads of this process that begin together with these; see `admit`.
        labels: Prints the output with labels; None: the programs print what is not kept themselves.
        are_apart: Whether no program may take the own robot of another one, as in a match.
        players: Robots that programs elsewhere take (see `let_in`). With thinking 'live' the world waits for none of
            them, and goes on in real time.
        gate: Where time passes, if a person may pause it: a patience does not run out meanwhile. With players it opens
            when all are there, or when a person opens it.
        consult: Called with a program and its request for the debugger that follows it; None if none follows any.
        sandbox: Where the programs run, or where that of each robot runs, by its number; None: in processes with the
            rights of this one.

    Attributes:
        handles: The programs; of ended ones, the last one of each robot.
        permission: Which programs may start; all by default.
        was_touched: Whether a program was started or stopped while the world was there.
    """

    def __init__(
        self,
        sim: Simulation,
        commands: Sequence[ProgramCommand | None] = (),
        *,
        robots_by_name: dict[str, int] | None = None,
        thinking: str = "none",
        record: Path | None = None,
        when_silent: str = "ignore",
        patience_s: float = PATIENCE_S,
        say: Callable[[str], None] = lambda text: None,
        keeps_output: bool = False,
        visitors: int = 0,
        labels: Labels | None = None,
        are_apart: bool = False,
        players: Collection[int] = (),
        gate: Gate | None = None,
        sandbox: Sandbox | Mapping[int, Sandbox] | None = None,
        consult: Callable[[ProgramParticipant, Request], object] | None = None,
    ) -> None:
        self.sim, self._consult = sim, consult
        self.permission = Permission(None)
        self.handles: list[Handle] = []
        self._unreported: list[Handle] = []
        self._visitors: list[ProgramParticipant] = []
        self._is_moving = False
        self._moved = threading.Condition(sim.lock)
        self._say, self._thinking, self._record = say, thinking, record
        self._keeps_output, self._labels, self._sandbox = keeps_output, labels, sandbox
        self._over: tuple[int, str] | None = None
        self._signals, self._count, self.was_touched, self._is_closed = 0, 0, False, False
        self._first_programs = [(robot, command) for robot, command in enumerate(commands, 1) if command is not None]
        self._begun_count = len(self._first_programs)
        for number in range(1, self._begun_count + 1):
            parse_thinking(self._policy(number))
        self._gate = waiting = gate if players else None
        self._scheduler = ProgramScheduler(
            sim,
            expected=len(self._first_programs) + visitors + len(players),
            missing=self._missing,
            log=_log,
            is_once=True,
            when_silent=when_silent,
            patience_s=patience_s,
            new_patience=Patience if gate is None else gate.patience,
            start_patience_s=VISIT_PATIENCE_S if visitors else START_PATIENCE_S,
            may_begin=None if waiting is None else lambda: not waiting.is_paused,
        )
        self._players: dict[int, SocketParticipant | None] = dict.fromkeys(players)
        if waiting is not None:
            waiting.pause(sim.now_ns)
        self._names = PortNames(sim, robots_by_name or {}, 0, are_apart=are_apart)
        for robot in (*(robot for robot, _ in self._first_programs), *players):
            self._names.own(robot)
        with opening("the programs of a world"):
            self._wake_receiver, self._wake_sender = socket.socketpair()
            self._selector = selectors.DefaultSelector()
        self._wake_receiver.setblocking(False)
        self._wake_sender.setblocking(False)
        self._selector.register(self._wake_receiver, selectors.EVENT_READ, self._take_ends)

    def begin(self) -> None:
        """Start the programs that begin together; does nothing if they have been started."""
        with self.sim.lock:
            first_programs, self._first_programs = self._first_programs, []
            try:
                for robot, command in first_programs:
                    self._add(command, robot)
            except KiksError:
                self.close()
                raise

    @property
    def drive(self) -> bool:
        """Whether programs move the world's time, or it waits for players; then nothing else may."""
        # With the lock: another thread, such as that of Halt, may drop a program's requests while they are looked at.
        with self.sim.lock:
            return self._scheduler.drive or (self._gate is not None and not self._scheduler.has_begun)

    @property
    def are_there(self) -> bool:
        """Whether any program takes part."""
        return bool(self._scheduler.participants)

    @property
    def doubt(self) -> str:
        """Why the run might not be repeatable; empty if it is, apart from live thinking."""
        if self._signals:
            return "it was interrupted"
        if self.was_touched:
            return "a program was started or stopped while the world was there"
        return self._scheduler.doubt

    def note_doubt(self, why: str) -> None:
        """Note why the run might not be repeatable, such as that a person has changed the world."""
        self._scheduler.note_doubt(why)

    # ---- starting and stopping ----

    def start(self, command: ProgramCommand, robot: int = 1) -> Handle:
        """Start a program; it takes part from the simulated time at which its first request comes.

        Args:
            command: The program.
            robot: Number of its own robot, independent of the port that it opens.
        """
        command.check_file()
        with self.sim.lock:
            self._check_open(command.name)
            self.sim.index_of(robot)
            if robot in self._players:
                raise ParameterError(
                    f"robot {robot} must be for programs of this computer, but it is for one elsewhere. Take another "
                    "robot, or join with its address: kiks run --join ADDRESS PROGRAM."
                )
            for handle in [each for each in self.handles if each.robot == robot]:
                if handle.is_running:
                    raise ParameterError(
                        f"robot {robot} must be free for another program, but {handle.name} has it. Stop that one "
                        "first, or take another robot."
                    )
                # Its robot is free only when it has left the world, which the next program must not wait for.
                handle.disconnect()
            parse_thinking(self._policy(self._count + 1))
            for each in self.handles:
                # Robots of ended programs may be found by the names that a new one opens.
                if not each.is_running:
                    self._names.disown(each.robot)
            self._names.own(robot)
            handle = self._add(command, robot)
            self._drop_replaced()
            self.was_touched = True
        self._wake()
        return handle

    def admit(self, name: str, rank: int) -> ProgramParticipant:
        """Add a program in a thread of this process; it takes part from its first request on.

        Args:
            name: Its name in messages.
            rank: Its place in the order of programs that act at the same instant.
        """
        with self.sim.lock:
            self._check_open(name)
            participant = ProgramParticipant(name, rank, 0, self._scheduler, self._names)
            participant.is_waited_for = False
            self._scheduler.join(participant)
            self._visitors = [each for each in self._visitors if not each.has_left] + [participant]
            self.was_touched = True
        return participant

    def let_in(self, connection: socket.socket, robot: int, name: str) -> tuple[SocketParticipant, Start]:
        """Add a program elsewhere, which takes the place of another one on the same robot.

        Args:
            connection: This end of a socket, which leads to it.
            robot: Number of its robot, one of the players'.
            name: Its name in messages.

        Returns:
            The program, and what it has to know.
        """
        with self.sim.lock:
            self._check_open(name)
            self.sim.index_of(robot)  # a person may have opened a world with fewer robots
            if (before := self._players[robot]) is not None:
                before.dismiss(f"Another program has taken robot {robot} with the same token.")
            has_begun = self._scheduler.has_begun
            player = SocketParticipant(name, connection, robot, self._scheduler, self._names, self._selector)
            player.thinking_ns = charged_ns(self._thinking)
            player.holds_world = not self._thinking.startswith("live")
            player.is_waited_for = player.holds_world and not has_begun
            self._names.own(robot, is_alone=True)
            self._scheduler.join(player)
            self._players[robot] = player
            self.was_touched = self.was_touched or has_begun
            start = self._start_of(robot, self._thinking)
        self._wake()
        return player, start

    @property
    def players(self) -> dict[int, str]:
        """What the program elsewhere of each robot does, as the rest of a sentence; empty where no such program may."""
        return {
            robot: "has not come yet" if player is None else player.state for robot, player in self._players.items()
        }

    def dismiss_players(self, why: str) -> None:
        """Disconnect all programs elsewhere: their robots stop. Needs the lock.

        Args:
            why: For their users, as a sentence.
        """
        for player in self._players.values():
            if player is not None and not player.has_left:
                self.was_touched = True
                player.dismiss(why)

    def lose(self, player: SocketParticipant) -> None:
        """Disconnect a program elsewhere whose connection was lost: its robot stops."""
        with self.sim.lock:
            self.was_touched = self.was_touched or not player.has_left
            player.dismiss("")
        self._wake()

    @property
    def is_shared(self) -> bool:
        """Whether more than one program takes part, or the world waits for programs to begin."""
        return len(self._scheduler.participants) > 1 or not self._scheduler.has_begun

    def move(self) -> float | None:
        """Call `ProgramScheduler.advance`, unless another thread is in it. Needs the lock."""
        # The gate may make a thread wait inside, and then releases the lock for others.
        if self._is_moving:
            return None
        self._is_moving = True
        had_begun = self._scheduler.has_begun
        try:
            return self._scheduler.advance()
        finally:
            if self._gate is not None and not had_begun and self._scheduler.has_begun:
                self._gate.go_on()
            self._is_moving = False
            self._moved.notify_all()

    def wait(self, seconds: float) -> None:
        """Wait until a thread has moved the world, or for some time [s]; the caller holds the lock."""
        self._moved.wait(seconds)

    def stop(self, handle: Handle) -> None:
        """End a program, as Ctrl-C does; kill it if it does not end within a second, or at the second call.

        A program that has not used a port yet is killed at once. After its end its robots stop and are free.
        """
        if not handle.is_running:
            return
        was_interrupted, handle.is_stopped = handle.is_stopped, True
        self.was_touched = True
        # One that has not begun has no robot to stop, and may still import.
        if was_interrupted or not handle.is_here:
            handle.process.kill()
            return
        handle.process.interrupt()
        grace = threading.Timer(GRACE_S, handle.process.kill)
        grace.daemon = True
        grace.start()

    def run(self) -> int:
        """Run until the last program has ended, or `end`; return the first exit code that is not 0, else 0."""
        self.begin()
        loop = self.sim.loop
        try:
            self._grace = Patience(CTRL_C_GRACE_S)
            # The programs get the signal, too, and may still stop their robots.
            with noting_endings(lambda _number: self._note_signal()):
                loop.on_slice = self._check_signals
                while self._scheduler.participants or any(not handle.is_end_reported for handle in self.handles):
                    self._check_signals()
                    self.round(IDLE_S)
        except _OverError:
            for handle in self.handles:
                handle.is_stopped = handle.is_running and not handle.has_hung_up
        finally:
            loop.on_slice = lambda: None
            self.close()
        if self._signals:
            return INTERRUPTED
        own = next((each.code for each in self.handles if each.code and not each.is_stopped), 0)
        if self._over is None:
            return own
        code, message = self._over
        if message:
            self._say(message)
        return code or own

    def end(self, code: int, message: str) -> NoReturn:
        """End `run` from inside a round: all programs are stopped.

        Args:
            code: What `run` returns; 0 for the first other exit code of a program.
            message: Said at the end.
        """
        self.end_soon(code, message)
        raise _OverError

    def end_soon(self, code: int, message: str) -> None:
        """End `run` so from elsewhere, such as the handler of a signal."""
        self._over = self._over or (code, message)

    def round(self, wait_limit_s: float) -> None:
        """Advance the world, and take requests of the programs.

        Args:
            wait_limit_s: Longest wait for a request [s of real time].
        """
        with self.sim.lock:
            wait_s = self.move()
        ready = self._selector.select(wait_limit_s if wait_s is None else min(wait_s, wait_limit_s))
        if ready:
            with self.sim.lock:
                for key, events in ready:
                    key.data(events)
        self._report_ends()

    def close(self) -> None:
        """End all processes, report how programs have ended, and close the connections, once."""
        if self._is_closed:
            return
        self._is_closed = True
        for handle in self.handles:
            # Killed now, it would seem to have failed.
            if handle.has_hung_up:
                handle.has_ended.wait(GRACE_S)  # the process ends by itself and will have an exit code
            handle.process.kill()
        self._take_ends()
        self._report_ends()
        for handle in self.handles:
            handle.process.wait()
            handle.close()
        with self.sim.lock:
            for participant in self._visitors:
                participant.close()
            self.dismiss_players("The world has ended.")
            self._moved.notify_all()
        self._selector.close()
        self._wake_receiver.close()
        self._wake_sender.close()

    # ---- inside ----

    def _check_open(self, name: str) -> None:
        if self._is_closed:
            raise KiksError(f"a program must have a world, but that of {name} has ended. Try again.")

    def _policy(self, number: int) -> str:
        return own_policy(self._thinking, number, self._begun_count)

    def _add(self, command: ProgramCommand, robot: int) -> Handle:
        """Start a program's process, if it may start, and add the program."""
        self.permission.check(command)
        number = self._count + 1
        here, there = socket.socketpair()
        handle = Handle(command, here, number, robot, self._scheduler, self._names, self._selector)
        handle.thinking_ns = charged_ns(self._policy(number))
        if self._consult is not None:
            handle.consult = partial(self._consult, handle)
        start = command.added_to(self._start_of(robot, self._policy(number)))
        start = start._replace(is_debugged=self._consult is not None)
        if self._record is not None:
            start = start._replace(record=own_file(str(self._record), number, self._begun_count))
        sandbox = self._sandbox.get(robot) if isinstance(self._sandbox, Mapping) else self._sandbox
        with there:
            try:
                handle.process = Process(
                    command.name,
                    start,
                    there,
                    keeps_output=self._keeps_output,
                    writer=None if self._labels is None else self._labels.writer(number, command.name),
                    on_end=partial(self._end, handle),
                    on_line=lambda line: self._record_line(robot, line),
                    launch=None if sandbox is None else partial(sandbox.start, start, there, handle.progress),
                )
            except KiksError:
                handle.close()
                raise
        # A stranger's program must not hold the world for ever, unless a person debugs it.
        handle.may_stand = sandbox is None or self._consult is not None
        # A running world does not wait for the imports of a new program.
        handle.is_waited_for = not self._scheduler.has_begun
        self._count = number
        self._scheduler.join(handle)
        self.handles.append(handle)
        return handle

    def _start_of(self, robot: int, thinking: str) -> Start:
        """Return what the program of a robot has to know of the world."""
        return Start(
            is_late=self._scheduler.has_begun,
            end_ns=self.sim.loop.end_ns,
            thinking=thinking,
            offered=self._names.offered(),
            seed=chance_seed(self.sim.seed, robot),
            pulse_mm=self.sim.specs[robot - 1].body.pulse_mm,
            addresses=self._names.addresses(robot),
        )

    def _record_line(self, robot: int, line: str) -> None:
        recorder = self.sim.loop.recorder
        if recorder is not None:
            recorder.say(robot - 1, line)

    def _end(self, handle: Handle, process: Process) -> None:
        """Free the robots of a stopped program: here, because `round` may be waiting at the gate."""
        handle.reason = handle.reason or process.reason
        if (handle.is_stopped or handle.reason) and not self._is_closed:
            with self.sim.lock:
                handle.abort()
        handle.has_ended.set()
        self._wake()

    def _take_ends(self, _events: int = 0) -> None:
        """Hang up on programs that have ended: a child process of theirs may still hold the connection."""
        with contextlib.suppress(OSError):
            self._wake_receiver.recv(1 << 10)
        for handle in self.handles:
            if not handle.is_running:
                handle.hang_up()
        ended = [each for each in self.handles if each.has_hung_up and not each.is_running and not each.is_end_reported]
        for handle in ended:
            handle.is_end_reported = True
        self._unreported += ended
        self._drop_replaced()

    def _drop_replaced(self) -> None:
        """Drop programs whose end has been reported and whose robot has had another program since."""
        last = {handle.robot: handle for handle in self.handles}
        self.handles = [each for each in self.handles if last[each.robot] is each or not each.is_end_reported]

    def _report_ends(self) -> None:
        """Report how programs have ended."""
        while self._unreported:
            handle = self._unreported.pop(0)
            self._say(f"{handle.name} {'was stopped' if handle.is_stopped else f'has ended {handle.how}'}.")
            left = [other for other in self.handles if other.is_here and other.state == "running"]
            if left and not any(other.is_waited_for for other in left):
                names = ", ".join(other.name for other in left)
                _log.warning("%s, which the world does not wait for, still runs. Ctrl-C ends it.", names)

    def _missing(self) -> str:
        missing = [each.name for each in self.handles if not each.is_here]
        missing += [
            f"a program for robot {robot}"
            for robot, player in self._players.items()
            if player is None or player.has_left or not player.is_here
        ]
        return ", ".join(missing) or "a program elsewhere"

    def _wake(self) -> None:
        """Wake `round`."""
        with contextlib.suppress(OSError):
            self._wake_sender.send(b"!")

    def _note_signal(self) -> None:
        self._signals += 1

    def _check_signals(self) -> None:
        """End `run` after Ctrl-C, when all have had their time, or at the second one, or after `end_soon`."""
        if not (self._over or self._signals):
            return
        # Without programs only the world has something to do.
        share = 1.0 if any(handle.is_running for handle in self.handles) else WORLD_SHARE
        if self._over or self._signals > 1 or self._grace.left_s(share=share) == 0:
            raise _OverError

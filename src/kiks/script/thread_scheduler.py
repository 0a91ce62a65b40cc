"""The threads of a program in simulated time: one runs at a time, and another only where it waits.

Need: the same program does the same again, to the bit, however the operating system would share out its threads.
Method: each thread is a greenlet of one thread of the operating system. It runs until it waits: for a lock, a time,
characters on a line, a file. Then the next one that is ready goes on, in the order in which they became ready. When
none is ready, simulated time passes to the earliest instant at which one may go on; several at the same instant go on
in the order in which they began to wait.
"""

from __future__ import annotations

import heapq
import threading
import traceback

# Bound here once: a program lives with a `_thread` that is simulated.
from _thread import get_ident
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from itertools import count
from typing import Any, NoReturn, Protocol

import greenlet

from kiks.clock.program_clock import PollCost, ProgramClock
from kiks.model.checks import SECONDS_MAX
from kiks.sim.port import Line
from kiks.sim.read_completion import NEVER_NS, Read
from kiks.units import wait_ns

TASK_IDENT = 1 << 20
"""What `threading.get_ident` says in the first thread that a program starts."""


SIGNALLED, COMPLETE, ALONE, STUCK = object(), object(), object(), object()
"""Why a thread goes on: a signal has come; a read is complete; nobody else can go on before its read is; nobody can."""

_KEPT: list[Scheduler] = []
"""Those with threads that never end: one that were collected while it waits would run its `finally` then."""


class Files(Protocol):
    """The files of this computer that threads wait for: pipes, sockets, the keyboard."""

    def ready(self, wanted: Mapping[int, int], *, block: bool) -> set[int]:
        """Return the descriptors at which something has happened; with `block`, wait in real time until it has.

        Args:
            wanted: The events that are waited for, as `select.poll` has them, by descriptor.
            block: Whether to wait.
        """


class Task:
    """A thread of the program.

    Attributes:
        ident: What `threading.get_ident` says in it.
        waits_for: What it waits for, in words for a person; empty while it does not wait.
        waiting: What its questions cost.
        sentinel: A lock that is released when it ends; None if nobody has asked for it.
    """

    def __init__(self, ident: int, run: Callable[[], object], hub: greenlet.greenlet) -> None:
        self.ident = ident
        self.waits_for = ""
        self.waiting = PollCost()
        self.sentinel: Any = None
        self.greenlet = greenlet.greenlet(lambda *_: run(), hub)
        self.number = 0
        self.cause: object = None
        self.may_go_alone = False


class EndedError(Exception):
    """The program has ended, with an exit code and what is to be said of it."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code
        self.message = message


class Scheduler:
    """Who of a program's threads runs, and how far simulated time goes.

    Args:
        world: A line of the program's world, for its time.
        program: What thinking and asking cost.
        files: The files that threads wait for.

    Attributes:
        current: The thread that runs.
        tasks: Those that have been started and have not ended, by ident.
        lock_count: How many free locks the thread that runs has taken since it went on.
        carried: How to take and to put back what libraries keep for each thread of the operating system.
    """

    def __init__(self, world: Line, program: ProgramClock, files: Files) -> None:
        self.world = world
        self.program = program
        self.carried: list[tuple[Callable[[], object], Callable[[Any], object]]] = []
        self._files = files
        self._os_thread = get_ident()
        self._hub = greenlet.getcurrent()
        self._end: EndedError | None = None
        self._idents = count(TASK_IDENT)
        self._numbers = count(1)
        # What the main thread has to call, for signals, and whether it is being found out who goes on.
        self._calls: deque[Callable[[], object]] = deque()
        self._is_choosing = False
        self._ready: deque[Task] = deque()
        # When a wait ends at the latest [ns], its number, and whose it is; those that have ended before stay in it.
        self._deadlines: list[tuple[int, int, Task]] = []
        self._readers: dict[Task, Sequence[Read]] = {}
        self._watchers: dict[Task, Mapping[int, int]] = {}
        self._patient: list[Task] = []
        self.lock_count = 0
        self.tasks: dict[int, Task] = {}
        self._main = Task(get_ident(), lambda: None, self._hub)
        self.current = self._main

    # ---- the program begins and ends ----

    def run(self, main: Callable[[], int]) -> int:
        """Run a program's main thread to its end, and all others meanwhile; return what it returns.

        Raises:
            EndedError: If `end` has been called.
        """
        codes: list[int] = []
        errors: list[BaseException] = []

        def run_main() -> None:
            try:
                codes.append(main())
            except BaseException as error:
                errors.append(error)

        self._hub = greenlet.getcurrent()
        self._main.greenlet = greenlet.greenlet(run_main, self._hub)
        self.program.waiting = self._main.waiting
        self._main.greenlet.switch()
        if self.tasks or not self._main.greenlet.dead:
            _KEPT.append(self)
        if self._end is not None:
            raise self._end
        if errors:
            raise errors[0]
        return codes[0]

    def end(self, code: int, message: str = "") -> NoReturn:
        """End the program where it stands: none of its threads goes on."""
        self._end = EndedError(code, message)
        self._hub.switch()
        raise self._end  # never reached: nobody switches back

    def start(self, function: Callable[..., object], arguments: tuple[Any, ...], keywords: dict[str, Any]) -> int:
        """Start a thread, which goes on when this one waits; return its ident."""

        def run() -> None:
            try:
                function(*arguments, **keywords)
            except SystemExit:
                pass
            except Exception:
                # `threading` keeps what a thread raises; this is one of `_thread`, which complains so, too.
                traceback.print_exc()
            if task.sentinel is not None and task.sentinel.locked():
                task.sentinel.release()
            del self.tasks[task.ident]
            # The next one goes on where this greenlet ends.
            self._is_choosing = True
            task.greenlet.parent = self._choose().greenlet
            self._is_choosing = False

        task = Task(next(self._idents), run, self._hub)
        self.tasks[task.ident] = task
        self._ready.append(task)
        return task.ident

    # ---- who asks ----

    @property
    def is_here(self) -> bool:
        """Return whether the program asks, not another thread of this process, such as a server's."""
        return get_ident() == self._os_thread

    @property
    def is_main(self) -> bool:
        """Return whether the program's main thread runs."""
        return self.current is self._main

    @property
    def is_alone(self) -> bool:
        """Return whether no other thread goes on before this one, unless this one does something for it."""
        return not (self._ready or self._readers or self._watchers) and self._next_deadline_ns() == NEVER_NS

    @property
    def has_timed(self) -> bool:
        """Return whether another thread waits for a time or a robot; any thread of the process may ask."""
        deadlines = [task for _, number, task in list(self._deadlines) if task.waits_for and task.number == number]
        return bool(self._readers or deadlines)

    def poll(self) -> None:
        """Let a question to other threads, such as for a lock, cost what it costs; they may go on."""
        self._pay(self.program.poll())

    def ask(self) -> None:
        """Let a question cost what one for the time does; others may go on."""
        self._pay(self.program.ask())

    def _pay(self, cost_ns: int) -> None:
        if cost_ns:
            self.sleep_until(self.world.now_ns + cost_ns)

    # ---- waits ----

    def sleep_until(self, time_ns: int) -> None:
        """Let time pass up to an instant [ns]; others go on meanwhile."""
        if self._ready or self._readers or self._watchers or self._next_deadline_ns() <= time_ns:
            while self.wait("a time", until_ns=time_ns) is SIGNALLED:
                pass
        else:
            self.world.pass_to(time_ns)

    def give_way(self) -> None:
        """Let those go on that are ready, then this thread."""
        if self._ready:
            task = self.current
            task.waits_for = "its turn"
            self.wake(task, None)
            self._go_on(task)

    def wait(
        self,
        what: str,
        *,
        until_ns: int = NEVER_NS,
        reads: Sequence[Read] = (),
        files: Mapping[int, int] | None = None,
        may_go_alone: bool = False,
        when_stuck: bool = False,
    ) -> object:
        """Let other threads go on until this one is woken, a read is complete, a file is ready, or it is late enough.

        Args:
            what: What is waited for, in words for a person.
            until_ns: When the wait ends at the latest [ns].
            reads: Reads that end the wait.
            files: Events that end it, by descriptor.
            may_go_alone: Whether it ends, too, when no other thread can go on before a read is complete or it is late
                enough: the thread then waits for that itself, at less cost.
            when_stuck: Whether it ends when all threads would wait for ever: a person may still do something.

        Returns:
            What `wake` was called with; `COMPLETE` if a read is complete; `ALONE`; `STUCK`; None if it is late enough,
            or a file is ready; `SIGNALLED` if a signal came, and was dealt with, while the main thread waited.
        """
        task = self.current
        task.waits_for = what
        task.cause = None
        task.may_go_alone = may_go_alone
        task.number = next(self._numbers)
        if until_ns < NEVER_NS:
            heapq.heappush(self._deadlines, (until_ns, task.number, task))
        if reads:
            self._readers[task] = reads
        if files:
            self._watchers[task] = files
        if when_stuck:
            self._patient.append(task)
        try:
            self._go_on(task)
        finally:
            task.waits_for = ""
            self._readers.pop(task, None)
            self._watchers.pop(task, None)
            if when_stuck:
                self._patient.remove(task)
        return task.cause

    def wake(self, task: Task, cause: object) -> bool:
        """Let a thread go on that waits; return whether it did."""
        if not task.waits_for:
            return False
        task.waits_for = ""
        task.cause = cause
        self._ready.append(task)
        return True

    def interrupt(self, call: Callable[[], object], *, at_once: bool) -> None:
        """Let the main thread call a function: at once if it runs, else where it waits.

        Args:
            call: What it calls; if that raises, so does what it waits in.
            at_once: Whether the thread that runs may be stopped here for it.
        """
        if greenlet.getcurrent() is self._main.greenlet:
            call()
            return
        self._calls.append(call)
        self.wake(self._main, SIGNALLED)
        if at_once and not self._is_choosing and self._main in self._ready:
            self._ready.remove(self._main)
            self._ready.appendleft(self._main)
            self.give_way()

    # ---- inside ----

    def _go_on(self, task: Task) -> None:
        """Let the next thread go on; come back when it is the turn of this one."""
        self.program.act_count += 1
        self.lock_count = 0
        thinks = self.program.thinks
        if thinks and (thought_ns := self.program.enter(is_command=False)):
            self.world.think(thought_ns)
        self._is_choosing = True
        chosen = self._choose()
        self._is_choosing = False
        if chosen is not task:
            saved = [take() for take, _ in self.carried]
            chosen.greenlet.switch()
            for (_, put), value in zip(self.carried, saved, strict=True):
                put(value)
        if thinks:
            self.program.go_on()
        while self._calls and task is self._main:
            self._calls.popleft()()

    def _choose(self) -> Task:
        """Return the thread that goes on next; time passes until one may."""
        while not self._ready:
            self._pass_time()
        task = self._ready.popleft()
        self.current = task
        self.program.waiting = task.waiting
        return task

    def _next_deadline_ns(self) -> int:
        """Return when the next wait ends by its time [ns]."""
        deadlines = self._deadlines
        while deadlines:
            deadline_ns, number, task = deadlines[0]
            if task.waits_for and task.number == number:
                return deadline_ns
            heapq.heappop(deadlines)
        return NEVER_NS

    def _pass_time(self) -> None:
        """Let time pass until a thread may go on."""
        until_ns = self._next_deadline_ns()
        if len(self._readers) == 1 and not self._watchers:
            (reader,) = self._readers
            if reader.may_go_alone and (until_ns == NEVER_NS or self._deadlines[0][2] is reader):
                self.wake(reader, ALONE)
                return
        if self._watchers and self._look_at_files(block=False):
            return
        readers = [(task, read) for task, reads in self._readers.items() for read in reads]
        began_ns = self.world.now_ns
        complete: set[Task] = set()
        if readers:
            flags = self.world.wait_for([read for _, read in readers], until_ns)
            complete = {task for (task, _), flag in zip(readers, flags, strict=True) if flag}
        elif until_ns < NEVER_NS:
            self.world.pass_to(until_ns)
        now_ns = self.world.now_ns
        due = [(now_ns, task.number, task) for task in complete]
        while self._next_deadline_ns() <= now_ns:
            due.append(heapq.heappop(self._deadlines))
        for _, _, task in sorted(due, key=lambda entry: entry[:2]):
            self.wake(task, COMPLETE if task in complete else None)
        if not due and now_ns == began_ns and until_ns == NEVER_NS:
            if self._patient:
                self.wake(self._patient[0], STUCK)
                return
            if not self._watchers:
                self.end_stuck()
            # Only the world outside can go on, and simulated time stands still meanwhile.
            self._look_at_files(block=True)

    def _look_at_files(self, *, block: bool) -> bool:
        wanted: dict[int, int] = {}
        for files in self._watchers.values():
            for descriptor, events in files.items():
                wanted[descriptor] = wanted.get(descriptor, 0) | events
        ready = self._files.ready(wanted, block=block)
        woken = [task for task, files in self._watchers.items() if not ready.isdisjoint(files)]
        for task in sorted(woken, key=lambda task: task.number):
            self.wake(task, None)
        return bool(woken)

    def end_stuck(self) -> NoReturn:
        """End the program: none of its threads can ever go on."""
        self.current.waits_for = self.current.waits_for or "a robot that was asked nothing"
        waiting = ", ".join(
            f"{_name_of(task)} for {task.waits_for}" for task in (self._main, *self.tasks.values()) if task.waits_for
        )
        self.end(
            1,
            f"some thread of a program must be able to go on, but all wait for ever: {waiting}. The robot is silent "
            "until it is asked: give reads a timeout, and let threads know when to stop.",
        )


def timeout_ns(seconds: float) -> int:
    """Return a time-out [s] as a time [ns]: none for what is over, for ever for what is longer than any run."""
    if seconds <= 0:
        return 0
    return wait_ns(seconds) if seconds <= SECONDS_MAX else NEVER_NS


def _name_of(task: Task) -> str:
    thread = threading._active.get(task.ident)  # type: ignore[attr-defined]
    return thread.name if thread is not None else "a thread"

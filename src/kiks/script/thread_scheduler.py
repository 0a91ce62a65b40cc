"""The scheduler of a program's threads in simulated time: one thread runs until it waits.

The same program must give the same run, to the bit, however the operating system would schedule its threads. So each
thread is a greenlet of one thread of the operating system. It runs until it waits: for a lock, a time, characters on a
line, or a file. Then the next ready thread goes on, in the order in which the threads became ready. When none is ready,
simulated time passes to the earliest instant at which one may go on. Threads of the same instant go on in the order in
which they began to wait.
"""

from __future__ import annotations

import heapq
import math
import threading
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from itertools import count
from typing import Any, NoReturn, Protocol

import greenlet

from kiks.clock.pace import Pace
from kiks.clock.program_clock import ProgramClock, ThreadClock
from kiks.model.checks import SECONDS_MAX
from kiks.script.cpython import name_of_thread, new_idents, thread_values, unchanged
from kiks.sim.port import Line
from kiks.sim.read_completion import NEVER_NS, Read
from kiks.units import wait_ns

SIGNALLED, COMPLETE, ALONE, STUCK = object(), object(), object(), object()
"""Reasons for which a thread goes on: a signal; a complete read; no other thread can go on before its read is complete;
no thread can go on at all."""

LOOKED_FOR_KEYS = "it looked for keys"
"""Why a program with a person might do something else next time."""

PERSON_STEP_NS = 20_000_000
"""Longest time that passes between two looks for what a person does [ns]."""

BLOCK_MS = 50
"""Longest wait for files between two checks for signals [ms of real time]."""

get_ident: Callable[..., int] = unchanged(threading.get_ident)

_KEPT: list[Scheduler] = []
"""Schedulers with threads that never end: a waiting thread without a reference would be collected and run `finally`."""


class FileWait(Protocol):
    """What a thread waits for at real files: pipes, sockets, the keyboard."""

    @property
    def is_inside(self) -> bool:
        """Whether threads of the program alone can end the wait."""

    @property
    def is_for_person(self) -> bool:
        """Whether it waits for what a person does, so that time passes as it does for people."""

    def is_over(self, block_ms: int) -> bool:
        """Return whether a file is ready, after at most this real time [ms]."""


def _bootstrap(run: Callable[[], object], *_: object) -> None:
    run()


# The outermost function of a thread: as one of `threading`, pydevd waits until it is known which thread that is.
_bootstrap.__code__ = _bootstrap.__code__.replace(co_filename=threading.__file__)


class ThreadTask:
    """A thread of the program.

    Attributes:
        ident: Its `threading.get_ident`.
        waits_for: What it waits for, for messages; empty while it does not wait.
        clock: What it pays for polls and thinking.
        sentinel: A lock that is released when it ends; None if no thread has asked for it.
    """

    def __init__(self, ident: int, run: Callable[[], object], hub: greenlet.greenlet) -> None:
        self.ident = ident
        self.waits_for = ""
        self.clock = ThreadClock()
        self.sentinel: Any = None
        self.greenlet = greenlet.greenlet(partial(_bootstrap, run), hub)
        self.number = 0
        self.cause: object = None
        self.may_go_alone = False


class EndedError(Exception):
    """The program has ended, with an exit code and a message."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code
        self.message = message


class Scheduler:
    """Decides which thread of a program runs, and how far simulated time goes.

    Args:
        world: A line of the program's world, for its time.
        program: The cost of thinking and polling.

    Attributes:
        main: The main thread.
        current: The running thread.
        tasks: Started threads that have not ended, by ident.
        lock_count: Number of free locks that the running thread has taken since it went on.
        own_thread: The thread of the operating system that runs the program.
        os_thread: The same; 0 while it lives in real time, and when the program has ended.
        before_time: What must be done before time passes.
        carried: Functions that take away, and put back, values that libraries keep per thread of the operating system.
    """

    def __init__(self, world: Line, program: ProgramClock) -> None:
        self.world = world
        self.program = program
        self.before_time: list[Callable[[], object]] = []
        self.carried: list[tuple[Callable[[], object], Callable[[Any], object]]] = []
        self.os_thread = self.own_thread = get_ident()
        self._standing_count = 0
        self._begun_with: list[tuple[Callable[[], object], Callable[[Any], object]]] = []
        self._hub = self._starter = greenlet.getcurrent()
        self._end: EndedError | None = None
        self._new_idents, self._free_idents = new_idents(), list[int]()
        self._numbers = count(1)
        # Functions that the main thread must call, for signals, and whether the next thread is being chosen.
        self._calls: deque[Callable[[], object]] = deque()
        self._is_choosing = self._is_over = False
        self._ready: deque[ThreadTask] = deque()
        # Deadlines of waits [ns], with their numbers and threads; waits that have ended before stay in the heap.
        self._deadlines: list[tuple[int, int, ThreadTask]] = []
        self._readers: dict[ThreadTask, Sequence[Read]] = {}
        self._watchers: dict[ThreadTask, FileWait] = {}
        self._patient: list[ThreadTask] = []
        # The waits for a person, and the time in which a person lives meanwhile.
        self._person_waits, self._pace = 0, Pace()
        self.lock_count = 0
        self.tasks: dict[int, ThreadTask] = {}
        self.main = ThreadTask(get_ident(), lambda: None, self._hub)
        self.current = self.main

    # ---- start and end ----

    def run(self, main: Callable[[], int]) -> int:
        """Run a program's main thread to its end, and all others meanwhile; return its result.

        Raises:
            EndedError: If `end` has been called.
        """
        codes: list[int] = []
        errors: list[BaseException] = []

        def run_main() -> None:
            # The main thread begins with the values of this one, and others with none.
            self.carried += [(take, put), *self._begun_with]
            try:
                codes.append(main())
            except BaseException as error:
                errors.append(error)

        self._hub = greenlet.getcurrent()
        self._starter = greenlet.greenlet(self._start_threads, self._hub)
        self.main.greenlet = greenlet.greenlet(run_main, self._hub)
        self.program.thread = self.main.clock
        take, put = thread_values()
        values = take()
        put(values)
        kept = [(put_back, get()) for get, put_back in self._begun_with]
        for put_back, value in kept:
            put_back(value)
        self._switch(self.main)
        # The program may have ended in any of its threads.
        put(values)
        for put_back, value in kept:
            put_back(value)
        # It returns: a debugger would take an exception that ends it for one of the program.
        self._is_over = True
        self._starter.switch()
        # What libraries in C keep of this program must not take later callers for it.
        self.os_thread = 0
        if self.tasks or not self.main.greenlet.dead:
            _KEPT.append(self)
        if self._end is not None:
            raise self._end
        if errors:
            raise errors[0]
        return codes[0]

    def end(self, code: int, message: str = "") -> NoReturn:
        """End the program at once: none of its threads goes on."""
        self._end = EndedError(code, message)
        self._hub.switch()
        raise self._end  # never reached: no greenlet switches back

    def start(
        self, function: Callable[..., object], arguments: tuple[Any, ...], keywords: dict[str, Any]
    ) -> ThreadTask:
        """Start a thread, which goes on when this one waits."""

        def run() -> None:
            try:
                function(*arguments, **keywords)
            except SystemExit:
                pass
            except Exception:
                # `threading` handles exceptions of its threads; this is a thread of `_thread`, which prints them.
                traceback.print_exc()
            if task.sentinel is not None:
                with suppress(RuntimeError):
                    task.sentinel.release()
            del self.tasks[task.ident]
            heapq.heappush(self._free_idents, task.ident)
            # When a greenlet ends, its parent goes on: the next thread.
            self._is_choosing = True
            task.greenlet.parent = self._greenlet_for(self._choose())
            self._is_choosing = False

        ident = heapq.heappop(self._free_idents) if self._free_idents else next(self._new_idents)
        task = ThreadTask(ident, run, self._hub)
        self.tasks[task.ident] = task
        self._ready.append(task)
        return task

    def carry(self, take: Callable[[], object], put: Callable[[Any], object]) -> None:
        """Add to `carried` what the main thread begins with."""
        (self.carried if self.main.greenlet else self._begun_with).append((take, put))

    # ---- queries ----

    @property
    def is_here(self) -> bool:
        """Whether the caller is a thread of the program, not another thread of this process, such as a server's."""
        return get_ident() == self.os_thread

    @contextmanager
    def real_time(self) -> Iterator[None]:
        """Let the running thread live in real time meanwhile, alone."""
        thread, self.os_thread = self.os_thread, 0
        try:
            yield
        finally:
            self.os_thread = thread

    @property
    def is_standing(self) -> bool:
        """Whether the caller is a thread of the program in `standing`."""
        return bool(self._standing_count) and not self.os_thread and get_ident() == self.own_thread

    @contextmanager
    def standing(self) -> Iterator[None]:
        """Let the running thread live in real time meanwhile, alone, and the world stand: a debugger has stopped it.

        No thinking, no poll and no patience counts. It may be entered again inside. In another thread of the process it
        does nothing. What code of the program asks for at a prompt of the debugger lives in simulated time, as in
        `resumed`.
        """
        if not (self.is_here or self.is_standing):
            yield
            return
        lock_count = self.lock_count
        self._standing_count += 1
        if self._standing_count == 1:
            self._stand(True)
        try:
            with self.real_time():
                yield
        finally:
            self.lock_count = lock_count
            self._standing_count -= 1
            if not self._standing_count:
                self._stand(False)

    def _stand(self, stands: bool) -> None:
        self.program.stand(stands)
        self.world.stand(stands)

    @contextmanager
    def resumed(self) -> Iterator[None]:
        """Let the running thread leave `standing` meanwhile: other threads may go on, and time may pass."""
        began_ns, self.os_thread = self.world.known_ns, self.own_thread
        try:
            yield
        finally:
            self.os_thread = 0
            if self.world.known_ns != began_ns:
                self.program.doubt = self.program.doubt or "an expression in a debugger let time pass"

    @property
    def is_alone(self) -> bool:
        """Whether no other thread can go on before this one does something for it."""
        return not (self._ready or self._readers or self._watchers) and self._next_deadline_ns() == NEVER_NS

    @property
    def has_timed(self) -> bool:
        """Whether another thread waits for a time or a robot; from any thread of the process."""
        deadlines = [task for _, number, task in list(self._deadlines) if task.waits_for and task.number == number]
        return bool(self._readers or deadlines)

    def poll(self) -> None:
        """Charge a poll of other threads, such as of a lock; they may go on."""
        self._pay(self.program.poll())

    def ask(self) -> None:
        """Charge a poll of the time; other threads may go on."""
        self._pay(self.program.ask())

    def _pay(self, cost_ns: int) -> None:
        if cost_ns:
            self.sleep_until(self.world.now_ns + cost_ns)

    # ---- waits ----

    def sleep_until(self, time_ns: int) -> None:
        """Let time pass up to an instant [ns]; other threads go on meanwhile."""
        self.settle()
        if self._ready or self._readers or self._watchers or self._next_deadline_ns() <= time_ns:
            while self.wait("a time", until_ns=time_ns) is SIGNALLED:
                pass
        else:
            self.world.pass_to(time_ns)

    def settle(self) -> None:
        """Do what must be done before time passes."""
        for each in self.before_time:
            each()

    def give_way(self) -> None:
        """Let ready threads go on, then this thread."""
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
        files: FileWait | None = None,
        may_go_alone: bool = False,
        when_stuck: bool = False,
    ) -> object:
        """Let other threads go on until a wake, a complete read, a ready file, or the deadline.

        Args:
            what: The reason of the wait, for messages.
            until_ns: The deadline [ns].
            reads: Reads that end the wait.
            files: The real files that end it.
            may_go_alone: Whether it also ends when no other thread can go on before a read is complete or the deadline
                is over: the thread then waits for that itself, at less cost.
            when_stuck: Whether it ends when all threads would wait for ever; a person may still act.

        Returns:
            The argument of `wake`; `COMPLETE` if a read is complete; `ALONE`; `STUCK`; None if the deadline is over or
            a file is ready; `SIGNALLED` if a signal came, and was handled, while the main thread waited.
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
            if files.is_for_person:
                self._person_waits += 1
                self._pace.start(self.world.now_ns)
        if when_stuck:
            self._patient.append(task)
        try:
            self._go_on(task)
        finally:
            task.waits_for = ""
            self._readers.pop(task, None)
            self._watchers.pop(task, None)
            self._person_waits -= files is not None and files.is_for_person
            if when_stuck:
                self._patient.remove(task)
        return task.cause

    def wake(self, task: ThreadTask, cause: object) -> bool:
        """Wake a waiting thread; return whether it waited."""
        if not task.waits_for:
            return False
        task.waits_for = ""
        task.cause = cause
        self._ready.append(task)
        return True

    def waiting_for(self, what: str) -> list[ThreadTask]:
        """Return the threads that wait for something, in the order in which they began."""
        waiting = [task for task in (self.main, *self.tasks.values()) if task.waits_for == what]
        return sorted(waiting, key=lambda task: task.number)

    def interrupt(self, call: Callable[[], object], *, at_once: bool) -> None:
        """Let the main thread call a function: at once if it runs, otherwise where it waits.

        Args:
            call: The function; an exception in it is raised from the wait.
            at_once: Whether it may preempt the running thread here.
        """
        if greenlet.getcurrent() is self.main.greenlet:
            call()
            return
        self._calls.append(call)
        self.wake(self.main, SIGNALLED)
        if at_once and not self._is_choosing and self.main in self._ready:
            self._ready.remove(self.main)
            self._ready.appendleft(self.main)
            self.give_way()

    # ---- inside ----

    def _go_on(self, task: ThreadTask) -> None:
        """Let the next thread go on; return when it is this thread's turn."""
        self.program.act_count += 1
        self.lock_count = 0
        thinks = self.program.thinks
        if thinks and (thought_ns := self.program.enter(is_command=False)):
            self.world.think(thought_ns)
        self._is_choosing = True
        chosen = self._choose()
        self._is_choosing = False
        if chosen is not task:
            self._switch(chosen)
        if thinks:
            self.program.go_on()
        while self._calls and task is self.main:
            self._calls.popleft()()

    def _switch(self, task: ThreadTask) -> None:
        """Let a thread go on, which finds no values of this one; return when this one goes on."""
        saved = [(put, take()) for take, put in self.carried]
        # It may stand, and ask for something that takes time.
        thread, self.os_thread = self.os_thread, self.own_thread
        self._greenlet_for(task).switch()
        self.os_thread = thread
        for put, value in reversed(saved):
            put(value)

    def _greenlet_for(self, task: ThreadTask) -> greenlet.greenlet:
        """Return the greenlet of the current thread, or the one that lets it begin."""
        return task.greenlet if task.greenlet else self._starter

    def _start_threads(self) -> None:
        """Let the current thread begin, at each switch to here.

        A greenlet begins as deep in the limit of recursion as the one that switches to it: so none begins from another.
        """
        while not self._is_over:
            self.current.greenlet.switch()

    def _choose(self) -> ThreadTask:
        """Return the next thread; let time pass until one is ready."""
        while not self._ready:
            self._pass_time()
        task = self._ready.popleft()
        self.current = task
        self.program.thread = task.clock
        return task

    def _next_deadline_ns(self) -> int:
        """Return the next deadline of a wait [ns]."""
        deadlines = self._deadlines
        while deadlines:
            deadline_ns, number, task = deadlines[0]
            if task.waits_for and task.number == number:
                return deadline_ns
            heapq.heappop(deadlines)
        return NEVER_NS

    def _pass_time(self) -> None:
        """Let time pass until a thread may go on."""
        self.settle()
        until_ns = self._next_deadline_ns()
        if len(self._readers) == 1 and not self._watchers:
            (reader,) = self._readers
            if reader.may_go_alone and (until_ns == NEVER_NS or self._deadlines[0][2] is reader):
                self.wake(reader, ALONE)
                return
        if self._watchers and self._look_at_files(self._ahead_ms() if self._person_waits else 0):
            return
        if self._person_waits and (self._readers or until_ns < NEVER_NS):
            self.program.doubt = LOOKED_FOR_KEYS
            until_ns = min(until_ns, self.world.now_ns + PERSON_STEP_NS)
        readers = [(task, read) for task, reads in self._readers.items() for read in reads]
        began_ns = self.world.now_ns
        complete: set[ThreadTask] = set()
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
            if all(files.is_inside for files in self._watchers.values()):
                self.end_stuck()
            # Only a real file can wake a thread; simulated time stands still meanwhile.
            self._look_at_files(BLOCK_MS)
            self._pace.start(now_ns)

    def _ahead_ms(self) -> int:
        """Return how far simulated time is ahead of a person's [ms]; one that was behind does not hurry later."""
        now_ns = self.world.now_ns
        ahead_s = self._pace.wall_wait_s(now_ns)
        if not ahead_s:
            self._pace.start(now_ns)
        return int(ahead_s * 1000)

    def _look_at_files(self, block_ms: int) -> bool:
        """Wake the threads whose files are ready; wait some real time for that [ms]."""
        each_ms = block_ms // len(self._watchers)
        woken = [task for task, files in self._watchers.items() if files.is_over(each_ms)]
        for task in sorted(woken, key=lambda task: task.number):
            self.wake(task, None)
        return bool(woken)

    def end_stuck(self) -> NoReturn:
        """End the program, because none of its threads can ever go on."""
        self.current.waits_for = self.current.waits_for or "a robot that was asked nothing"
        waiting = ", ".join(
            f"{name_of_thread(task.ident)} for {task.waits_for}"
            for task in (self.main, *self.tasks.values())
            if task.waits_for
        )
        self.end(
            1,
            f"some thread of a program must be able to go on, but all wait for ever: {waiting}. The robot is silent "
            "until it is asked: give reads a timeout, and let threads know when to stop.",
        )


def timeout_ns(seconds: float) -> int:
    """Return a timeout [s] as a time [ns]: 0 if it is negative, for ever if it is longer than any run."""
    if math.isnan(seconds):
        raise ValueError("Invalid value NaN (not a number)")
    if seconds <= 0:
        return 0
    return wait_ns(seconds) if seconds <= SECONDS_MAX else NEVER_NS

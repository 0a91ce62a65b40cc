"""What programs with threads must do in simulated time: a plain discrete-event simulation of them.

A program is a list of steps for each thread. Here each thread is a generator that yields whenever it waits, and one
loop says who goes on: nothing of `threading`, and nothing of KiKS but the robots.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator
from dataclasses import dataclass, field
from typing import Any

from kiks.sim.simulation import Simulation

Steps = list[list[Any]]
Trace = list[tuple[int, int, Any]]
"""Number of the thread, time [ns], and what it saw."""


@dataclass(eq=False)
class Wait:
    """Why a thread does not go on: it waits in a queue of others, up to a time, or for a line of a robot."""

    until_ns: int | None = None
    queue: list[Thread] | None = None
    robot: int = 0


@dataclass(eq=False)
class Thread:
    """A thread: what it does, and since when it waits."""

    run: Generator[Wait, Any, None]
    wait: Wait | None = None
    order: int = 0
    is_woken: bool = False
    joiners: list[Thread] = field(default_factory=list)
    is_over: bool = False


@dataclass(eq=False)
class Meeting:
    """A lock, a queue or an event: whether it is locked or set, what is in it, and which threads wait for it."""

    is_on: bool = False
    items: deque[int] = field(default_factory=deque)
    waiters: list[Thread] = field(default_factory=list)


class Oracle:
    """Runs a program of several threads; see `steps.py` for what the steps mean."""

    def __init__(self, sim: Simulation, program: list[Steps]) -> None:
        self.sim = sim
        self.trace: Trace = []
        self.ready: deque[Thread] = deque()
        self.threads: list[Thread] = []
        self.count = 0
        self.locks, self.queues, self.events, self.lines = (
            [Meeting() for _ in range(count)] for count in (3, 2, 2, sim.robot_count)
        )
        main = Thread(self.main(program))
        self.threads.append(main)
        self.ready.append(main)
        self.loop(main)

    # ---- who goes on ----

    def loop(self, main: Thread) -> None:
        while not main.is_over:
            if not self.ready:
                self.pass_time()
            thread = self.ready.popleft()
            thread.wait = None
            self.current = thread
            try:
                wait = thread.run.send(thread.is_woken if thread.order else None)
            except StopIteration:
                thread.is_over = True
                if thread.joiners:
                    self.wake(thread.joiners.pop(0))
                continue
            self.count += 1
            thread.wait, thread.order, thread.is_woken = wait, self.count, False
            if wait.queue is not None:
                wait.queue.append(thread)

    def wake(self, thread: Thread) -> None:
        thread.is_woken = True
        self.ready.append(thread)

    def pass_time(self) -> None:
        sim = self.sim
        waiting = [thread for thread in self.threads if thread.wait is not None and not thread.is_woken]
        times = [thread.wait.until_ns for thread in waiting if thread.wait and thread.wait.until_ns is not None]
        readers = [thread for thread in waiting if thread.wait and thread.wait.robot]
        until_ns = min(times, default=1 << 62)
        while True:
            # The earliest of: a deadline, the last character of a reply, a robot that acts.
            arrivals = [self.reply_ns(thread.wait.robot) for thread in readers if thread.wait]
            end_ns = min([until_ns, *(at for at in arrivals if at is not None)])
            event_ns = sim.next_event_ns()
            if event_ns is None or event_ns > end_ns:
                break
            sim.advance_to(event_ns)
        sim.advance_to(end_ns)
        due = {thread for thread in waiting if thread.wait and thread.wait.until_ns == end_ns}
        due |= {thread for thread in readers if thread.wait and self.reply_ns(thread.wait.robot) == end_ns}
        for thread in sorted(due, key=lambda thread: thread.order):
            if thread.wait and thread.wait.queue is not None:
                thread.wait.queue.remove(thread)
            self.ready.append(thread)
            thread.wait = None

    def reply_ns(self, robot: int) -> int | None:
        line = self.sim.wires[robot - 1].line
        found = line.waiting.find(b"\n")
        return None if found < 0 else line.arrival_ns(found + 1)

    # ---- what threads do ----

    def main(self, program: list[Steps]) -> Generator[Wait, Any, None]:
        started = []
        for number, steps in enumerate(program[1:], 1):
            started.append(thread := Thread(self.thread(number, steps)))
            self.threads.append(thread)
            self.ready.append(thread)
            self.begun: list[Thread] = []
            yield Wait(queue=self.begun)
        yield from self.steps(0, program[0])
        for thread in started:
            if not thread.is_over:
                yield Wait(queue=thread.joiners)
        self.trace.append((0, self.sim.now_ns, "end"))

    def thread(self, number: int, steps: Steps) -> Generator[Wait, Any, None]:
        self.wake(self.begun.pop())
        yield from self.steps(number, steps)

    def until(self, ms: int | None) -> int | None:
        return None if ms is None else self.sim.now_ns + ms * 1_000_000

    def steps(self, number: int, steps: Steps) -> Generator[Wait, Any, None]:
        for kind, *rest in steps:
            seen = yield from getattr(self, kind)(number, *rest)
            self.trace.append((number, self.sim.now_ns, [kind, seen]))

    def sleep(self, _number: int, ms: int) -> Generator[Wait, Any, None]:
        yield Wait(self.until(ms))

    def take(self, lock: Meeting, ms: int | None) -> Generator[Wait, Any, bool]:
        if not lock.is_on:
            lock.is_on = True
            return True
        return (yield Wait(self.until(ms), lock.waiters))

    def give(self, lock: Meeting) -> None:
        if lock.waiters:
            self.wake(lock.waiters.pop(0))
        else:
            lock.is_on = False

    def lock(self, number: int, index: int, ms: int, steps: Steps) -> Generator[Wait, Any, bool]:
        lock = self.locks[index]
        has_it = yield from self.take(lock, ms)
        if has_it:
            yield from self.steps(number, steps)
            self.give(lock)
        return has_it

    def put(self, _number: int, index: int, item: int) -> Generator[Wait, Any, None]:
        queue = self.queues[index]
        queue.items.append(item)
        if queue.waiters:
            self.wake(queue.waiters.pop(0))
        yield from ()

    def get(self, _number: int, index: int, ms: int) -> Generator[Wait, Any, int | None]:
        # As `queue.Queue` computes it, so that both round in the same way.
        queue, end_s = self.queues[index], self.sim.now_ns / 1e9 + ms / 1000
        while not queue.items:
            left_s = end_s - self.sim.now_ns / 1e9
            if left_s <= 0:
                return None
            yield Wait(self.sim.now_ns + max(round(left_s * 1e9), 1), queue.waiters)
        return queue.items.popleft()

    def set(self, _number: int, index: int) -> Generator[Wait, Any, None]:
        event = self.events[index]
        event.is_on = True
        while event.waiters:
            self.wake(event.waiters.pop(0))
        yield from ()

    def clear(self, _number: int, index: int) -> Generator[Wait, Any, None]:
        self.events[index].is_on = False
        yield from ()

    def wait(self, _number: int, index: int, ms: int) -> Generator[Wait, Any, bool]:
        event = self.events[index]
        return True if event.is_on else (yield Wait(self.until(ms), event.waiters))

    def ask(self, _number: int, robot: int, command: str) -> Generator[Wait, Any, str]:
        line = self.lines[robot - 1]
        yield from self.take(line, None)
        wire = self.sim.wires[robot - 1]
        wire.send(command.encode(), self.sim.now_ns)
        yield Wait(robot=robot)
        reply = wire.line.take(wire.line.waiting.find(b"\n") + 1).decode()
        self.give(line)
        return reply

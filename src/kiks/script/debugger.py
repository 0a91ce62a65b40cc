"""Follows a program line by line for a debugger at the other end of its link (`kiks.debug.session`).

Whenever the program stops, the world stands. All that a debugger wants to know comes as requests of the Debug Adapter
Protocol, one at a time, as answers to what is told here. So the program needs no thread and no connection of its own,
and can be debugged in a sandbox, too.
"""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from inspect import CO_ASYNC_GENERATOR, CO_COROUTINE, CO_GENERATOR
from time import perf_counter
from types import FrameType
from typing import TYPE_CHECKING, Any

from kiks.clock.program_clock import ProgramClock
from kiks.errors import KiksError
from kiks.script.cpython import FIRST_IDENT, IDENT_STEP, is_suspended
from kiks.script.here import showing_robot
from kiks.script.history import LineHistory
from kiks.script.inspection import Inspection
from kiks.script.libraries.debuggers import carry_trace
from kiks.script.refusals import is_of_program
from kiks.script.thread_scheduler import Scheduler, ThreadTask
from kiks.sim.read_completion import NEVER_NS

if TYPE_CHECKING:
    from kiks.script.prompt import Prompt

POLL_S = 0.05
"""Time after which a running program asks whether it shall stop [s of real time]."""

POLL_LINES = 20_000
"""Lines after which it looks at the time."""

CHANGED = "a person has changed the program in a debugger"
"""Why such a run is another one."""

_MAY_PAUSE = CO_ASYNC_GENERATOR | CO_COROUTINE | CO_GENERATOR
_DEPTH_MAX = 0xFFFF
_OF_LOOPS = (StopIteration, StopAsyncIteration, GeneratorExit)
"""Exceptions by which Python itself ends loops."""

Body = dict[str, Any]
Trace = Callable[[FrameType, str, Any], Any]


class Breakpoint:
    """Where a program stops.

    Args:
        given: The line with its condition, its count of hits and its message, as the protocol has them.
    """

    def __init__(self, given: Body) -> None:
        self._condition, self._hits, self.message = (
            str(given.get(name) or "").strip() for name in ("condition", "hitCondition", "logMessage")
        )
        self._count = 0

    @property
    def calls(self) -> bool:
        """Whether the condition calls a function."""
        return "(" in self._condition

    @property
    def is_plain(self) -> bool:
        """Whether the program stops there each time."""
        return not (self._condition or self._hits or self.message)

    def is_hit(self, frame: FrameType) -> bool:
        """Return whether the program stops there now; it does where the condition fails."""
        with suppress(Exception):
            if self._condition and not eval(self._condition, frame.f_globals, frame.f_locals):
                return False
        self._count += 1
        hits = self._hits if not self._hits.isdigit() else f">= {self._hits}"
        hits = f"{hits} == 0" if hits.startswith("%") else hits
        with suppress(Exception):
            return not hits or bool(eval(f"{self._count} {hits}", {}))
        return True

    def text(self, frame: FrameType) -> str:
        """Return its message with the values of what stands in braces."""
        try:
            return str(eval(f"f{self.message!r}", frame.f_globals, frame.f_locals))
        except Exception as error:
            return f"{self.message} ({type(error).__name__}: {error})"


class _StepEnd:
    """Where a step ends: in its thread, and not deeper than it may be.

    Args:
        task: The thread.
        depth_max: How deep it may end.
        frame: The coroutine in which it ends, as others run at the same depth while that one waits; None for others.
    """

    def __init__(self, task: ThreadTask, depth_max: int, frame: FrameType | None = None) -> None:
        self.task, self.depth_max, self.frame = task, depth_max, frame

    def ends(self, task: ThreadTask, depth: int, frame: FrameType) -> bool:
        """Return whether it ends at a line."""
        return task is self.task and (depth <= self.depth_max if self.frame is None else frame is self.frame)


class Debugger:
    """Follows a program, stops it, and shows it.

    Args:
        scheduler: The program's threads.
        consult: Tells the debugger something, and returns its next request as JSON; empty if the program shall go on.
        clock: The program's clock.
        program: Its file.
    """

    def __init__(self, scheduler: Scheduler, consult: Callable[[str], str], clock: ProgramClock, program: str) -> None:
        self._scheduler, self._consult, self._clock = scheduler, consult, clock
        self._program = os.path.join(os.getcwd(), program)
        self._history = LineHistory()
        self._bases: dict[str, int] = {}
        self._traces: dict[int, Trace] = {}
        self._depths: dict[Any, int] = {}
        # The breakpoints of each file by their lines; each file's dictionary stays, as what follows its lines has it.
        self._breakpoints: dict[str, dict[int, Breakpoint]] = {}
        self._given: dict[str, list[Body]] = {}
        self._filters: set[str] = set()
        self._raised: BaseException | None = None
        # Where the program stops next, whatever stands there, and the last breakpoint that it has met on the way.
        self._target = self._met = 0
        self._place: list[Any] | None = None
        self._stopped_at = -1
        self._step: _StepEnd | None = None
        self._shall_pause = False
        self._alert_at = self._poll_at_s = 0.0
        self._inspection: Inspection | None = None
        self._frame: FrameType | None = None
        # What the program printed goes where these lead when it is muted.
        self._unmuted: tuple[int, int] | None = None
        self._muted_until_ns = 0
        self._has_editor, self._is_inside, self._note = True, False, ""
        self._stops_at_end = self._is_at_end = False
        self._prompt: Prompt | None = None

    @contextmanager
    def following(self) -> Iterator[None]:
        """Follow a program that runs meanwhile."""
        self._talk({"event": "begun"})
        carry_trace(self._scheduler)
        before, hook = sys.gettrace(), sys.breakpointhook
        sys.breakpointhook = self._stop_here
        threading.settrace(self._called)
        sys.settrace(self._called)
        try:
            yield
            # From there, too, one can go back.
            if self._stops_at_end and self._raised is None and self._target in (0, self._history.count + 1):
                self._stop("end", [sys._getframe()])
        finally:
            sys.settrace(before)
            threading.settrace(before)
            sys.breakpointhook = hook
            if self._unmuted is not None:
                self._unmute()
            if self._target:
                self._talk({"event": "missed"})

    def note_uncaught(self, error: BaseException) -> None:
        """Stop where an exception was raised that ends a thread, if that is wanted."""
        frames, trace = [], error.__traceback__
        while trace is not None:
            frames.append(trace.tb_frame)
            trace = trace.tb_next
        if (
            "uncaught" in self._filters
            and not self._target
            and any(is_of_program(each.f_code.co_filename) for each in frames)
        ):
            self._raised = error
            self._stop("exception", frames[::-1], text=f"{type(error).__name__}: {error}")

    # ---- following ----

    def _called(self, frame: FrameType, event: str, arg: Any) -> Trace | None:
        """Follow the lines of a function that begins, or of a coroutine that goes on, if it is the program's own."""
        name = frame.f_code.co_filename
        base = self._bases.get(name)
        if base is None:
            base = self._base_of(name)
        if not base:
            return None
        # The nearest function of the program that waits for this one knows how deep it is.
        depth, caller = 1, frame.f_back
        while caller is not None:
            if (known := self._depths.get(caller.f_trace)) is not None:
                depth = min(known + 1, _DEPTH_MAX)
                break
            caller = caller.f_back
        return self._traces.get(base + depth) or self._new_trace(name, base, depth)

    def _base_of(self, name: str) -> int:
        is_own = is_of_program(name) or name.startswith(self._program)
        base = self._bases[name] = self._history.base_of(name) if is_own else 0
        return base

    def _new_trace(self, name: str, base: int, depth: int) -> Trace:
        """Return what follows the lines of a file at a depth."""
        history, clock, scheduler = self._history, self._clock, self._scheduler
        places, add_depth = history.places, history.depths.append
        add_place = places.append
        breakpoints = self._breakpoints.setdefault(os.path.realpath(name), {})

        # This runs for each line of the program.

        def follow(frame: FrameType, event: str, arg: Any) -> Trace:
            if event == "line":
                line = frame.f_lineno
                add_place(base + line)
                add_depth(depth)
                if clock.act_count != history.acts:
                    time_ns = scheduler.world.known_ns
                    history.mark(clock.act_count, time_ns, self._number(scheduler.current))
                    # One that waits for its robot has few lines.
                    if perf_counter() > self._poll_at_s and not self._target:
                        self._alert_at = 0
                    if self._unmuted is not None and time_ns > self._muted_until_ns:
                        self._unmute()
                if line in breakpoints or len(places) >= self._alert_at:
                    self._look(frame, depth, breakpoints.get(line))
            elif event == "return":
                if self._step is not None and frame is self._step.frame and not is_suspended(frame):
                    self._step.frame = None
            elif self._filters and event == "exception" and "raised" in self._filters:
                self._note_raised(frame, arg[1])
            return follow

        self._depths[follow] = depth
        self._traces[base + depth] = follow
        return follow

    def _look(self, frame: FrameType, depth: int, met: Breakpoint | None) -> None:
        """Stop at a line if there is a reason."""
        count = self._history.count
        if self._target:
            if count >= self._target:
                self._stop("goto", [frame])
            elif met is not None and not met.message and self._is_hit(met, frame):
                self._met = count
            self._watch()
            return
        is_met = met is not None and self._is_hit(met, frame)
        if is_met and met is not None and met.message:
            with self._scheduler.standing():
                text = met.text(frame)
            self._talk({"event": "output", "text": text})
        elif is_met:
            self._stop("breakpoint", [frame])
        elif self._step is not None and self._step.ends(self._scheduler.current, depth, frame):
            self._stop("step", [frame])
        elif self._shall_pause:
            self._stop("pause", [frame])
        elif self._step is None and perf_counter() > self._poll_at_s:
            self._talk({"event": "poll"})
        self._watch()

    def _is_hit(self, met: Breakpoint, frame: FrameType) -> bool:
        # What a condition calls, such as a clock, takes no time of the program.
        with self._scheduler.standing() if met.calls else nullcontext():
            return met.is_hit(frame)

    def _watch(self) -> None:
        """Set the line at which `_look` is called at the latest."""
        history = self._history
        history.trim()
        self._poll_at_s = perf_counter() + POLL_S
        self._alert_at = len(history.places) + POLL_LINES
        if self._step is not None or self._shall_pause:
            self._alert_at = 0
        elif self._target:
            self._alert_at = min(self._alert_at, self._target - history.dropped)

    def _note_raised(self, frame: FrameType, error: BaseException) -> None:
        if error is not self._raised and not isinstance(error, _OF_LOOPS) and not self._target:
            self._raised = error
            self._stop("exception", [frame], text=f"{type(error).__name__}: {error}")

    def _number(self, task: ThreadTask) -> int:
        """Return the number of a thread: 1 for the main thread."""
        return 1 if task is self._scheduler.main else (task.ident - FIRST_IDENT) // IDENT_STEP + 2

    # ---- standing ----

    def _stop_here(self, *_: Any, **__: Any) -> None:
        """Stop at a call of `breakpoint`."""
        # A breakpoint at its line has stopped there already.
        if not self._target and self._stopped_at != self._history.count:
            self._stop("breakpoint", [sys._getframe(1)])

    def _stop(self, reason: str, frames: list[FrameType], *, text: str = "") -> None:
        """Let the world stand at a line until the program shall go on."""
        scheduler, history = self._scheduler, self._history
        is_reached, self._target = bool(self._target), 0
        self._step, self._shall_pause, self._frame = None, False, frames[0]
        self._is_inside, self._is_at_end = reason == "exception", reason == "end"
        self._stopped_at = history.count
        if self._unmuted is not None:
            self._unmute()
        stop = self._stop_news(reason, frames[0], text)
        if is_reached and self._place not in (None, [stop["file"], stop["line"]]):
            self._note = "the run went another way when it was made again: something outside of it has changed."
        tasks = {self._number(task): task for task in (scheduler.main, *scheduler.tasks.values())}
        stacks = {number: _stack(task.greenlet.gr_frame) for number, task in tasks.items()}
        stacks[stop["thread"]] = [*frames, *_stack(frames[-1].f_back)]
        # What a person evaluates is no part of the run.
        sys.settrace(None)
        with scheduler.standing(), showing_robot(frames[0]):
            if self._has_editor:
                self._inspection = Inspection(stacks)
                self._say_note()
                self._talk(stop)
            else:
                self._ask_at_prompt(frames[0])
        sys.settrace(self._called)
        self._inspection = self._frame = None
        self._watch()

    def _stop_news(self, reason: str, frame: FrameType, text: str) -> Body:
        file, line = frame.f_code.co_filename, frame.f_lineno
        if self._is_at_end and self._history.count:
            file, line = self._history.place(self._history.count)
        return {
            "event": "stopped",
            "reason": reason,
            "text": text,
            "thread": self._number(self._scheduler.current),
            "count": self._history.count + self._is_at_end,
            "file": file,
            "line": line,
            "time_ns": self._scheduler.world.known_ns,
        }

    # ---- the prompt of pdb ----

    def _ask_at_prompt(self, frame: FrameType) -> None:
        from kiks.script.prompt import Prompt  # here, with the libraries of a prompt

        if (prompt := self._prompt) is None:
            prompt = self._prompt = Prompt(self._back_from_prompt)
            for file, lines in self._given.items():
                for each in lines:
                    prompt.set_break(file, each["line"], cond=each["condition"])
        self._say_note()
        how = prompt.ask(frame)
        self._set_breakpoints(prompt.breakpoints)
        self._note_change(prompt.has_changed)
        if how == "quit":
            self._scheduler.end(1)
        _COMMANDS[how](self, {})

    def _back_from_prompt(self, command: str) -> str:
        """Go back as a command says; return why that cannot be done."""
        assert self._prompt is not None
        assert self._frame is not None
        self._problem = ""
        self._set_breakpoints(self._prompt.breakpoints)
        self._note_change(self._prompt.has_changed)
        stop = self._stop_news("prompt", self._frame, command)
        self._talk(stop | {"breakpoints": self._prompt.breakpoints})
        return self._problem

    def _say_note(self) -> None:
        """Tell the note about this stop, if there is one."""
        note, self._note = self._note, ""
        if note and self._prompt is not None:
            self._prompt.error(note)
        elif note:
            self._talk({"event": "output", "text": note})

    def _note_change(self, has_changed: bool) -> None:
        if has_changed:
            self._clock.doubt = self._clock.doubt or CHANGED

    def _refuse(self, given: Body) -> None:
        """Tell the prompt why one cannot go back."""
        self._problem = str(given["text"])

    def _talk(self, news: Body) -> None:
        """Tell something, and do what is asked until the program shall go on."""
        while answer := self._consult(json.dumps(news)):
            asked = json.loads(answer)
            try:
                news = {"body": self._do(str(asked["command"]), asked.get("arguments") or {})}
            except KiksError as error:
                news = {"error": str(error)}
            except Exception as error:  # what a value's own class does may fail in any way
                news = {"error": f"{asked.get('command')} must ask for something that is there: {error!r}."}

    def _do(self, command: str, given: Body) -> Body:
        if command in _OF_INSPECTION:
            if self._inspection is None:
                raise KiksError("a program must stand still to be looked at, but it runs. Pause it first.")
            answer: Body = getattr(self._inspection, _OF_INSPECTION[command])(given)
            self._note_change(self._inspection.has_acted)
            return answer
        return _COMMANDS[command](self, given) or {}

    def _configure(self, given: Body) -> None:
        """Take the settings: breakpoints, filters of exceptions, and where the program shall stop next."""
        if "breakpoints" in given:
            self._set_breakpoints(given["breakpoints"])
        self._filters = set(given.get("filters", self._filters))
        self._has_editor, self._note = bool(given.get("has_editor")), str(given.get("note") or "")
        self._stops_at_end = bool(given.get("stops_at_end"))
        self._clock.repeat(given.get("thoughts") or [])
        if target := int(given.get("target") or 0):
            self._target, self._place = target, given.get("place")
            self._mute(NEVER_NS)
        elif "muted_until_ns" in given:
            self._mute(int(given["muted_until_ns"]))
        self._watch()

    def _set_breakpoints(self, given: dict[str, list[Body]]) -> None:
        self._given = given
        for known in self._breakpoints.values():
            known.clear()
        for file, lines in given.items():
            known = self._breakpoints.setdefault(os.path.realpath(file), {})
            known.update({int(each["line"]): Breakpoint(each) for each in lines})

    def _threads(self, _: Body) -> Body:
        known = threading._active  # type: ignore[attr-defined]
        tasks = (self._scheduler.main, *self._scheduler.tasks.values())
        names = {self._number(task): known[task.ident].name for task in tasks if task.ident in known}
        return {"threads": [{"id": number, "name": name} for number, name in sorted(names.items())]}

    def _go_on(self, _: Body) -> None:
        """Do nothing: the debugger lets the program go on."""

    def _step_over(self, _: Body) -> None:
        frame = self._frame
        may_pause = frame is not None and frame.f_code.co_flags & _MAY_PAUSE
        self._step = _StepEnd(self._scheduler.current, self._depth(), frame if may_pause else None)

    def _step_in(self, _: Body) -> None:
        self._step = _StepEnd(self._scheduler.current, _DEPTH_MAX)

    def _step_out(self, _: Body) -> None:
        self._step = _StepEnd(self._scheduler.current, self._depth() - 1)

    def _depth(self) -> int:
        return self._history.depths[-1]

    def _pause(self, _: Body) -> None:
        self._shall_pause = True

    def _exception(self, _: Body) -> Body:
        error = self._raised
        if error is None:
            raise KiksError("a program must stand at an exception to tell of it, but it does not.")
        return {
            "exceptionId": type(error).__name__,
            "description": str(error),
            "breakMode": "always" if "raised" in self._filters else "unhandled",
        }

    def _back(self, given: Body) -> Body:
        """Return the place in the run to which a debugger wants to go back, and where that is.

        The count is 0 if the run must be made again to find it, as a breakpoint has a condition; then it asks again,
        with `is_noted`.
        """
        history, now = self._history, self._history.count + self._is_at_end
        if doubt := self._clock.doubt or ("it has asked for input" if self._clock.has_asked_person else ""):
            raise KiksError(f"a run must be one that can be made again to go back in it, but {doubt}. Start it again.")
        if "time_ns" in given:
            found = min(history.last_at(int(given["time_ns"])), now)
        elif "line" in given:
            file = given.get("file") or history.place(now)[0]
            found = history.last_before(now, 0, self._places(str(file), [int(given["line"])]))
        elif not given.get("is_to_breakpoint"):
            # An exception has come up in the middle of a line: its beginning is before.
            found = history.last_before(now + self._is_inside, self._depth())
        elif given.get("is_noted"):
            found = self._met or 1
        elif all(each.is_plain for lines in self._breakpoints.values() for each in lines.values()):
            places = set[int]().union(*(self._places(file, lines) for file, lines in self._breakpoints.items()))
            found = history.last_before(now, 0, places) or 1
        else:
            return {"count": 0, "thoughts": self._clock.measured_ns}
        if not found:
            raise KiksError("such a line must have run before this one to go back to it, but none has.")
        file, line = history.place(found)
        place = {"count": found, "file": file, "line": line, "time_ns": history.time_ns(found)}
        return {**place, "thoughts": self._clock.measured_ns}

    def _places(self, file: str, lines: Any) -> set[int]:
        file = os.path.realpath(file)
        bases = [base for name, base in self._bases.items() if base and os.path.realpath(name) == file]
        return {base + line for base in bases for line in lines}

    # ---- output ----

    def _mute(self, until_ns: int) -> None:
        """Print nothing up to a time [ns]: what a run prints that is made again has been printed before."""
        self._muted_until_ns = until_ns
        self._unmuted = os.dup(1), os.dup(2)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for stream in (1, 2):
            os.dup2(nowhere, stream)
        os.close(nowhere)

    def _unmute(self) -> None:
        for stream in (sys.stdout, sys.stderr):
            with suppress(Exception):
                stream.flush()
        assert self._unmuted is not None
        for number, saved in zip((1, 2), self._unmuted, strict=True):
            os.dup2(saved, number)
            os.close(saved)
        self._unmuted = None


_OF_INSPECTION = {
    "stackTrace": "stack_trace",
    "scopes": "scopes",
    "variables": "variables",
    "evaluate": "evaluate",
    "setVariable": "set_variable",
    "completions": "completions",
    "source": "source",
}
_COMMANDS: dict[str, Callable[[Debugger, Body], Body | None]] = {
    "configure": Debugger._configure,
    "threads": Debugger._threads,
    "continue": Debugger._go_on,
    "next": Debugger._step_over,
    "stepIn": Debugger._step_in,
    "stepOut": Debugger._step_out,
    "pause": Debugger._pause,
    "refuse": Debugger._refuse,
    "exceptionInfo": Debugger._exception,
    "back": Debugger._back,
}
"""What is done for each request."""


def _stack(frame: FrameType | None) -> list[FrameType]:
    frames = []
    while frame is not None:
        frames.append(frame)
        frame = frame.f_back
    return frames

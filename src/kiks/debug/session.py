"""A session of a debugger: what it asks of the programs of a world, and how it goes back.

To go back, the run is made again, up to a place in it: a number of lines that a program has run
(`kiks.script.history`). The same seed gives the same run, so it stands there as it did.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, InvalidStateError
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Any

from kiks.errors import KiksError
from kiks.ports.messages import Answer, Request
from kiks.ports.participant import ProgramParticipant
from kiks.ports.programs import Programs
from kiks.run import Run
from kiks.sim.judge import Condition
from kiks.sim.read_completion import NEVER_NS

TEXT_MAX = 8 << 20
"""Longest text of a program for its debugger [characters]."""

_GO_ON = ("continue", "next", "stepIn", "stepOut", "refuse")
"""The requests after which a program goes on."""

COMMANDS = """back: to the line before; back 12: to the last time that line 12 ran; rback: to the last breakpoint;
when FORMULA: to the line before it became true, such as contacts == 3, proximity(2) > 500, time_s >= 12.4"""

Body = dict[str, Any]


def back_of(text: str) -> Body | None:
    """Return what a command to go back means, for `DebugSession.back`; None if a text is none.

    Example:
        >>> back_of("back 12"), back_of("when contacts == 3"), back_of("x + 1")
        ({'line': 12}, {'when': 'contacts == 3'}, None)
    """
    word, _, rest = text.strip().partition(" ")
    rest = rest.strip()
    if word == "back" and (not rest or rest.isdigit()):
        return {"line": int(rest)} if rest else {"is_step": True}
    if word == "rback" and not rest:
        return {"is_to_breakpoint": True}
    return {"when": rest} if word == "when" and rest else None


@dataclass
class Stop:
    """Where a program stands.

    Attributes:
        robot: The robot of the program.
        reason: Why: 'breakpoint', 'step', 'pause', 'exception', 'goto', 'entry', 'end'.
        text: More about it.
        thread: The number of its thread.
        count: The place in the run: the number of lines that the program has run.
        file: The file of the line.
        line: Its number.
        time_ns: The program's time [ns].
    """

    robot: int
    reason: str
    text: str
    thread: int
    count: int
    file: str
    line: int
    time_ns: int

    def as_goal(self, thoughts: list[int], then: Callable[[Stop], object], condition: Condition | None = None) -> _Goal:
        """Return it as the goal of a run that is made again, to find something on the way; see `_Goal`."""
        return _Goal(self.robot, self.count, self.time_ns, (self.file, self.line), thoughts, then, condition)


_FIELDS = [each.name for each in fields(Stop)][1:]


@dataclass
class _Goal:
    """Where a run that is made again shall stop.

    Attributes:
        robot: The robot of the program that stops.
        count: The place in its run.
        time_ns: The time there [ns].
        place: The file and the line there.
        thoughts: The thinking times that the program has measured up to now [ns].
        then: Called with the stop when it stands there, in place of the page or editor; None to tell those.
        condition: The formula to watch on the way; None for none.
        note: What pdb says there.
    """

    robot: int
    count: int
    time_ns: int
    place: tuple[str, int]
    thoughts: list[int]
    then: Callable[[Stop], object] | None = None
    condition: Condition | None = None
    note: str = ""


@dataclass
class _Program:
    """A program as its debugger sees it.

    Attributes:
        participant: Its end in the world.
        text: Its present text so far.
        waits: Its request that waits for an answer; None while it runs.
        asked: What it shall do, with where the outcome goes.
        doing: Where the outcome of the present one goes.
        stands: Whether it stands at a line.
    """

    participant: ProgramParticipant
    text: str = ""
    waits: Request | None = None
    asked: deque[tuple[Body, Future[Body]]] = field(default_factory=deque)
    doing: Future[Body] | None = None
    stands: bool = False


def _settle(future: Future[Body], outcome: Body | KiksError) -> None:
    """Tell what has come of a request; a page that waited for it may be closed."""
    with suppress(InvalidStateError):
        if isinstance(outcome, KiksError):
            future.set_exception(outcome)
        else:
            future.set_result(outcome)


class DebugSession:
    """A session of a debugger with the programs of a world.

    Args:
        tell: Called with the name of an event of the protocol and its contents; by the thread that moves the world.
        again: Called when the run shall be made again from its start: the programs ask this session then, too.

    Attributes:
        stop: Where a program stands; None while all run.
        programs: What runs the programs; None before they begin.
        has_editor: Whether an editor or a page hears of stops; without one, pdb asks at the terminal.
        stops_at_entry: Whether each program stops at its first line.
        stops_at_end: Whether each program stops when it has run its last line.
    """

    programs: Programs | None = None

    def __init__(self, tell: Callable[[str, Body], object], again: Callable[[], object]) -> None:
        self._tell, self._again = tell, again
        self.stop: Stop | None = None
        self._breakpoints: dict[str, list[Body]] = {}
        self._filters: list[str] = []
        self._programs: dict[int, _Program] = {}
        self._stops: deque[Stop] = deque()
        self._goal: _Goal | None = None
        self._is_changed = ""
        self.has_editor = self.stops_at_entry = self.stops_at_end = False

    # ---- for editors and pages; from any thread ----

    def set_breakpoints(self, file: str, lines: list[Body]) -> None:
        """Set the breakpoints of a file, in place of those that it had; see `Breakpoint`."""
        self._breakpoints[file] = lines
        self._configure_all()

    def set_filters(self, filters: list[str]) -> None:
        """Choose the exceptions at which programs stop: 'raised', 'uncaught'."""
        self._filters = filters
        self._configure_all()

    def threads(self) -> list[tuple[int, str]]:
        """Return the robots of the programs, and their names."""
        return [(robot, each.participant.name) for robot, each in sorted(self._programs.items())]

    @property
    def is_going_back(self) -> bool:
        """Whether the run is made again up to a place in it."""
        return self._goal is not None

    @property
    def is_changed(self) -> bool:
        """Whether something outside of the run has changed it."""
        return bool(self._is_changed)

    def note_change(self, why: str) -> None:
        """Note that something outside of the run has changed it, so that it cannot be made again.

        Args:
            why: What, as a part of a sentence, such as 'a person has moved something'.
        """
        self._is_changed = self._is_changed or why

    def where(self, time_ns: int) -> Future[Body]:
        """Return the file and the line at which the program that stands was at a time [ns]."""
        return self.ask("back", {"time_ns": time_ns})

    def leave(self) -> None:
        """Let all go on: the editor has left, or the page."""
        self.has_editor, self._breakpoints, self._filters = False, {}, []
        self._configure_all()
        self.go_on()

    def ask(self, command: str, arguments: Body | None = None, robot: int = 0) -> Future[Body]:
        """Ask a program; 0 for the one that stands, or the first.

        Returns:
            What it answers; a KiksError if it refuses.
        """
        future: Future[Body] = Future()
        with self._lock():
            robot = robot or (self.stop.robot if self.stop is not None else min(self._programs, default=0))
            program = self._programs.get(robot)
            if program is None or program.participant.has_left:
                future.set_exception(KiksError("a program must run to be debugged, but it has ended. Start it again."))
            else:
                program.asked.append(({"command": command, "arguments": arguments or {}}, future))
                self._serve(program)
        return future

    def go_on(self, command: str = "continue") -> None:
        """Let the programs go on, up to the end of a step: 'next', 'stepIn', 'stepOut'."""
        with self._lock():
            if self.stop is not None:
                self.ask(command)

    def back(self, **how: Any) -> Future[Body]:
        """Go back in the run; see `Debugger`.

        Args:
            **how: Nothing for one line; `is_to_breakpoint`; `file` and `line`; `time_ns`; `when`, a formula as goals
                have them, which became true last before now.

        Returns:
            Where it goes; the page or editor is told when it stands there.
        """
        done: Future[Body] = Future()
        if (when := how.pop("when", None)) is not None:
            self._back_before(str(when), done)
        else:
            self._ask_back(how, done)
        return done

    # ---- going back ----

    def _ask_back(self, how: Body, done: Future[Body]) -> None:
        """Ask the program for the place, and go there."""

        def go(answered: Future[Body]) -> None:
            try:
                place = answered.result()
                stop, thoughts = self._check_repeatable(), place["thoughts"]
                if place["count"] > 0:
                    at = place["file"], place["line"]
                    self._make_again(_Goal(stop.robot, place["count"], place["time_ns"], at, thoughts))
                else:
                    # On the way, the program notes the last breakpoint that it meets.
                    then = partial(self._ask_back, how | {"is_noted": True}, Future())
                    self._make_again(stop.as_goal(thoughts, lambda _: then()))
                _settle(done, place)
            except KiksError as error:
                _settle(done, error)
            except (KeyError, TypeError):  # a program that is not trusted may answer anything
                _settle(done, KiksError("a program must say where it was, but it said something else."))

        self.ask("back", how).add_done_callback(go)

    def _back_before(self, text: str, done: Future[Body]) -> None:
        """Make the run again to find where a formula became true last, and go to the line before."""

        def watch(answered: Future[Body]) -> None:
            try:
                stop = self._check_repeatable()
                assert self.programs is not None
                condition = Condition(text, stop.robot, self.programs.sim)
                thoughts = answered.result()["thoughts"]
                goal = stop.as_goal(thoughts, lambda _: None, condition)
                goal.then = partial(self._go_before, goal, condition)
                self._make_again(goal)
                _settle(done, {})
            except KiksError as error:
                _settle(done, error)

        self.ask("back", {"time_ns": NEVER_NS}).add_done_callback(watch)

    def _go_before(self, goal: _Goal, condition: Condition, stop: Stop) -> None:
        condition.look()  # the run stands between two looks
        if condition.before_ns is None:
            text = f"{condition.text} has not become true in this run."
            if self.has_editor:
                self._say(text)
                self._show(stop)
            else:
                self._make_again(replace(goal, then=None, condition=None, note=text))
        else:
            self._ask_back({"time_ns": condition.before_ns}, Future())

    def _check_repeatable(self) -> Stop:
        """Return where the program stands, if its run can be made again."""
        if self.stop is None:
            raise KiksError("a program must stand still to go back, but it runs. Pause it first.")
        assert self.programs is not None
        if doubt := self._is_changed or self.programs.doubt:
            raise KiksError(f"a run must be one that can be made again to go back in it, but {doubt}. Start it again.")
        return self.stop

    def _make_again(self, goal: _Goal) -> None:
        self._goal = goal
        self.forget()
        self._again()

    def forget(self) -> None:
        """Let go of the programs of a run that has ended, or ends; what they have yet to answer is refused."""
        programs, self._programs, self.stop = [*self._programs.values()], {}, None
        self._stops.clear()
        for each in programs:
            left = [future for _, future in each.asked] + ([each.doing] if each.doing is not None else [])
            each.doing = None
            for future in left:
                _settle(future, KiksError("a program must run to answer, but its run has ended."))

    # ---- for programs; with the lock of the world ----

    def begin(self, run: Run) -> None:
        """Take the programs of a run, before they start."""
        self.programs = run.programs
        if self._goal is not None and self._goal.condition is not None and run.supervision is not None:
            run.supervision.join("the debugger", self._goal.condition.looks(run.sim))

    def consult(self, participant: ProgramParticipant, request: Request) -> None:
        """Take what a program tells its debugger."""
        # One of the run before, which ends, has nothing to say any more.
        if self.programs is None or participant not in self.programs.handles:
            return
        program = self._programs.get(participant.rank)
        if program is None or program.participant is not participant:  # another one drives the robot now
            program = self._programs[participant.rank] = _Program(participant)
        piece, is_last = request.arguments
        program.text += piece
        program.waits = request
        try:
            if len(program.text) > TEXT_MAX:
                raise ValueError
            if is_last:
                news, program.text = json.loads(program.text), ""
                self._take(program, news)
            else:
                self._answer(program, "")
        except (ValueError, KeyError, TypeError):
            participant.end_because("sent something to the debugger that it does not understand")

    def _take(self, program: _Program, news: Body) -> None:
        robot = program.participant.rank
        if (done := program.doing) is not None:
            program.doing = None
            _settle(done, KiksError(str(news["error"])) if "error" in news else news["body"])
            if program.participant.has_left or self._programs.get(robot) is not program:
                return
        elif news["event"] == "stopped":
            program.stands = True
            stop = Stop(robot, **{name: news[name] for name in _FIELDS})
            if stop.reason == "prompt":
                self._go_back_from_prompt(stop, news["breakpoints"])
            else:
                self._note_stop(stop)
        elif news["event"] == "begun":
            self._answer(program, json.dumps({"command": "configure", "arguments": self._settings(robot)}))
            program.doing = Future()
            return
        elif news["event"] == "output":
            self._say(str(news["text"]))
        elif news["event"] == "missed":
            self._goal = None
            self._say(
                "the run that was made again has ended before it came there: something outside of it has changed."
            )
        self._serve(program)

    def _serve(self, program: _Program) -> None:
        """Let a program that asks do the next thing, or go on."""
        if program.waits is None or program.doing is not None:
            return
        if program.asked:
            request, program.doing = program.asked.popleft()
            if request["command"] in _GO_ON and program.stands:
                program.stands = False
                self.stop = None
                program.doing.add_done_callback(lambda _: self._show_next())
            self._answer(program, json.dumps(request))
        elif not program.stands:
            self._answer(program, "")

    def _answer(self, program: _Program, text: str) -> None:
        request, program.waits = program.waits, None
        assert request is not None
        program.participant.is_consulting = False
        program.participant.reply(Answer(request.ticket, request.at_ns, text))

    def _go_back_from_prompt(self, stop: Stop, breakpoints: dict[str, list[Body]]) -> None:
        self.stop = stop
        if not self.has_editor:
            self._breakpoints = breakpoints

        def refuse(done: Future[Body]) -> None:
            if (error := done.exception()) is not None:
                self.ask("refuse", {"text": str(error)})

        if not (how := back_of(stop.text)):
            self.ask("refuse", {"text": COMMANDS})
        else:
            self.back(**how).add_done_callback(refuse)

    def _note_stop(self, stop: Stop) -> None:
        goal = self._goal
        if goal is not None and stop.robot == goal.robot:
            self._goal = None
            self.stop = stop
            if goal.then is not None:
                goal.then(stop)
            else:
                self._show(stop)
            return
        if goal is not None and stop.time_ns <= goal.time_ns:
            # Another program was there before, when the run was made first.
            self._programs[stop.robot].asked.append(({"command": "continue"}, Future()))
            return
        if stop.reason == "goto":
            stop.reason = "entry"
        self._stops.append(stop)
        self._show_next()

    def _show_next(self) -> None:
        """Tell of the next program that stands."""
        if self.stop is None and self._goal is None and self._stops:
            self._show(self._stops.popleft())

    def _show(self, stop: Stop) -> None:
        self.stop = stop
        self._tell("stopped", vars(stop))

    def _say(self, text: str) -> None:
        self._tell("output", {"category": "console", "output": f"{text}\n"})

    def _settings(self, robot: int) -> Body:
        goal = self._goal
        settings: Body = {
            "breakpoints": self._breakpoints,
            "filters": self._filters,
            "has_editor": self.has_editor,
            "stops_at_end": self.stops_at_end,
        }
        if goal is None:
            return settings | {"target": 1 if self.stops_at_entry else 0}
        if goal.robot == robot:
            # What follows from where it stands is for the session, not for a person.
            tells = self.has_editor or goal.then is not None
            settings |= {"target": goal.count, "thoughts": goal.thoughts, "has_editor": tells, "note": goal.note}
            settings["place"] = goal.place
            return settings
        return settings | {"muted_until_ns": goal.time_ns}

    def _lock(self) -> AbstractContextManager[Any]:
        """Return the lock of the world, in which programs ask."""
        return nullcontext() if self.programs is None else self.programs.sim.lock

    def _configure_all(self) -> None:
        with self._lock():
            for robot in self._programs:
                self.ask("configure", self._settings(robot) | {"target": 0}, robot)

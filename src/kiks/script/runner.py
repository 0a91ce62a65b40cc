"""Runs a whole Python program, unchanged: simulated robots at its serial ports, simulated time for all its threads."""

from __future__ import annotations

import sys
import threading
import traceback
from collections.abc import Callable
from contextlib import AbstractContextManager, closing, nullcontext
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, NoReturn
from weakref import WeakSet

from kiks.clock.program_clock import ProgramClock
from kiks.errors import KiksError
from kiks.ports import environment_marks
from kiks.ports.messages import Start
from kiks.script import (
    clocks,
    cpython,
    event_loops,
    file_calls,
    keyboard,
    locks,
    serial_ports,
    socket_waits,
    unsupported,
)
from kiks.script.chance import ProgramChance
from kiks.script.children import Children
from kiks.script.file_system import FileSystem
from kiks.script.file_waits import Files
from kiks.script.here import here
from kiks.script.libraries.adapters import adapted
from kiks.script.libraries.host import Host
from kiks.script.main_module import main_module
from kiks.script.patching import Replacements, replaced
from kiks.script.refusals import is_of_program
from kiks.script.robot_sockets import RobotSockets
from kiks.script.shared_line import SharedLine
from kiks.script.signals import Signals
from kiks.script.thread_scheduler import EndedError, Scheduler
from kiks.script.watchdog import watched
from kiks.sim.port import Line, VirtualPort
from kiks.sim.read_completion import NEVER_NS

if TYPE_CHECKING:
    from kiks.script.debugger import Debugger
    from kiks.sim.simulation import Simulation

Limited = Callable[[Callable[[int, str], NoReturn]], AbstractContextManager[object]]
"""Limits the time of a program: it gets a function that ends the program with an exit code and a message."""

_NOT_OF_THE_PROGRAM = ("kiks", "runpy")
"""Modules whose frames an error of the program does not show."""


def run_here(
    sim: Simulation,
    program: Path,
    arguments: list[str],
    robots_by_name: dict[str, int],
    *,
    module: str = "",
    limited: Limited = nullcontext,
) -> int:
    """Run a program in this process to its end; return its exit code.

    Args:
        sim: The simulation behind its ports.
        program: Its file, or a folder or an archive with a `__main__.py`.
        arguments: Its arguments in `sys.argv`.
        robots_by_name: Robots by port name.
        module: Name of a module to run in place of the file, as `python -m` does.
        limited: Limits the time of the program.
    """
    from kiks.ports.port_names import PortNames
    from kiks.ports.program_process import chance_seed
    from kiks.ports.url import find_sim_port
    from kiks.sim.local_line import LocalLine

    names = PortNames(sim, robots_by_name)

    def find(name: str) -> int | VirtualPort:
        if not name.startswith("kiks:"):
            return names.robot(name)
        port = find_sim_port(name)
        return port.robot if port.sim is sim else port

    start = Start(
        is_late=False,
        end_ns=NEVER_NS,
        thinking=sim.thinking,
        offered=names.offered(),
        addresses=names.addresses(),
        seed=chance_seed(sim.seed, 1),
        module=module,
        program=str(program),
        arguments=arguments,
    )
    return ProgramRun(start, lambda robot: LocalLine(sim.loop, sim.index_of(robot) + 1), find, sim.program).run(limited)


class ProgramRun:
    """A program with simulated ports and simulated time.

    Args:
        start: The program, and what it finds.
        line_of: Returns the line of a robot, from 1; that of robot 1 tells the time.
        find: Returns the robot behind a port's name, or a port of another world.
        policy: The cost of the program's thinking and polling.
        consult: See `Debugger`; None if no debugger follows the program.
    """

    def __init__(
        self,
        start: Start,
        line_of: Callable[[int], Line],
        find: Callable[[str], int | VirtualPort],
        policy: ProgramClock,
        consult: Callable[[str], str] | None = None,
    ) -> None:
        self._start, self._line_of, self._find, self._policy = start, line_of, find, policy
        world = line_of(1)
        self._scheduler = scheduler = Scheduler(world, policy)
        self._lines: dict[int, SharedLine] = {}
        self._clock = VirtualPort(SharedLine(world, 1, scheduler), policy)
        self._chance, self._system = ProgramChance(scheduler, start.seed), FileSystem(scheduler, start.offered)
        self._files = Files(scheduler)
        self._sockets = RobotSockets(scheduler, self._files, self._open_port, start.addresses)
        self._signals, self._children = Signals(scheduler), Children(scheduler, self._files)
        self._at_exit = _AtExit()
        self._opened: WeakSet[Any] = WeakSet()
        self._debugger: Debugger | None = None
        if consult is not None:
            from kiks.script.debugger import Debugger  # here, as other programs shall start fast

            self._debugger = Debugger(scheduler, consult, policy, start.program)

    def run(self, limited: Limited = nullcontext) -> int:
        """Run it to its end; return its exit code.

        Args:
            limited: Limits the time of the program.
        """
        scheduler, start = self._scheduler, self._start
        # Processes that the program starts find its environment, too.
        environment_marks.hide()
        hook_before = sys.excepthook
        here.ask, here.own = lambda robot: self._line_of(robot).look(), lambda: next(iter(self._lines), 1)
        sys.excepthook = lambda _kind, error, _trace: _print_program_trace(error)
        try:
            with (
                cpython.whole_recursion() as limits,
                main_module(Path(start.program), start.arguments, start.module) as run_main,
                watched(scheduler),
                limited(scheduler.end),
                self._signals.taken(),
                self._chance.taken(),
                replaced((*self._replacements(), limits), scheduler),
                serial_ports.left_open(self._opened),
                closing(self._children),
                adapted(Host(scheduler, self._clock, self._chance, self._files, start.addresses)),
                unsupported.watched(scheduler, self._system),
            ):
                return scheduler.run(lambda: self._run_to_end(run_main))
        except EndedError as end:
            if end.message:
                _complain(f"kiks: {end.message}")
            if self._signals.were_ended:
                raise KeyboardInterrupt from None
            return end.code
        finally:
            # They never go on, and Python would wait for them at its end.
            cpython.forget_threads(scheduler.tasks)
            sys.excepthook, here.ask = hook_before, None

    def _run_to_end(self, run_main: Callable[[], None]) -> int:
        with nullcontext() if self._debugger is None else self._debugger.following():
            return self._run_threads(run_main)

    def _run_threads(self, run_main: Callable[[], None]) -> int:
        code = _run_main_thread(run_main, self._note_uncaught)
        _wait_for_threads(self._scheduler)
        self._at_exit.run()
        self._children.check()
        return code

    def _open_port(self, name: str) -> VirtualPort:
        found = self._find(name)
        if isinstance(found, VirtualPort):
            return found
        if found not in self._lines:
            self._lines[found] = SharedLine(self._line_of(found), found, self._scheduler)
        return VirtualPort(self._lines[found], self._policy)

    def _end_at_once(self, code: int) -> None:
        sys.stdout.flush()
        self._scheduler.end(code)

    def _replacements(self) -> tuple[Replacements, ...]:
        """Return what stands in for names of Python's modules and of libraries."""
        scheduler, files = self._scheduler, self._files
        return (
            cpython.thread_starts(scheduler),
            cpython.thread_locals(),
            locks.replacements(scheduler),
            clocks.replacements(scheduler, self._clock),
            self._system.replacements(),
            file_calls.replacements(scheduler, files, self._system),
            socket_waits.replacements(scheduler, files, self._sockets),
            self._chance.replacements(),
            serial_ports.replacements(self._open_port, files, self._start.offered, self._opened),
            event_loops.replacements(scheduler),
            self._signals.replacements(),
            self._children.replacements(),
            unsupported.replacements(scheduler),
            self._at_exit.replacements(),
            keyboard.replacements(scheduler),
            {"posix": {"_exit": self._end_at_once}},
            {"threading": dict.fromkeys(("excepthook", "__excepthook__"), self._print_thread_trace)},
        )

    def _note_uncaught(self, error: BaseException) -> None:
        """Let a debugger look at an exception that ends a thread."""
        if self._debugger is not None:
            self._debugger.note_uncaught(error)

    def _print_thread_trace(self, what: Any, /) -> None:
        """Print the exception that has ended a thread; see `threading.excepthook`."""
        if what.exc_type is not SystemExit:
            self._note_uncaught(what.exc_value)
            print(f"Exception in thread {what.thread.name}:", file=sys.stderr)
            _print_program_trace(what.exc_value)


class _AtExit:
    """The exit handlers of the program, such as one that stops the robot; they run while the robot still exists."""

    def __init__(self) -> None:
        self._calls: list[tuple[Callable[..., object], tuple[Any, ...], dict[str, Any]]] = []

    def replacements(self) -> dict[str, dict[str, Any]]:
        """Return the replacements for names of `atexit`."""
        return {"atexit": {"register": self._register, "unregister": self._unregister}}

    def run(self) -> None:
        """Run the handlers, the last one first."""
        while self._calls:
            call, args, kwargs = self._calls.pop()
            try:
                call(*args, **kwargs)
            except (Exception, SystemExit) as error:
                print(f"Exception ignored in atexit callback: {call!r}", file=sys.stderr)
                _print_program_trace(error)

    def _register(self, call: Callable[..., object], /, *args: Any, **kwargs: Any) -> Callable[..., object]:
        self._calls.append((call, args, kwargs))
        return call

    def _unregister(self, call: Callable[..., object], /) -> None:
        self._calls = [each for each in self._calls if each[0] != call]


def _run_main_thread(start: Callable[[], None], note: Callable[[BaseException], None]) -> int:
    """Run the main thread; return the exit code.

    Args:
        start: What it runs.
        note: Called with an exception that ends it.
    """
    try:
        start()
    except SystemExit as leaving:
        if leaving.code is None or isinstance(leaving.code, int):
            return leaving.code or 0
        return _complain(str(leaving.code))
    except KiksError as error:
        return _complain(f"kiks: {error}")
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        note(error)
        # pyserial's error of a port stands for one of KiKS, whose line says enough with the place in the program.
        if isinstance(error.__context__, KiksError) and error.__suppress_context__:
            return _complain(f"kiks: {_place_of(error)}{error}")
        sys.excepthook(type(error), error, error.__traceback__)
        return 1
    return 0


def _wait_for_threads(scheduler: Scheduler) -> None:
    """Wait for the threads that still run, as Python does when its main thread ends."""
    for call in reversed(threading._threading_atexits):  # type: ignore[attr-defined]
        call()
    # Each may start others.
    while left := [each for each in threading.enumerate() if each.ident in scheduler.tasks and not each.daemon]:
        for thread in left:
            thread.join()


def _complain(text: str) -> int:
    print(text, file=sys.stderr)
    return 1


def _print_program_trace(error: BaseException) -> None:
    """Print the program's error like Python, without the frames of KiKS and runpy."""
    left, seen = [error], {id(error)}
    while left:
        each = left.pop()
        each.__traceback__ = _program_part(each.__traceback__)
        others = [each.__cause__, each.__context__, *getattr(each, "exceptions", ())]
        left += [other for other in others if other is not None and id(other) not in seen]
        seen.update(map(id, left))
    print("".join(traceback.format_exception(error)), end="", file=sys.stderr)


def _place_of(error: BaseException) -> str:
    """Return the last line of the program itself that led to an error."""
    frames = traceback.extract_tb(error.__traceback__)
    place = next((each for each in reversed(frames) if is_of_program(each.filename)), None)
    return f"{Path(place.filename).name}, line {place.lineno}: " if place else ""


def _program_part(trace: TracebackType | None) -> TracebackType | None:
    """Return a traceback without the frames of modules that are not the program's."""
    frames: list[TracebackType] = []
    while trace is not None:
        if str(trace.tb_frame.f_globals.get("__name__")).partition(".")[0] not in _NOT_OF_THE_PROGRAM:
            frames.append(trace)
        trace = trace.tb_next
    part: TracebackType | None = None
    for frame in reversed(frames):
        part = TracebackType(part, frame.tb_frame, frame.tb_lasti, frame.tb_lineno)
    return part

"""The insides of CPython: what a program changes there comes back, and is safe meanwhile."""

import asyncio
import ctypes
import gc
import pickle
import queue
import re
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from io import FileIO
from pathlib import Path
from typing import Any

import pytest
from tests import forked
from tests.at_length import cases
from tests.cli.test_cli import KIKS
from tests.script.conftest import Run
from tests.served import GUARD_S, PROGRAMS, called

from kiks.errors import KiksError
from kiks.script import cpython, patching
from kiks.script.cpython import Undo, change_class, change_function, check_interpreter, unchanged
from kiks.script.thread_scheduler import Scheduler

WORD = ctypes.sizeof(ctypes.c_void_p)
FUNCTION_WORDS = range(2, 7)
"""PyCFunctionObject behind its head: definition, owner, module, weak references, body."""
TYPE_WORDS = range(3, 40)
"""PyTypeObject from its name to its constructor, with all bodies of operators."""
FLAGS_WORD = 21
HAS_VERSION = 1 << 19
"""Py_TPFLAGS_VALID_VERSION_TAG (object.h): the cache of methods sets it."""


def words(thing: object, places: range) -> list[int | None]:
    """Return words of an object in memory."""
    found = [ctypes.c_void_p.from_address(id(thing) + WORD * place).value for place in places]
    if isinstance(thing, type):
        found[FLAGS_WORD - places[0]] = (found[FLAGS_WORD - places[0]] or 0) & ~HAS_VERSION
    return found


class Changes:
    """All that the replacements of a run change, as it is before and after."""

    def __init__(self) -> None:
        self.functions: dict[str, Any] = {}
        self.owners: dict[str, Any] = {}
        self.missing: list[str] = []

    def note(self, replacements: list[tuple[str, Mapping[str, Any]]]) -> None:
        for path, names in replacements:
            owner = patching._find(path)
            if owner is None:
                self.missing.append(path)
                continue
            self.owners[path] = owner
            for name in names:
                value = vars(owner).get(name)
                if isinstance(value, patching.BuiltinFunctionType):
                    self.functions[f"{path}.{name}"] = value
                elif not hasattr(owner, name):
                    self.missing.append(f"{path}.{name}")

    def state(self) -> dict[str, Any]:
        """Return the structures of all functions, and the structures and names of all classes and modules."""
        state: dict[str, Any] = {name: words(each, FUNCTION_WORDS) for name, each in self.functions.items()}
        for path, owner in self.owners.items():
            state[path] = {
                name: id(value)
                for name, value in vars(owner).items()
                if not name.startswith("_abc_") and name not in ("argv", "excepthook")
            }
            if isinstance(owner, type):
                state[f"{path} in memory"] = words(owner, TYPE_WORDS)
        return state


@pytest.fixture
def changes(monkeypatch: pytest.MonkeyPatch) -> Changes:
    noted, change = Changes(), patching.change

    def note(replacements: Iterable[tuple[str, Mapping[str, Any]]], scheduler: Scheduler, undo: Undo) -> None:
        noted.note(listed := list(replacements))
        noted.before = noted.state()
        change(listed, scheduler, undo)

    monkeypatch.setattr(patching, "change", note)
    return noted


THREADS = """
import asyncio, threading, time
asyncio.run(asyncio.sleep(1))
threading.Thread(target=time.sleep, args=(9,), daemon=True).start()
1 / 0
"""


def test_all_that_a_program_changes_comes_back(changes: Changes, run: Run) -> None:
    def surroundings() -> list[object]:
        main = sorted(vars(sys.modules["__main__"]))
        return [sys.argv, sys.path[:], signal.getsignal(signal.SIGINT), main, threading.enumerate()]

    before = surroundings()
    # The first run imports what it needs.
    for _ in range(2):
        assert run(THREADS, "argument").code == 1
    assert len(changes.functions) > 40
    assert changes.state() == changes.before
    assert surroundings() == before


def test_nothing_of_python_is_missing(changes: Changes, run: Run) -> None:
    run("")
    missing = {each for each in changes.missing if not each.startswith(("serial.", "kiks."))}
    # What has not been imported.
    assert missing <= {"multiprocessing.process.BaseProcess", "_uuid"}


# ---- functions ----


@contextmanager
def changed(function: Any, body: Callable[..., Any]) -> Iterator[None]:
    undo = Undo()
    change_function(function, body, undo)
    try:
        yield
    finally:
        undo()


def test_a_function_stays_the_same_object_with_another_body() -> None:
    real, looked, sleep = unchanged(time.time), vars(time).copy(), time.sleep
    with changed(time.time, lambda *args, **kwargs: (args, kwargs)), changed(time.sleep, lambda seconds: seconds):
        assert vars(time) == looked
        assert time.time(1, a=2) == ((1,), {"a": 2})  # type: ignore[call-arg, comparison-overlap]
        assert [sleep(each) for each in (1, 2)] == [1, 2]
        assert list(map(sleep, [3])) == [3]
        assert isinstance(real(), float)
        assert (time.time.__name__, time.time.__module__, time.time.__doc__) == ("time", "time", real.__doc__)
        assert repr(time.time) == "<built-in function time>"
        assert type(time.time) is type(real)
        assert pickle.loads(pickle.dumps(time.time)) is time.time
    assert isinstance(time.time(), float)
    assert pickle.loads(pickle.dumps(time.time)) is time.time


def test_errors_pass_through_a_changed_function() -> None:
    def fail() -> None:
        raise LookupError("mine")

    with changed(time.time, fail):
        with pytest.raises(LookupError, match="mine"):
            time.time()
        with pytest.raises(TypeError, match="fail"):
            time.time(1)  # type: ignore[call-arg]


def test_changes_nest_and_a_call_may_outlive_its_change() -> None:
    with changed(time.time, lambda: 1):
        first = unchanged(time.time)
        with changed(time.time, lambda: 2):
            assert (first(), time.time()) == (1, 2)
        assert time.time() == 1
    undo = Undo()

    def body() -> str:
        undo()
        gc.collect()
        return "done"

    change_function(time.monotonic, body, undo)
    assert time.monotonic() == "done"  # type: ignore[comparison-overlap]
    assert isinstance(time.monotonic(), float)


def test_garbage_is_collected_while_functions_change() -> None:
    """A wrong count of references ends the process, or grows from change to change."""
    owner = sys.getrefcount(time)
    threshold = gc.get_threshold()
    gc.set_threshold(1, 1, 1)
    gc.freeze()  # what else is in this process need not be looked at
    try:
        for number in range(200):
            with changed(time.time, lambda number=number: number), changed(time.ctime, lambda: [time.time()]):
                assert time.ctime() == [number]
                gc.collect(number % 3)
            assert time.time() > 1
    finally:
        gc.unfreeze()
        gc.set_threshold(*threshold)
    assert sys.getrefcount(time) == owner
    # All of them shared one pair.
    assert len(cpython._spare[id(time.ctime)]) == 1


def test_what_a_body_holds_goes_with_the_change() -> None:
    class Held:
        pass

    def held() -> int:
        gc.collect()
        return sum(type(each) is Held for each in gc.get_objects())

    with changed(time.time, partial(print, Held())):
        assert held() == 1
    assert held() == 0


def test_other_threads_get_the_original(run: Run) -> None:
    found: list[float] = []
    begin = threading.Event()

    def work() -> None:
        while not begin.is_set():
            with threading.Lock():
                found.append(time.time())

    thread = threading.Thread(target=work)
    before = time.time()
    thread.start()
    try:
        assert run("import time\nfor _ in range(3000): time.time()\n").code == 0
    finally:
        begin.set()
        thread.join(GUARD_S)
    assert found == sorted(found)
    assert before <= found[0] <= found[-1] <= time.time()


# ---- classes ----


class Mine:
    there = 1


IN_MEMORY_ALONE = (dict, FileIO)
"""Classes whose operators stay."""
CHANGED = [
    (owner, name)
    for owner in (Mine, type(threading.Lock()), type(queue.SimpleQueue()), asyncio.Future, *IN_MEMORY_ALONE)
    for name in ("there", "acquire", "read", *(() if owner in IN_MEMORY_ALONE else ("__hash__", "__len__", "__exit__")))
]


@pytest.mark.parametrize(("owner", "name"), CHANGED)
def test_a_class_comes_back(owner: type, name: str) -> None:
    before, structure = dict(vars(owner)), words(owner, TYPE_WORDS)
    undo = Undo()
    change_class(owner, name, lambda _: 7, undo)
    assert vars(owner)[name](None) == 7
    undo()
    assert (dict(vars(owner)), words(owner, TYPE_WORDS)) == (before, structure)


# ---- objects that outlive a run, and garbage ----

LEFT = """
import gc, serial
class Port(serial.Serial):
    def __del__(self):
        self.close()
gc.set_threshold(1, 1, 1)
for url in ("/dev/ttyUSB0", "socket://127.0.0.1:1", "rfc2217://127.0.0.1:1"):
    port = serial.serial_for_url(url, timeout=1)
    port.me = port
    port.write(b"H\\n")
    print(port.readline())
port = Port("/dev/ttyUSB3")
port.me = port
"""


@pytest.mark.parametrize("options", cases([((),), (("-X", "dev"),)]))
def test_what_a_program_leaves_is_collected_in_silence(options: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "left.py").write_text(LEFT)
    words = [sys.executable, *options, "-W", "ignore", *KIKS[1:], "run", "--robots", "4", "left.py"]
    done = called(*words, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "b'h,0,0\\r\\n'\n" * 3)
    assert [line for line in done.stderr.splitlines() if not line.startswith("kiks: ")] == []


def test_wrong_arguments_get_pythons_own_words() -> None:
    program = str(PROGRAMS / "wrong_arguments.py")
    by_python, by_kiks = called(sys.executable, "-W", "ignore", program), forked.run("run", program)
    assert by_python.returncode == by_kiks.returncode == 0
    assert by_kiks.stdout.splitlines() == by_python.stdout.splitlines()


# ---- interpreters ----


@pytest.mark.parametrize(
    ("owner", "name", "value", "lacks"),
    [
        (sys, "version_info", (3, 99, 0), "whose insides are not known"),
        (sys.implementation, "name", "pypy", "whose insides are not known"),
        (sys, "abiflags", "t", "built without its lock of the interpreter"),
        (cpython, "_FLAGS_OFFSET", 0, "whose structures are not those of its version"),
    ],
)
def test_an_interpreter_that_is_not_known_gets_one_line(owner, name, value, lacks, monkeypatch):
    check_interpreter()
    monkeypatch.setattr(owner, name, value)
    with pytest.raises(KiksError) as caught:
        check_interpreter()
    assert re.fullmatch(
        rf"a program in simulated time must run under CPython 3\.11 to 3\.\d+, but this is \w+ [\w.+]+, {lacks}\. "
        r"Install KiKS under one of these, or run the program on kiks serve\.",
        str(caught.value),
    )


def test_each_name_that_is_needed_is_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    owners = list(cpython._private_names())
    for number, (owner, names) in enumerate(owners):
        for name in names:
            assert hasattr(owner, name)
            lacking = [*owners[:number], (object(), (f"{name}_of_another_version",)), *owners[number + 1 :]]
            monkeypatch.setattr(cpython, "_private_names", lambda lacking=lacking: lacking)
            with pytest.raises(KiksError, match=f"where object has no {name}_of_another_version"):
                check_interpreter()


def test_commands_end_with_the_line(tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text("")
    code = (
        "import runpy, sys, kiks.__main__\ndel runpy._run_module_as_main\n"
        "sys.argv = ['kiks', 'run', 'program.py']\nkiks.__main__.main()\n"
    )
    done = forked.run(code=code, cwd=tmp_path)
    assert done.returncode == 1
    assert re.fullmatch(r"kiks: a program in simulated time must run under .* where runpy has no .*\n", done.stderr)

"""Ctrl-C always works: wherever it comes while a command loads, and when a callback drops it later."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from tests.at_length import cases
from tests.guard import GUARD_S

from kiks import ending

ROOT = Path(__file__).parents[1]
WANDER = str(ROOT / "tests" / "programs" / "wander.py")

# Runs a command and sends a signal when a module begins to be imported, or when LLVM calls back.
AT_A_PLACE = """
import signal, sys
place, number = sys.argv[1], int(sys.argv[2])
sys.argv = ["kiks", *sys.argv[3:]]

def hook(event, args):
    if event == "import" and args[0] == place:
        signal.raise_signal(number)
    if event == "import" and args[0] == "kiks.engine.compiling" and place == "callback":
        from llvmlite.binding.executionengine import ExecutionEngine
        real = ExecutionEngine._find_module_ptr
        def find(*args):
            ExecutionEngine._find_module_ptr = real
            signal.raise_signal(number)
            return real(*args)
        ExecutionEngine._find_module_ptr = find

sys.addaudithook(hook)
from kiks.__main__ import main
main()
"""

COMMANDS = {
    "run": ("run", WANDER),
    "serve": ("serve", "--no-pty", "--tcp", "0"),
    "demo": ("demo", "avoid", "--seconds", "86400", "--export", os.devnull + ".png"),
    "desk": ("desk", "--no-browser", "--port", "0"),
    "evolve": ("evolve", "avoid", "--out", "OUT"),
    "warmup": ("warmup",),
}
PLACES = ["typer", "kiks.cli.serve", "numpy", "numba", "llvmlite.binding", "kiks.engine.step", "callback"]


def python(script: str, *words: str) -> tuple[int, str, str]:
    """Return exit code, output and error output of a program."""
    command = [sys.executable, "-c", script, *words]
    pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    done = subprocess.run(command, text=True, timeout=GUARD_S, check=False, **pipes)
    return done.returncode, done.stdout, done.stderr


# In `make test` each place interrupts one command.
PAIRS = [(command, place) for command in COMMANDS for place in PLACES]
PAIRS.sort(key=lambda pair: pair[0] != ("run", "serve")[PLACES.index(pair[1]) % 2])


@pytest.mark.slow
@pytest.mark.parametrize(("command", "place"), cases(PAIRS, len(PLACES)))
def test_a_command_ends_wherever_it_is_interrupted_while_it_loads(command: str, place: str, tmp_path: Path) -> None:
    words = [str(tmp_path / "out") if word == "OUT" else word for word in COMMANDS[command]]
    ending = (signal.SIGINT, signal.SIGTERM)[(PLACES.index(place) + len(command)) % 2]
    code, _, errors = python(AT_A_PLACE, place, str(int(ending)), *words)
    *before, last = errors.splitlines()
    assert (code, last) == (130, "kiks: stopped.")
    assert all(line.removeprefix("kiks: ").startswith("Compiling ") for line in before)


ENDED = """
    while True:
        signal.pause()
except KeyboardInterrupt:
    print("ended", signal.getsignal(signal.SIGINT) is signal.SIG_IGN)
"""

IN_A_CALLBACK = """
import ctypes, signal
import kiks
from kiks.engine import compiling

def back() -> None:
    print("dropped", flush=True)
    signal.raise_signal(signal.SIGINT)
    sum(range(10))

signal.signal(signal.SIGINT, signal.default_int_handler)
call = ctypes.CFUNCTYPE(None)(back)
try:
    call()
"""

IN_THE_HOOK = """
import signal, sys
from kiks.ending import send_again_what_is_dropped

class Broken:
    def __del__(self) -> None:
        raise ValueError("mine")

def show(dropped) -> None:
    print("shown", flush=True)
    signal.raise_signal(signal.SIGINT)

sys.unraisablehook = show
signal.signal(signal.SIGINT, signal.default_int_handler)
send_again_what_is_dropped()
try:
    Broken()
"""

IN_A_DESTRUCTOR = """
import signal
from kiks.ending import end_as_with_ctrl_c, send_again_what_is_dropped

class Dropping:
    def __del__(self) -> None:
        raise KeyboardInterrupt

class Broken:
    def __del__(self) -> None:
        raise ValueError("mine")

signal.signal(signal.SIGINT, signal.SIG_IGN)
end_as_with_ctrl_c()
send_again_what_is_dropped()
Broken()
try:
    Dropping()
"""

IGNORED = """
import signal
from kiks.ending import end_at_once

signal.signal(signal.SIGHUP, signal.SIG_IGN)
end_at_once()
signal.raise_signal(signal.SIGHUP)
print("here", flush=True)
signal.raise_signal(signal.SIGTERM)
"""

HELPER_IS_STUCK = """
import threading
import kiks.cli

def command():
    threading.Thread(target=threading.Event().wait).start()
    print("summary")
    raise SystemExit(130)

kiks.cli.app = command
kiks.cli.main()
"""


@pytest.mark.parametrize(
    ("script", "expected"),
    [
        pytest.param(
            IN_A_CALLBACK + ENDED, (0, "dropped\nended False\n", ""), id="what a callback drops is sent again"
        ),
        pytest.param(
            IN_THE_HOOK + ENDED, (0, "shown\nended False\n", ""), id="so is what comes while another error is shown"
        ),
        pytest.param(IGNORED, (130, "here\n", "kiks: stopped.\n"), id="what is ignored stays ignored"),
        pytest.param(HELPER_IS_STUCK, (130, "summary\n", ""), id="an interrupted command waits for no thread"),
    ],
)
def test_signals_are_heard(script: str, expected: tuple[int, str, str]) -> None:
    assert python(script) == expected


def test_what_a_destructor_drops_is_sent_again_and_other_errors_are_shown_as_ever() -> None:
    code, out, errors = python(IN_A_DESTRUCTOR + ENDED)
    assert (code, out, errors.count("Traceback")) == (0, "ended True\n", 1)
    assert "ValueError: mine" in errors


# Code in C that hears no signal. Some lets other threads run, as the kernels of KiKS do, and some does not.
NEVER_RETURNS = """
import sys
from kiks.ending import end_as_with_ctrl_c, end_at_once, ended_after
end_at_once()
import ctypes, itertools

lock = ctypes.create_string_buffer(100)
ctypes.CDLL(None).pthread_mutex_lock(lock)
call, argument = {
    "waits": (ctypes.CDLL(None).pthread_mutex_lock, lock),
    "waits with the lock of Python": (ctypes.PyDLL(None).pthread_mutex_lock, lock),
    "computes": (sum, itertools.repeat(0)),
}[sys.argv[2]]
end_as_with_ctrl_c()
with ended_after(float(sys.argv[1]) or None, lambda: print("told", flush=True)):
    # All in C, so that no signal is heard in between.
    sum(itertools.chain(map(sys.stdout.buffer.raw.write, [b"ready\\n"]), map(call, [argument])))
"""

STUCK = "stopped in the middle of code that did not return, such as a controller without an end: there is no summary."


def never_returning(limit_s: float, kind: str, ending: signal.Signals | None = None) -> tuple[int, str, str]:
    """Run code that never returns, and send a signal; return the exit code, what it has said, and its errors."""
    words = [sys.executable, "-c", NEVER_RETURNS, str(limit_s), kind]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            said = process.stdout.readline()
            if ending is not None:
                process.send_signal(ending)
            out, errors = process.communicate(timeout=GUARD_S)
        finally:
            process.kill()
    return process.returncode, said + out, errors


@pytest.mark.parametrize(
    ("kind", "ending"),
    [
        ("waits", signal.SIGINT),
        ("waits", signal.SIGHUP),
        ("waits with the lock of Python", signal.SIGTERM),
        ("computes", signal.SIGINT),
    ],
)
def test_code_that_never_returns_ends_by_one_signal_that_nobody_repeats(kind: str, ending: signal.Signals) -> None:
    assert never_returning(0, kind, ending) == (-signal.SIGKILL, "ready\n", f"kiks: {STUCK}\n")


def test_code_that_never_returns_ends_when_its_real_time_is_over() -> None:
    line = f"kiks: stopped after 0.2 s of real time, in the middle of {STUCK.partition('of ')[2]}\n"
    assert never_returning(0.2, "waits") == (124, "ready\n", line)


HEARS = """
import signal, sys, time
from kiks.ending import end_as_with_ctrl_c, end_at_once
end_at_once()
end_as_with_ctrl_c()
for _ in range(3):
    try:
        print("ready", flush=True)
        while True:
            time.sleep(100)
    except KeyboardInterrupt:
        pass
print("ended")
"""


def test_who_hears_each_signal_may_have_any_number_of_them() -> None:
    with subprocess.Popen([sys.executable, "-c", HEARS], stdout=subprocess.PIPE, text=True) as process:
        for number in (signal.SIGINT, signal.SIGINT, signal.SIGTERM):
            assert process.stdout.readline() == "ready\n"
            process.send_signal(number)
        assert process.communicate(timeout=GUARD_S)[0] == "ended\n"
    assert process.returncode == 0


NOTES = """
import os, signal, sys
from kiks.ending import end_at_once
end_at_once()
# Not `print`, in the middle of which the signal may come.
signal.signal(signal.SIGTERM, lambda number, frame: os.write(1, b"noted\\n"))

print("ready", flush=True)
print(sys.stdin.read())
"""


def test_who_notes_a_signal_and_waits_on_has_heard_it() -> None:
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", NOTES], text=True, **pipes) as process:
        assert process.stdout.readline() == "ready\n"
        for _ in range(3):
            process.terminate()
            assert process.stdout.readline() == "noted\n"
        assert process.communicate("ended", timeout=GUARD_S)[0] == "ended\n"
    assert process.returncode == 0


def test_the_wait_for_a_processor_is_no_reason_to_kill(monkeypatch: pytest.MonkeyPatch) -> None:
    answers, answerer = os.pipe()
    waits_s = iter((5.0, 5.0 + 2 * GUARD_S))

    def waited_s(_process: int) -> float:
        waited = next(waits_s)
        if waited > 5:
            os.write(answerer, b"!")
        return waited

    monkeypatch.setattr(ending, "UNHEARD_S", 0.0)
    monkeypatch.setattr(ending, "_waited_s", waited_s)
    assert ending._is_heard(os.getpid(), answers)
    monkeypatch.setattr(ending, "_waited_s", lambda _process: 5.0)
    assert not ending._is_heard(os.getpid(), answers)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells it")
def test_the_time_that_a_process_waits_for_a_processor_is_known() -> None:
    assert ending._waited_s(os.getpid()) > 0
    assert ending._waited_s(-1) == 0

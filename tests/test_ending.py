"""Ctrl-C always works: wherever it comes while a command loads, and when a callback drops it later."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from tests.at_length import cases
from tests.guard import GUARD_S

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
    "demo": ("demo", "--seconds", "86400", "--picture", os.devnull + ".png"),
    "desk": ("desk", "--no-browser", "--port", "0"),
    "evolve": ("evolve", "avoid", "--out", "OUT"),
    "warmup": ("warmup",),
}
PLACES = ["typer", "kiks.cli.serve", "numpy", "numba", "llvmlite.binding", "kiks.engine.step", "callback"]


def python(script: str, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", script, *words],
        capture_output=True,
        text=True,
        timeout=GUARD_S,
        check=False,
        stdin=subprocess.DEVNULL,
    )


@pytest.mark.slow
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("command", cases(COMMANDS, 2))
def test_a_command_ends_wherever_it_is_interrupted_while_it_loads(command: str, place: str, tmp_path: Path) -> None:
    words = [str(tmp_path / "out") if word == "OUT" else word for word in COMMANDS[command]]
    ending = (signal.SIGINT, signal.SIGTERM)[(PLACES.index(place) + len(command)) % 2]
    result = python(AT_A_PLACE, place, str(int(ending)), *words)
    *before, last = result.stderr.splitlines()
    assert (result.returncode, last) == (130, "kiks: stopped.")
    assert all(line.startswith("Compiling the ") for line in before)


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
    while True:
        signal.pause()
except KeyboardInterrupt:
    print("ended")
"""


def test_what_a_callback_drops_is_sent_again() -> None:
    result = python(IN_A_CALLBACK)
    assert (result.returncode, result.stdout, result.stderr) == (0, "dropped\nended\n", "")


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
    while True:
        signal.pause()
except KeyboardInterrupt:
    print("ended")
"""


def test_what_comes_while_another_error_is_shown_is_sent_again() -> None:
    result = python(IN_THE_HOOK)
    assert (result.returncode, result.stdout, result.stderr) == (0, "shown\nended\n", "")


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
    while True:
        signal.pause()
except KeyboardInterrupt:
    print("ended", signal.getsignal(signal.SIGINT) is signal.SIG_IGN)
"""


def test_what_a_destructor_drops_is_sent_again_and_other_errors_are_shown_as_ever() -> None:
    result = python(IN_A_DESTRUCTOR)
    assert (result.returncode, result.stdout) == (0, "ended True\n")
    assert result.stderr.count("Traceback") == 1
    assert "ValueError: mine" in result.stderr


def test_what_is_ignored_stays_ignored() -> None:
    script = (
        "import signal\nfrom kiks.ending import *\nsignal.signal(signal.SIGHUP, signal.SIG_IGN)\nend_at_once()\n"
        "signal.raise_signal(signal.SIGHUP)\nprint('here', flush=True)\nsignal.raise_signal(signal.SIGTERM)\n"
    )
    result = python(script)
    assert (result.returncode, result.stdout, result.stderr) == (130, "here\n", "kiks: stopped.\n")

"""What programs of the field have brought to light: each of these once ended in an error, or never."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.served import fresh

from kiks.script.runner import run_here

Run = Callable[[str], int]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """Run a program in this process; return its exit code."""

    def run(text: str) -> int:
        program = tmp_path / "brought.py"
        program.write_text(text)
        return run_here(fresh(), program, [], {})

    return run


def test_waiting_for_what_is_left_of_a_time_comes_to_an_end(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("import time\nfor _ in range(3): time.sleep(2e-16)\nprint(time.monotonic_ns())\n") == 0
    assert int(capsys.readouterr().out) == 3


LOOKS = """
import glob, os, stat
from pathlib import Path
for name in glob.glob("/dev/ttyUSB0") + list(glob.iglob("/dev/ttyUSB0")):
    print(name, os.path.exists(name), Path(name).exists(), os.access(name, os.R_OK | os.W_OK))
print(stat.S_ISCHR(os.stat("/dev/ttyUSB0").st_mode), Path("/dev/ttyUSB77").exists())
"""


def test_programs_find_an_offered_port(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(LOOKS) == 0
    assert capsys.readouterr().out == "/dev/ttyUSB0 True True True\n" * 2 + "True False\n"


def test_locks_of_the_library_are_there_for_modules_that_are_imported_later(
    run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    program = "import functools\nclass A:\n    @functools.cached_property\n    def b(self): return 3\nprint(A().b)\n"
    assert run(program) == 0
    assert capsys.readouterr().out == "3\n"


def test_nothing_is_written_as_pyserial_refuses_it(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    program = "import serial\ntry: serial.Serial('COM1').write(None)\nexcept TypeError as error: print(error)\n"
    assert run(program) == 0
    assert capsys.readouterr().out == "cannot convert 'NoneType' object to bytearray\n"


def test_only_threads_of_the_program_count(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    before = "import threading\nthread = threading.Thread(target=print)\n"
    here = threading.active_count()  # other tests may have left a server behind
    assert run(f"{before}thread.start()\nthread.join()\nprint(threading.active_count())\n") == 0
    assert capsys.readouterr().out == f"\n{here}\n"


CHAIN = """
import serial, threading
port = serial.Serial('COM1')
port.close()
def lose():
    try:
        port.write(b'H')
    except serial.SerialException as error:
        raise RuntimeError('lost') from error
thread = threading.Thread(target=lose, name='careless')
thread.start()
thread.join()
lose()
"""


def test_errors_are_told_with_their_causes_and_without_kiks(
    run: Run, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # As the library of the command line does, which shows frames of its own.
    monkeypatch.setattr(sys, "excepthook", lambda *_: print("wrong"))
    assert run(CHAIN) == 1
    told = capsys.readouterr().err
    assert told.startswith("Exception in thread careless:\nTraceback (most recent call last):\n")
    assert told.count("PortNotOpenError: ") == told.count("direct cause") == told.count("RuntimeError: lost\n") == 2
    assert "protocol_kiks" not in told
    assert "runner.py" not in told
    assert told.count("File") == 7


def test_hook_of_the_program_hears_its_error(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    hook = "def hook(kind, error, trace): print('stopped:', error)\n"
    assert run(f"import sys\n{hook}sys.excepthook = hook\nraise ValueError('too near')\n") == 1
    assert capsys.readouterr() == ("stopped: too near\n", "")


def test_event_loop_that_lives_in_real_time_is_refused(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("try: import uvloop\nexcept ImportError: pass\n") == 1
    assert capsys.readouterr().err.startswith(
        "kiks: a program in simulated time must wait by Python's own event loops, but it imported uvloop (brought.py, "
    )

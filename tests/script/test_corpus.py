"""Programs as people write them for a real robot do the same in each way of running them: alone, on the desk, in real
time.

Each is in `tests/programs/corpus` and prints what does not depend on milliseconds.
"""

import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from itertools import takewhile
from pathlib import Path
from subprocess import PIPE

import pytest
from tests import forked
from tests.at_length import at_length, share
from tests.cli.test_cli import KIKS
from tests.served import GUARD_S, PROGRAMS, called

pytestmark = pytest.mark.slow

CORPUS = {path.stem: str(path) for path in sorted((PROGRAMS / "corpus").glob("*.py"))}
INTO_FILE = str(PROGRAMS / "into_file.py")

AGAIN = set(share(["reader_thread", *list(CORPUS)[::3]], list(CORPUS)))
"""Programs that run alone a second time."""

AT_ONCE = 2
"""Worlds at the same time."""
ATTEMPTS_IN_REAL_TIME = 3
"""A computer that is busy for a moment delays programs that live in real time, so these may try again."""
SEED = "3"
WIDE = "size_mm = [1500, 1500]\n" + "".join(
    f"[[start]]\nat_mm = [{150 + 200 * (number % 7)}, {100 + 180 * (number // 7)}]\nheading_deg = 0\n"
    for number in range(14)
)
"""An arena in which no robot meets another one, or a wall."""

ENVIRONMENT = {**os.environ, "PYTHONUNBUFFERED": "1"}


def run_alone(name: str) -> tuple[str, str]:
    """Return what a program prints under `kiks run`, and its errors with the lines of KiKS."""
    done = forked.run("run", "--seed", SEED, CORPUS[name])
    return done.stdout, done.stderr


@pytest.fixture(scope="module")
def alone() -> dict[str, str]:
    """What each program prints that runs alone."""
    with ThreadPoolExecutor(AT_ONCE) as pool:
        return {name: out for name, (out, _) in zip(CORPUS, pool.map(run_alone, CORPUS), strict=True)}


@pytest.mark.parametrize("name", CORPUS)
def test_program_does_the_same_again(name: str) -> None:
    out, errors = run_alone(name)
    assert re.search(rf"^kiks: \d+\.\d{{3}} s simulated, seed {SEED}, state [0-9a-f]{{16}}\n\Z", errors, re.M)
    assert "Traceback" not in out + errors
    assert name not in AGAIN or run_alone(name) == (out, errors)


def run_together(folder: Path, *, on_desk: bool) -> tuple[dict[str, str], str]:
    """Run all programs in one world; return what each of them printed, and the line with the state at the end."""
    folder.mkdir()
    (folder / "wide.toml").write_text(WIDE)
    words = [shlex.join([INTO_FILE, str(folder / name), CORPUS[name]]) for name in CORPUS]
    options = ["--arena", str(folder / "wide.toml"), "--seed", SEED, "--when-silent", "wait"]
    command = [*KIKS, "run", *(["--desk", "--no-wait"] if on_desk else []), *options, *words]
    pipes = {"stdout": PIPE, "stderr": subprocess.STDOUT, "stdin": subprocess.DEVNULL, "text": True}
    env, told = {**ENVIRONMENT, "BROWSER": "true"}, []
    with subprocess.Popen(command, cwd=folder, env=env, start_new_session=True, **pipes) as process:
        assert process.stdout is not None
        try:
            for line in process.stdout:
                told.append(line)
                if "s simulated" in line and on_desk:
                    process.send_signal(signal.SIGINT)
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
    text = "".join(told)
    assert process.returncode == 0, text
    (end,) = [line for line in told if "s simulated" in line]
    return {name: (folder / name).read_text() for name in CORPUS}, end


@at_length
def test_programs_do_the_same_on_the_desk(alone: dict[str, str], tmp_path: Path) -> None:
    with ThreadPoolExecutor(AT_ONCE) as pool:
        jobs = [pool.submit(run_together, tmp_path / str(on_desk), on_desk=on_desk) for on_desk in (True, False)]
    (said, end), without = (job.result() for job in jobs)
    assert said == alone
    assert (said, end) == without
    assert "state" in end


@contextmanager
def served(folder: Path, robots: int) -> Iterator[list[str]]:
    """Serve robots in real time; yield their serial ports."""
    folder.mkdir()
    (folder / "wide.toml").write_text(WIDE)
    options = ["--arena", str(folder / "wide.toml"), "--seed", SEED, "--robots", str(robots), "--tcp", "0"]
    command = [*KIKS, "serve", *options, "--link", str(folder / "ttyUSB")]
    with subprocess.Popen(command, stdout=PIPE, stderr=subprocess.DEVNULL, env=ENVIRONMENT, text=True) as process:
        assert process.stdout is not None
        lines = iter(process.stdout.readline, "")
        told = list(takewhile(lambda line: line.startswith(("Robot ", "  ")), lines))
        try:
            yield [line.split()[-1] for line in told if line.startswith("  serial port")]
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=GUARD_S)


def run_real(name: str, port: str) -> str:
    """Run a program by Python alone, with pyserial itself; return what it said, errors, too."""
    done = called(sys.executable, CORPUS[name], port, env=ENVIRONMENT, stdin=subprocess.DEVNULL)
    return done.stdout + (f"exit code {done.returncode}: {done.stderr}" if done.returncode else "")


@at_length
def test_programs_do_the_same_in_real_time(alone: dict[str, str], tmp_path: Path) -> None:
    said: dict[str, str] = {}
    for attempt in range(ATTEMPTS_IN_REAL_TIME):
        if late := [name for name in CORPUS if said.get(name) != alone[name]]:
            with served(tmp_path / str(attempt), len(late)) as ports, ThreadPoolExecutor(len(late)) as pool:
                said |= zip(late, pool.map(run_real, late, ports), strict=True)
    assert said == alone

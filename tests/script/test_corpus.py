"""Programs as people write them for a real robot do the same in each way of running them: alone, on the desk, in real
time.

Each is in `tests/programs/corpus` and prints what does not depend on milliseconds.
"""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from subprocess import PIPE

import pytest
from tests import forked
from tests.at_length import at_length, share
from tests.cli.test_cli import KIKS
from tests.guard import GUARD_S
from tests.served import PROGRAMS

pytestmark = pytest.mark.slow

CORPUS = {path.stem: str(path) for path in sorted((PROGRAMS / "corpus").glob("*.py"))}
INTO_FILE = str(PROGRAMS / "into_file.py")

AGAIN = set(share(["reader_thread", *list(CORPUS)[::3]], list(CORPUS)))
"""Programs that run alone a second time."""

AT_ONCE = 2
"""Worlds at the same time."""
IN_REAL_TIME = 6
"""Programs at the same time that live in real time: they mostly wait."""
ATTEMPTS_IN_REAL_TIME = 3
"""A computer that is busy for a moment delays programs that live in real time, so these may try again."""
GROUP = 13
"""Programs that share a world: so many begin together within the time in which the world waits for them."""
SEED = "3"
WIDE = "size_mm = [1500, 1500]\n" + "".join(
    f"[[start]]\nat_mm = [{150 + 200 * (number % 7)}, {100 + 180 * (number // 7)}]\nheading_deg = 0\n"
    for number in range(49)
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


# ---- together, and on the desk ----


def run_together(names: Sequence[str], folder: Path, *, on_desk: bool) -> tuple[dict[str, str], str]:
    """Run programs in one world; return what each of them printed, and the line with the state at the end."""
    folder.mkdir()
    (folder / "wide.toml").write_text(WIDE)
    words = [shlex.join([INTO_FILE, str(folder / name), CORPUS[name]]) for name in names]
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
    return {name: (folder / name).read_text() for name in names}, end


@at_length
def test_programs_do_the_same_on_the_desk(alone: dict[str, str], tmp_path: Path) -> None:
    names = list(CORPUS)
    groups = [names[start : start + GROUP] for start in range(0, len(names), GROUP)]
    with ThreadPoolExecutor(AT_ONCE) as pool:
        on_desk = [
            pool.submit(run_together, group, tmp_path / str(number), on_desk=True)
            for number, group in enumerate(groups)
        ]
        without = pool.submit(run_together, groups[0], tmp_path / "without", on_desk=False)
    said: dict[str, str] = {}
    for job in on_desk:
        said |= job.result()[0]
    assert said == alone
    assert on_desk[0].result()[1] == without.result()[1]
    assert "state" in without.result()[1]


# ---- in real time ----


@contextmanager
def served(folder: Path, robots: int) -> Iterator[list[dict[str, str]]]:
    """Serve robots in real time; yield the names of each one's ports: by kind, `serial port` or `RFC 2217`."""
    (folder / "wide.toml").write_text(WIDE)
    options = ["--arena", str(folder / "wide.toml"), "--seed", SEED, "--tcp", "0", "--rfc2217", "0"]
    command = [*KIKS, "serve", "--robots", str(robots), "--link", str(folder / "ttyUSB"), *options]
    with subprocess.Popen(command, stdout=PIPE, stderr=subprocess.DEVNULL, env=ENVIRONMENT, text=True) as process:
        assert process.stdout is not None
        ports: list[dict[str, str]] = []
        for line in process.stdout:
            if line.startswith("Robot "):
                ports.append({})
            elif line.startswith("  "):
                kind, name = re.split(r"\s{2,}", line.strip())
                ports[-1][kind] = name
            else:
                break
        try:
            yield ports
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=GUARD_S)


def run_real(name: str, ports: Mapping[str, str]) -> str:
    """Run a program by Python alone, with pyserial itself; return what it said, errors, too."""
    # A pseudo terminal has no lines for DTR and RTS.
    command = [sys.executable, CORPUS[name], ports["RFC 2217" if name == "control_lines" else "serial port"]]
    pipes = {"stdin": subprocess.DEVNULL, "capture_output": True, "text": True}
    done = subprocess.run(command, env=ENVIRONMENT, timeout=GUARD_S, check=False, **pipes)
    return done.stdout + (f"exit code {done.returncode}: {done.stderr}" if done.returncode else "")


def run_all_real(names: Sequence[str], folder: Path) -> dict[str, str]:
    """Run programs in real time, each on a robot of its own; return what each of them said."""
    folder.mkdir()
    with served(folder, len(names)) as ports, ThreadPoolExecutor(IN_REAL_TIME) as pool:
        jobs = {name: pool.submit(run_real, name, port) for name, port in zip(names, ports, strict=True)}
    return {name: job.result() for name, job in jobs.items()}


@at_length
def test_programs_do_the_same_in_real_time(alone: dict[str, str], tmp_path: Path) -> None:
    said: dict[str, str] = {}
    for attempt in range(ATTEMPTS_IN_REAL_TIME):
        if late := [name for name in CORPUS if said.get(name) != alone[name]]:
            said |= run_all_real(late, tmp_path / str(attempt))
    assert said == alone

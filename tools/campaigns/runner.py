"""Plays cases in child processes: a case that dies, hangs or eats memory ends alone, and is named.

It plays a million cases, some of which kill their process; each can be played again alone.
Method: a case is a campaign's name, a seed and a number, nothing else. Children are forks of this process, which has
loaded and compiled everything. Each writes into shared memory what it is at, so its parent knows what it died of; a
fault or a hang leaves the Python stack in the child's error output, by `faulthandler`.
"""

from __future__ import annotations

import faulthandler
import json
import mmap
import os
import random
import re
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from kiks.errors import KiksError

MESSAGE_MAX = 500
"""Longest message of an error [characters]."""

FOREIGN_MAX = 80
"""Most characters that a message may repeat of what it was given."""

SECRET = "".join(chr(ord("a") + number * number % 23) + str(number % 10) for number in range(100))
"""A text of 200 characters in which hostile data are written, so that a message that repeats too much is known."""

WAIT_FACTOR = 4
"""How much longer a case may wait than it may compute."""

LOOK_S = 0.05
"""How often children are looked after [s]."""

CASE, BEGUN_NS, BEGUN_CPU_NS, PLAYED, TRIED, REFUSED, PEAK_KB, PEAK_CASE = range(8)
"""What a child writes about itself, in this order."""

Play = Callable[[random.Random], "int | None"]


class Broken(Exception):  # noqa: N818  (a verdict)
    """A case that breaks a promise.

    Args:
        verdict: 'foreign', 'message', 'hang', 'death', 'lost' or 'memory'.
        text: What happened.
        where: What the same cause has in common.
    """

    def __init__(self, verdict: str, text: str, where: str = "") -> None:
        super().__init__(text)
        self.verdict, self.where = verdict, where


class Figure(Exception):  # noqa: N818  (no error: how a case hands over what it has measured)
    """What a case has measured.

    Args:
        name: What it is called in the results.
        value: How much; of several cases, the largest counts.
        tried: How much the case has tried.
    """

    def __init__(self, name: str, value: float, tried: int = 1) -> None:
        super().__init__(f"{name} = {value:g}")
        self.name, self.value, self.tried = name, value, tried


@dataclass(frozen=True)
class Campaign:
    """Cases of one kind.

    Args:
        name: A group and a kind, 'files.robot'.
        cases: How many there are in a whole run.
        prepare: Makes everything ready and returns what plays a case; called once, before children begin.
        limit_s: Longest time of a case [s of the processor], and a quarter of the longest that it may wait; one that
            takes longer hangs.
        memory_mb: Most memory that the process of a case may have, all in all [MB]; any if None.
        is_named_only: Whether it runs only where `--only` names it.
        jobs: Most of its cases that run at a time; as many as there are processes if None.
    """

    name: str
    cases: int
    prepare: Callable[[], Play]
    limit_s: float = 30.0
    memory_mb: int | None = None
    is_named_only: bool = False
    jobs: int | None = None


@dataclass
class Finding:
    """All cases of one cause."""

    campaign: str
    verdict: str
    where: str
    text: str
    first: int
    count: int = 1


@dataclass
class Result:
    """What came of a campaign."""

    name: str
    played: int = 0
    tried: int = 0
    refused: int = 0
    peak_mb: float = 0.0
    peak_case: int = 0
    seconds: float = 0.0
    findings: list[Finding] = field(default_factory=list)
    figures: dict[str, float] = field(default_factory=dict)

    def count(self, *verdicts: str) -> int:
        """Return how many cases ended in one of some ways."""
        return sum(finding.count for finding in self.findings if finding.verdict in verdicts)


def check_message(error: BaseException) -> None:
    """Check the message of an error that KiKS raised on purpose.

    Raises:
        Broken: If it is too long, has more than a line, or repeats too much of what was given.
    """
    text, where = str(error), f"{type(error).__name__} of {place_of(error)}"
    if len(text) > MESSAGE_MAX:
        raise Broken("message", f"{len(text)} characters: {text[:120]!r}", f"long, {where}")
    if not text.isprintable():
        raise Broken("message", f"not one printable line: {text[:120]!r}", f"lines, {where}")
    width = FOREIGN_MAX + 1
    if any(SECRET[start : start + width] in text for start in range(len(SECRET) - width + 1)):
        raise Broken("message", f"repeats what it was given: {text[:120]!r}", f"secret, {where}")


def judge(act: Callable[[], object]) -> bool:
    """Do something; say whether it was done, or refused as it must be.

    Raises:
        Broken: If it was refused with a bad message.
    """
    try:
        act()
    except KiksError as error:
        check_message(error)
        return False
    return True


def place_of(error: BaseException) -> str:
    """Return the innermost place in KiKS that an error came through."""
    frames = traceback.extract_tb(error.__traceback__)
    return next((_place(frame.filename, frame.name) for frame in reversed(frames) if "/kiks/" in frame.filename), "?")


def _place(file: str, name: str) -> str:
    return f"{file.rpartition('/kiks/')[2]}, {name}"


def rng_of(seed: int, name: str, case: int) -> random.Random:
    """Return the random numbers of a case."""
    return random.Random(f"{seed} {name} {case}")


def play_case(play: Play, rng: random.Random) -> tuple[int, bool]:
    """Play a case; return how much was tried, and whether it was refused.

    Raises:
        Broken: If it breaks a promise.
        Figure: What it has measured, if it is there for that.
    """
    try:
        return play(rng) or 1, False
    except KiksError as error:
        check_message(error)
        return 1, True
    except (Broken, Figure, KeyboardInterrupt):
        raise
    except MemoryError as error:
        raise Broken("foreign", "MemoryError", f"MemoryError, {place_of(error)}") from error
    except BaseException as error:
        kind = type(error).__name__
        raise Broken("foreign", f"{kind}: {str(error)[:120]!r}", f"{kind}, {place_of(error)}") from error


# ---- a child ----


class _Child:
    """One process that plays every so-many-th case."""

    def __init__(self, row: Any, errors: Path, first: int) -> None:
        self.row, self.errors, self.next = row, errors, first
        self.pid = 0

    def begin(self, play: Play, campaign: Campaign, cases: range, seed: int, report: Path) -> None:
        self.row[CASE], self.row[BEGUN_CPU_NS], self.row[BEGUN_NS] = self.next, 0, time.monotonic_ns()
        sys.stdout.flush()
        sys.stderr.flush()
        self.pid = os.fork()
        if self.pid == 0:
            _live(play, campaign, range(self.next, cases.stop, cases.step), seed, self.row, self.errors, report)


def _live(play: Play, campaign: Campaign, cases: range, seed: int, row: Any, errors: Path, report: Path) -> NoReturn:
    """Play cases until there are no more, then end this process at once."""
    code = 1
    try:
        os.setpgid(0, 0)
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        said = os.open(errors, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(said, 1)
        os.dup2(said, 2)
        faulthandler.enable(said)
        limit_memory(campaign)
        with report.open("a", buffering=1, encoding="utf-8") as lines:
            for case in cases:
                row[CASE], row[BEGUN_CPU_NS], row[BEGUN_NS] = case, time.process_time_ns(), time.monotonic_ns()
                os.ftruncate(said, 0)
                os.lseek(said, 0, os.SEEK_SET)
                try:
                    tried, is_refused = play_case(play, rng_of(seed, campaign.name, case))
                    row[TRIED] += tried
                    row[REFUSED] += is_refused
                except Broken as broken:
                    row[TRIED] += 1
                    lines.write(json.dumps([broken.verdict, broken.where, str(broken), case]) + "\n")
                except Figure as figure:
                    row[TRIED] += figure.tried
                    lines.write(json.dumps(["figure", figure.name, figure.value, case]) + "\n")
                row[PLAYED] += 1
                peak_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
                if peak_kb > row[PEAK_KB]:
                    row[PEAK_KB], row[PEAK_CASE] = peak_kb, case
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def limit_memory(campaign: Campaign) -> None:
    """Let this process have no more address space than a campaign allows."""
    if campaign.memory_mb is not None:
        size, resident = map(int, Path("/proc/self/statm").read_text(encoding="ascii").split()[:2])
        most = (size - resident) * resource.getpagesize() + (campaign.memory_mb << 20)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))


# ---- their parent ----


def run(campaign: Campaign, *, cases: range, seed: int, jobs: int) -> Result:
    """Play cases of a campaign in child processes.

    Args:
        campaign: The campaign.
        cases: Which of them.
        seed: Seed of all that is random in them.
        jobs: How many children there are at a time.
    """
    begin_s = time.monotonic()
    play = campaign.prepare()
    result = Result(campaign.name)
    jobs = min(jobs, len(cases), campaign.jobs or jobs)
    rows = np.frombuffer(mmap.mmap(-1, jobs * 64), np.int64).reshape(jobs, 8)
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        report = Path(folder) / "report"
        children = {}
        for number in range(jobs):
            child = _Child(rows[number], Path(folder) / f"errors-{number}", cases.start + number * cases.step)
            child.begin(play, campaign, range(cases.start, cases.stop, cases.step * jobs), seed, report)
            children[child.pid] = child
        strides = range(cases.start, cases.stop, cases.step * jobs)
        try:
            while children:
                for pid, child in list(children.items()):
                    ended = _look_after(child, campaign, report)
                    if ended is None:
                        continue
                    del children[pid]
                    child.next = int(child.row[CASE]) + strides.step
                    if not ended and child.next < cases.stop:
                        child.begin(play, campaign, strides, seed, report)
                        children[child.pid] = child
                time.sleep(LOOK_S)
        finally:
            for child in children.values():
                _kill(child.pid)
        _gather(result, report)
    result.played, result.tried, result.refused = (int(rows[:, column].sum()) for column in (PLAYED, TRIED, REFUSED))
    highest = int(np.argmax(rows[:, PEAK_KB]))
    result.peak_mb, result.peak_case = rows[highest, PEAK_KB] / 1024, int(rows[highest, PEAK_CASE])
    result.seconds = time.monotonic() - begin_s
    return result


def _look_after(child: _Child, campaign: Campaign, report: Path) -> bool | None:
    """Return None for a child that goes on, True for one that is done, False for one that its case has ended."""
    pid, status = os.waitpid(child.pid, os.WNOHANG)
    if pid == 0:
        if not _is_late(child, campaign):
            return None
        # It may have come to its next case meanwhile: it is stopped, and looked at again.
        os.kill(child.pid, signal.SIGSTOP)
        if not _is_late(child, campaign):
            os.kill(child.pid, signal.SIGCONT)
            return None
        # faulthandler writes down where it is.
        os.kill(child.pid, signal.SIGABRT)
        os.kill(child.pid, signal.SIGCONT)
        time.sleep(0.5)
        _kill(child.pid)
        verdict, text = "hang", f"computes longer than {campaign.limit_s:g} s, or waits longer than four times that"
    else:
        _kill_group(child.pid)
        code = os.waitstatus_to_exitcode(status)
        if code == 0:
            return True
        verdict, text = "death", signal.Signals(-code).name if code < 0 else f"exit code {code}"
    said = child.errors.read_text(encoding="utf-8", errors="replace")
    frames = re.findall(r'File "([^"]*)", line \d+ in (\S+)', said)
    inside = [(file, name) for file, name in frames if "/kiks/" in file]
    where = next((_place(file, name) for file, name in inside or frames), said[-80:])
    child.row[PLAYED] += 1
    child.row[TRIED] += 1
    with report.open("a", encoding="utf-8") as lines:
        lines.write(json.dumps([verdict, where, text, int(child.row[CASE])]) + "\n")
    return False


def _is_late(child: _Child, campaign: Campaign) -> bool:
    """Say whether a case takes too long: computing, or by the clock, which on a busy computer goes faster."""
    limit_ns = campaign.limit_s * 1e9
    waited_ns = time.monotonic_ns() - int(child.row[BEGUN_NS])
    if not limit_ns < waited_ns:
        return False
    words = Path(f"/proc/{child.pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    computed_ns = (int(words[11]) + int(words[12])) * 1e9 / os.sysconf("SC_CLK_TCK") - int(child.row[BEGUN_CPU_NS])
    return computed_ns > limit_ns or waited_ns > WAIT_FACTOR * limit_ns


def _kill(pid: int) -> None:
    _kill_group(pid)
    os.waitpid(pid, 0)


def _kill_group(pid: int) -> None:
    """End a child and all that it has started."""
    try:
        os.killpg(pid, signal.SIGKILL)
    except ProcessLookupError:
        return


def _gather(result: Result, report: Path) -> None:
    """Put together the cases that have the same cause."""
    causes: dict[tuple[str, str], Finding] = {}
    lines = report.read_text(encoding="utf-8").splitlines() if report.exists() else []
    for verdict, where, text, case in map(json.loads, lines):
        if verdict == "figure":
            result.figures[where] = max(text, result.figures.get(where, text))
            continue
        known = causes.setdefault((verdict, where), Finding(result.name, verdict, where, text, case, 0))
        known.count += 1
        if case < known.first:
            known.first, known.text = case, text
    result.findings = sorted(causes.values(), key=lambda finding: (-finding.count, finding.where))


def verdicts(results: list[Result]) -> Counter[str]:
    """Return how often each verdict was reached."""
    return Counter({v: sum(r.count(v) for r in results) for v in ("death", "foreign", "message", "hang", "lost")})

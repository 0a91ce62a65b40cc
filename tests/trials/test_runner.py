"""The runner: the same outcomes on any number of workers, in any order, after a kill; no trial costs another."""

import re
import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from textwrap import dedent

import pytest
from tests import forked

from kiks import Recording
from kiks.errors import ParameterError
from kiks.model.arena import Arena, Pose
from kiks.model.goal import Goal
from kiks.model.project import Project
from kiks.ports.program_command import ProgramCommand
from kiks.ports.sandbox import SandboxLimits
from kiks.trials.one_run import run_trial
from kiks.trials.runner import OUTCOMES, run_trials
from kiks.trials.sandboxes import Sandboxes
from kiks.trials.trial import End, Outcome, Trial

PROGRAMS = {
    "drives": """
        import kiks
        robot = kiks.Khepera("/dev/ttyUSB0")
        robot.set_speed(2, 1)
        for _ in range(25):
            robot.proximity()
            robot.pause(0.05)
        print("done", robot.encoders())
        """,
    "crashes": "print('about to'); raise ValueError('no <b>wall</b>')",
    "goes_on": """
        import kiks
        robot = kiks.Khepera("/dev/ttyUSB0")
        robot.set_speed(8, 8)
        while True:
            robot.pause(0.1)
        """,
}

JUDGE = """
    def supervise(sim):
        while True:
            yield 0.5
            sim.set_score("halves", int(sim.time_s * 2))
    """

GOAL = Goal(solved="path_mm > 80", points='score("halves")')


def write(folder: Path, name: str, text: str) -> ProgramCommand:
    path = folder / f"{name}.py"
    path.write_text(dedent(text))
    return ProgramCommand(path)


def trials_in(folder: Path) -> list[Trial]:
    """Return a trial of each program."""
    arena = replace(Arena.box(400, 400), starts=(Pose(100.0, 200.0, 0.0),))
    write(folder, "judge", JUDGE)
    project = Project(arena, seconds=3.0, supervisor="judge.py", goal=GOAL, seed=1)
    commands = [write(folder, name, text) for name, text in PROGRAMS.items()]
    return [Trial(each.name, project, folder, (each,), is_trusted=True) for each in commands]


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the trials' programs, in which `out` has what they have left."""
    return tmp_path_factory.mktemp("trials")


@pytest.fixture(scope="module")
def outcomes(home: Path) -> list[Outcome]:
    """Outcomes of the trials from one worker."""
    return run_trials(trials_in(home), home / "out", workers=1)


@pytest.fixture
def sandboxes() -> Iterator[Sandboxes]:
    sandboxes = Sandboxes(SandboxLimits(computing_s=0.3, waiting_s=0.3))
    yield sandboxes
    sandboxes.close()


def test_a_trial_says_how_the_program_has_ended_and_what_it_scored(outcomes: list[Outcome]) -> None:
    drives, _, goes_on = outcomes
    crash = outcomes[1].end_of()
    assert [each.end_of().how for each in outcomes] == [End.ENDED, End.CRASHED, End.RUNNING]
    assert drives.end_of().printed[0].startswith("done")
    assert (crash.detail, crash.printed[0]) == ("ValueError: no <b>wall</b>", "about to")
    assert (drives.is_solved, goes_on.is_solved, goes_on.points, goes_on.time_s) == (False, True, 2, 1.3)
    assert not any(each.doubt for each in outcomes)


def test_the_same_comes_out_of_two_workers_in_another_order_after_kills_of_runner_and_worker(home, outcomes) -> None:
    folder, trials = home / "killed", trials_in(home)
    code = f"""
        import os
        from pathlib import Path
        from tests.trials.test_runner import run_trials, trials_in
        home = Path({str(home)!r})
        kill = lambda outcome, count: count == 2 and os.kill(os.getpid(), 9)
        run_trials(trials_in(home), home / "killed", workers=1, on_outcome=kill)
        """
    assert forked.run(code=dedent(code), cwd=forked.ROOT).returncode == -signal.SIGKILL
    there = (folder / OUTCOMES).read_bytes()
    assert there.count(b"}\n") == 2
    (folder / OUTCOMES).write_bytes(there + there.splitlines()[-1][:50])
    kept, lost = (folder / outcome.recording for outcome in outcomes[:2])
    kept_at = kept.stat().st_mtime_ns
    lost.unlink()

    write(home, "killer", "import os\ndef supervise(sim):\n    yield 0.1\n    os.kill(os.getpid(), 9)")
    killer = replace(trials[0], name="killer", project=replace(trials[0].project, supervisor="killer.py"))
    killed, *others = run_trials([killer, *trials[::-1]], folder, workers=2)
    assert (others, killed.end_of().how) == (outcomes[::-1], End.STOPPED)
    assert "by signal 9, 2 times" in killed.doubt
    assert kept.stat().st_mtime_ns == kept_at
    assert lost.stat().st_size > 0

    counts, taken = [], []
    again = run_trials(trials, folder, on_outcome=lambda outcome, count: counts.append(count), on_taken=taken.append)
    assert (again, counts, taken) == (outcomes, [1, 2, 3], [3])
    assert (folder / OUTCOMES).read_bytes() == (home / "out" / OUTCOMES).read_bytes()


def test_a_changed_file_is_another_trial_and_names_differ(tmp_path: Path) -> None:
    trial = trials_in(tmp_path)[0]
    with pytest.raises(ParameterError, match="names of trials must differ"):
        run_trials([trial, trial], tmp_path / "out")
    keys = {trial.key, replace(trial).key}
    assert len(keys) == 1
    # Those of each program belong to it, too: modules that it imports, files that it names.
    changes = (("drives", "import gains"), ("judge", "open('gains.txt')"), ("gains", "GAIN = 1"), ("gains", "GAIN = 2"))
    for name, text in changes:
        write(tmp_path, name, text)
        keys.add(replace(trial).key)
    (tmp_path / "gains.txt").write_text("3")
    keys.add(replace(trial).key)
    write(tmp_path, "crashes", "pass")
    keys.add(replace(trial).key)
    assert len(keys | {replace(trial, project=replace(trial.project, seconds=4.0)).key}) == 7


def test_a_trial_is_the_run_that_its_recording_and_kiks_run_show(home: Path, outcomes: list[Outcome]) -> None:
    recording = Recording(home / "out" / outcomes[0].recording)
    assert recording.world_at(outcomes[0].time_s).state_hash() == outcomes[0].state
    assert set(recording.programs) == {"1-drives.py", "2-judge.py"}
    trials_in(home)[0].project.save(home / "case.kiks")
    assert outcomes[0].state in forked.run("run", str(home / "case.kiks"), str(home / "drives.py")).stderr


def test_what_lets_no_time_pass_is_stopped_and_named(tmp_path: Path, sandboxes: Sandboxes) -> None:
    loop = write(tmp_path, "loop", "while True: pass")
    # Another process waits in real time, which KiKS does not simulate.
    still = write(tmp_path, "still", "import subprocess; subprocess.run(['sleep', '100'])")
    project = Project(Arena.box(300, 300), seconds=1.0)
    for command, words in ((loop, "computed for 0.3 s"), (still, "waited for 0.3 s")):
        trial = Trial(command.name, project, tmp_path, (command,), is_trusted=True)
        outcome = run_trial(trial, tmp_path, sandboxes)
        assert (outcome.end_of().how, outcome.doubt) == (End.ENDLESS, "")
        assert outcome.end_of().detail.startswith(words)


def test_nothing_counts_of_a_run_that_a_faster_computer_would_have_had_more_of(tmp_path: Path) -> None:
    program = write(tmp_path, "a", "import time\nwhile True: sum(range(1_000_000)); time.sleep(0.001)")
    project = Project(goal=Goal(points="1 + time_s"), seconds=10.0)
    trial = Trial("a", project, tmp_path, (program,), is_trusted=True)
    outcome = run_trial(trial, tmp_path, Sandboxes(SandboxLimits(processor_s=0.1)))
    assert outcome.end_of().how == End.STOPPED
    assert re.fullmatch(r"computed for \d+ s in all", outcome.end_of().detail)
    assert (outcome.points, outcome.time_s, outcome.state) == (0, 0.0, "")


def test_a_program_that_waits_runs_out_of_simulated_time(tmp_path: Path, sandboxes: Sandboxes) -> None:
    program = write(tmp_path, "sleeps", "import time\nwhile True: time.sleep(1)")
    outcome = run_trial(Trial("a", Project(seconds=7.0), tmp_path, (program,), is_trusted=True), tmp_path, sandboxes)
    assert (outcome.end_of().how, outcome.time_s) == (End.OUT_OF_TIME, 7.0)

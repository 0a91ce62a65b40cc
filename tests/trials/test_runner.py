"""The runner: the same outcomes on any number of workers, in any order, after a kill; no trial costs another."""

from __future__ import annotations

import os
import random
import re
import shutil
import signal
import subprocess
from dataclasses import replace
from pathlib import Path
from textwrap import dedent

import pytest
from tests.guard import wait_until

from kiks import Recording
from kiks.errors import KiksError, ParameterError
from kiks.model.arena import Arena, Pose
from kiks.model.goal import Goal
from kiks.model.project import Project
from kiks.ports.program_process import Command, python_line
from kiks.ports.sandbox import Limits
from kiks.trials.one_run import run_trial
from kiks.trials.runner import OUTCOMES, run_trials
from kiks.trials.sandboxes import Sandboxes
from kiks.trials.trial import CRASHED, ENDED, ENDLESS, OUT_OF_TIME, RUNNING, STOPPED, Trial

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


def write(folder: Path, name: str, text: str) -> Command:
    path = folder / f"{name}.py"
    path.write_text(dedent(text))
    return Command(path)


def trials_in(folder: Path) -> list[Trial]:
    """Return trials of each program in two cases."""
    arena = replace(Arena.box(400, 400), starts=(Pose(100.0, 200.0, 0.0),))
    write(folder, "judge", JUDGE)
    project = Project(arena, seconds=3.0, supervisor="judge.py", goal=GOAL)
    return [
        Trial(f"{name}/{seed}", replace(project, seed=seed), folder, (write(folder, name, text),), is_trusted=True)
        for name, text in PROGRAMS.items()
        for seed in (1, 2)
    ]


def test_a_trial_says_how_the_program_has_ended_and_what_it_scored(tmp_path: Path) -> None:
    drives, _, crashes, _, goes_on, _ = run_trials(trials_in(tmp_path), tmp_path / "out", workers=1)
    assert drives.end_of().how == ENDED
    assert drives.end_of().printed[0].startswith("done")
    assert not drives.is_solved
    assert crashes.end_of().how == CRASHED
    assert crashes.end_of().detail == "ValueError: no <b>wall</b>"
    assert crashes.end_of().printed[0] == "about to"
    assert goes_on.end_of().how == RUNNING
    assert goes_on.is_solved
    assert (goes_on.points, goes_on.time_s) == (2, 1.3)
    assert not any(each.doubt for each in (drives, crashes, goes_on))


def test_the_same_file_comes_out_on_any_number_of_workers_in_any_order_and_after_a_kill(tmp_path: Path) -> None:
    trials = trials_in(tmp_path)
    run_trials(trials, tmp_path / "one", workers=1)
    run_trials(trials, tmp_path / "two", workers=2)
    shuffled = random.Random(3).sample(trials, len(trials))
    run_trials(shuffled, tmp_path / "shuffled", workers=2)
    made = []
    run_trials(trials, tmp_path / "shuffled", on_outcome=lambda outcome, count: made.append(count))
    assert made == [1, 2, 3, 4, 5, 6]
    expected = (tmp_path / "one" / OUTCOMES).read_bytes()
    for name in ("two", "shuffled"):
        assert (tmp_path / name / OUTCOMES).read_bytes() == expected

    code = dedent(f"""
        from pathlib import Path
        from tests.trials.test_runner import trials_in
        from kiks.trials.runner import run_trials
        run_trials(trials_in(Path({str(tmp_path)!r})), Path({str(tmp_path / "killed")!r}), workers=1)
        """)
    outcomes = tmp_path / "killed" / OUTCOMES
    with subprocess.Popen(python_line("-c", f"import sys; sys.path.insert(0, '.')\n{code}")) as killed:
        wait_until(lambda: outcomes.exists() and outcomes.read_bytes().count(b"}\n") >= 2)
        killed.send_signal(signal.SIGKILL)
    there = outcomes.read_bytes()
    assert there.count(b"}\n") < len(trials)
    outcomes.write_bytes(there + there.splitlines()[-1][:50])
    run_trials(trials, tmp_path / "killed", workers=1)
    assert outcomes.read_bytes() == expected


def test_a_changed_file_is_another_trial(tmp_path: Path) -> None:
    trial = trials_in(tmp_path)[0]
    keys = {trial.key, replace(trial).key}
    assert len(keys) == 1
    for name in ("drives", "judge"):
        write(tmp_path, name, "pass")
        keys.add(replace(trial).key)
    keys.add(replace(trial, project=replace(trial.project, seconds=4.0)).key)
    assert len(keys) == 4


def test_a_trial_is_the_run_that_its_recording_and_kiks_run_show(tmp_path: Path) -> None:
    trial = trials_in(tmp_path)[0]
    outcome = run_trial(trial, tmp_path, Sandboxes())
    recording = Recording(tmp_path / outcome.recording)
    assert recording.world_at(outcome.time_s).state_hash() == outcome.state
    assert set(recording.programs) == {"1-drives.py", "2-judge.py"}
    trial.project.save(tmp_path / "case.kiks")
    line = python_line("-m", "kiks", "run", str(tmp_path / "case.kiks"), str(tmp_path / "drives.py"))
    said = subprocess.run(line, capture_output=True, text=True, check=True).stderr
    assert outcome.state in said


def test_what_lets_no_time_pass_is_stopped_and_named(tmp_path: Path) -> None:
    loop = write(tmp_path, "loop", "while True: pass")
    # Another process waits in real time, which KiKS does not simulate.
    still = write(tmp_path, "still", "import subprocess; subprocess.run(['sleep', '100'])")
    project = Project(Arena.box(300, 300), seconds=1.0)
    sandboxes = Sandboxes(Limits(computing_s=0.3, waiting_s=0.3))
    for command, words in ((loop, "computed for 0.3 s"), (still, "waited for 0.3 s")):
        trial = Trial(command.name, project, tmp_path, (command,), is_trusted=True)
        outcome = run_trial(trial, tmp_path, sandboxes)
        assert outcome.end_of().how == ENDLESS
        assert outcome.end_of().detail.startswith(words)
        assert not outcome.doubt
    sandboxes.close()


def test_nothing_counts_of_a_run_that_a_faster_computer_would_have_had_more_of(tmp_path: Path) -> None:
    text = "import time\nwhile True: sum(range(1_000_000)); time.sleep(0.001)"
    project = Project(goal=Goal(points="1 + time_s"), seconds=10.0)
    trial = Trial("a", project, tmp_path, (write(tmp_path, "a", text),), is_trusted=True)
    outcome = run_trial(trial, tmp_path, Sandboxes(Limits(processor_s=0.1)))
    assert outcome.end_of().how == STOPPED
    assert re.fullmatch(r"computed for \d+ s in all", outcome.end_of().detail)
    assert (outcome.points, outcome.time_s, outcome.state) == (0, 0.0, "")


def test_a_program_that_waits_runs_out_of_simulated_time(tmp_path: Path) -> None:
    sleeps = write(tmp_path, "sleeps", "import time\nwhile True: time.sleep(1)")
    outcome = run_trial(Trial("a", Project(seconds=7.0), tmp_path, (sleeps,), is_trusted=True), tmp_path, Sandboxes())
    assert outcome.end_of().how == OUT_OF_TIME
    assert outcome.time_s == 7.0


def test_a_trial_that_takes_its_worker_with_it_is_named_and_costs_no_other(tmp_path: Path) -> None:
    trials = trials_in(tmp_path)[:2]
    write(tmp_path, "killer", "import os\ndef supervise(sim):\n    yield 0.1\n    os.kill(os.getpid(), 9)")
    project = replace(trials[0].project, supervisor="killer.py")
    trials.insert(1, replace(trials[0], name="killer", project=project))
    first, lost, last = run_trials(trials, tmp_path / "out", workers=1)
    assert lost.end_of().how == STOPPED
    assert "by signal 9, 2 times" in lost.doubt
    assert first.end_of().how == last.end_of().how == ENDED


def test_what_cannot_begin_is_refused_with_its_name(tmp_path: Path) -> None:
    program = write(tmp_path, "program", "pass")
    trial = Trial("ann/1", Project(), tmp_path, (program,), is_trusted=True)
    with pytest.raises(KiksError, match=r"'ann/1' cannot begin: a project .* must have a time limit"):
        run_trials([trial], tmp_path / "out")
    with pytest.raises(ParameterError, match="names of trials must differ"):
        run_trials([trial, trial], tmp_path / "out")


def test_a_lost_recording_is_made_again(tmp_path: Path) -> None:
    trials = trials_in(tmp_path)[:2]
    first, second = run_trials(trials, tmp_path, workers=1)
    (tmp_path / first.recording).unlink()
    shutil.copy(tmp_path / second.recording, tmp_path / "kept.mcap")
    assert run_trials(trials, tmp_path, workers=1) == [first, second]
    assert os.path.getsize(tmp_path / first.recording) > 0

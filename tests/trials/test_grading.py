"""`kiks grade` from its words to its files: good, broken and hostile programs side by side."""

from __future__ import annotations

import csv
import io
import json
import re
import signal
import socket
import subprocess
from pathlib import Path
from textwrap import dedent

import pytest
from playwright.sync_api import expect
from tests.desk.visitor import NewPage, check_access, leave_picture
from tests.guard import GUARD_S, wait_until
from tests.namespaces import needs_sandbox

from kiks.errors import ParameterError
from kiks.model.arena import Arena
from kiks.model.atomic_files import alone_in
from kiks.model.exercise import Cases, Exercise
from kiks.model.goal import Goal
from kiks.model.project import Project
from kiks.ports.program_process import python_line
from kiks.trials.grading import load_exercise
from kiks.trials.tables import cell

GOOD = """
    import kiks
    robot = kiks.Khepera("/dev/ttyUSB0")
    robot.set_speed(6, 6)
    while True:
        robot.pause(0.1)
        print("encoders", robot.encoders())
    """

BROKEN = {
    "carl": "print(\"<script>alert('hi')</script>\\x1b[31m\"); raise ValueError('=1+1 <b>what</b>')",
    "dora": "import time\nwhile True: time.sleep(1)",
}

HOSTILE = {
    "mallory": "import subprocess\nsubprocess.run(['bash', '-c', 'b() { sleep 0.01; b | b & }; b; sleep 9'])",
    "oscar": "hoard = []\nwhile True: hoard.append(bytearray(50_000_000))",
    "trudy": "while True: print('x' * 1_000_000)",
    "victor": "import os, signal\nos.kill(os.getppid(), signal.SIGKILL)\nos.kill(-1, signal.SIGKILL)\nos.abort()",
}

NEIGHBOUR = """
    # KiKS itself refuses all this to a program: a shell asks the sandbox.
    import subprocess
    looks = (
        "find {folder} -type f -not -path '*eve*'; "
        "for each in {target} /etc/passwd; do echo x >> $each && echo wrote $each; done; "
        "echo x > /dev/tcp/127.0.0.1/{port} && echo connected"
    )
    done = subprocess.run(["bash", "-c", looks], capture_output=True, text=True)
    print("found", done.stdout.split())
    """


def exercise(folder: Path, *cases: Cases) -> Path:
    goal = Goal("Drive 10 cm", solved="path_mm > 100", points="10 - time_s if is_solved else path_mm / 100")
    cases = cases or (Cases(seed=(1, 2)), Cases("hidden", seed=(3,), is_hidden=True))
    project = Project(Arena.box(900, 900), seconds=4.0, goal=goal, cases=cases, exercise=Exercise("Ten <centimetres>"))
    project.save(folder / "ten.kiks")
    return folder / "ten.kiks"


def write(folder: Path, programs: dict[str, str]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in programs.items():
        (folder / f"{name}.py").write_text(dedent(text))
    return folder


def grade(*words: object) -> subprocess.CompletedProcess[str]:
    line = python_line("-m", "kiks", "grade", *map(str, words))
    return subprocess.run(line, capture_output=True, text=True, timeout=GUARD_S, check=False)


def rows_of(out: Path) -> dict[str, dict[str, str]]:
    text = (out / "grades.csv").read_text()
    return {row["name"]: row for row in csv.DictReader(io.StringIO(text))}


def test_a_class_is_graded(tmp_path: Path) -> None:
    project = exercise(tmp_path)
    programs = write(tmp_path / "class", {"ann": GOOD, "bob": GOOD.replace("robot", "r") + "    # mine\n", **BROKEN})
    write(programs / "frank", {"a": "", "b": ""})
    done = grade(project, programs, "--trusted", "--out", tmp_path / "out", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert [each["name"] for each in told["submissions"]] == ["ann", "bob", "carl", "dora", "frank"]
    assert told["alike"] == [{"first": "ann", "second": "bob", "share": 1.0}]
    rows = rows_of(tmp_path / "out")
    assert rows["ann"]["solved"] == "3"
    assert float(rows["ann"]["points"]) > 7
    assert rows["ann"]["said_last"].startswith("encoders")
    assert (rows["carl"]["crashed"], rows["dora"]["out of time"]) == ("3", "3")
    assert rows["carl"]["said_last"] == "ValueError: =1+1 <b>what</b>"
    assert rows["frank"]["said_last"].startswith("it must have one program")
    for number in (1, 3):
        assert (tmp_path / "out" / "runs" / "ann" / f"{number}.mcap").is_file()
    results = json.loads((tmp_path / "out" / "results" / "ann.json").read_text())
    assert sum(test["score"] for test in results["tests"]) == pytest.approx(results["score"], abs=0.001)
    assert [test["visibility"] for test in results["tests"]] == ["visible", "visible", "hidden"]
    assert [entry.get("order") for entry in results["leaderboard"]] == [None, None, "asc"]
    report = (tmp_path / "out" / "report.html").read_text()
    assert "Ten &lt;centimetres&gt;" in report
    assert "<b>what" not in report
    assert "<script>alert" not in report
    assert not re.search(r"(?:src|href)=.?https?:", report)
    moodle = [*csv.reader(io.StringIO((tmp_path / "out" / "moodle.csv").read_text()))]
    assert moodle[0][0] == "Identifier"
    assert {"Grade", "Last modified (grade)"} <= set(moodle[0])


def test_the_report_opens_what_belongs_to_a_name(tmp_path: Path, new_page: NewPage) -> None:
    programs = write(tmp_path / "class", {"ann": GOOD, **BROKEN})
    assert grade(exercise(tmp_path), programs, "--trusted", "--out", tmp_path / "out").returncode == 0
    page = new_page(1366, 768)
    for colours, width in (("light", 1366), ("dark", 390)):
        page.emulate_media(color_scheme=colours)  # type: ignore[arg-type]
        page.set_viewport_size({"width": width, "height": 800})
        page.goto((tmp_path / "out" / "report.html").as_uri())
        check_access(page, colours)
        for name in ("ann", "carl"):
            page.get_by_role("button", name=name, exact=True).click()
            expect(page.locator(".details:visible h2")).to_contain_text(name)
            frame = page.frame_locator("iframe")
            frame.get_by_role("button", name="Play").click()
            expect(page.locator("iframe")).to_have_count(1)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        leave_picture(page, f"grades_{colours}_{width}", full_page=True)
        expect(page.locator(".details:visible")).to_contain_text("ValueError: =1+1 <b>what</b>")
        page.get_by_role("button", name="carl", exact=True).click()
        expect(page.locator(".details:visible")).to_have_count(0)


@needs_sandbox
def test_hostile_programs_are_named_and_cost_the_others_nothing(tmp_path: Path) -> None:
    project = exercise(tmp_path, Cases(seed=(1,)))
    alone = write(tmp_path / "alone", {"ann": GOOD})
    assert grade(project, alone, "--out", tmp_path / "expected").returncode == 0
    target = tmp_path / "out" / "programs" / "ann" / "ann.py"
    with socket.create_server(("127.0.0.1", 0)) as server:
        neighbour = dedent(NEIGHBOUR).format(folder=tmp_path, target=target, port=server.getsockname()[1])
        programs = write(tmp_path / "class", {"ann": GOOD, "eve": neighbour, **HOSTILE})
        done = grade(project, programs, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    expected, rows = rows_of(tmp_path / "expected")["ann"], rows_of(tmp_path / "out")
    assert rows["ann"] == expected
    assert rows["eve"]["said_last"] == "found []"
    reasons = {"mallory": "processes", "oscar": "MB of memory", "trudy": "printed more than"}
    for name, words in reasons.items():
        assert rows[name]["stopped"] == "1", rows[name]
        assert words in rows[name]["said_last"]
    assert float(rows["victor"]["points"]) == 0
    assert int(rows["victor"]["crashed"]) + int(rows["victor"]["stopped"]) == 1
    # In the same place: a traceback that a program prints names it.
    (tmp_path / "out").rename(tmp_path / "before")
    assert grade(project, programs, "--out", tmp_path / "out", "--workers", "1").returncode == 0
    for name in ("grades.csv", "moodle.csv", "outcomes.jsonl"):
        assert (tmp_path / "before" / name).read_bytes() == (tmp_path / "out" / name).read_bytes()


def test_ctrl_c_says_how_to_go_on(tmp_path: Path) -> None:
    project = exercise(tmp_path)
    loop = "import kiks\nrobot = kiks.Khepera('/dev/ttyUSB0')\nwhile True: robot.pause(1e-3)"
    programs = write(tmp_path / "class", {"ann": GOOD, "zoe": "while True: pass", "mia": loop})
    words = [project, programs, "--trusted", "--workers", "1", "--out", tmp_path / "out"]
    outcomes = tmp_path / "out" / "outcomes.jsonl"
    line = python_line("-m", "kiks", "grade", *map(str, words))
    with subprocess.Popen(line, stderr=subprocess.PIPE, text=True) as run:
        wait_until(lambda: outcomes.exists() and outcomes.read_bytes().count(b"}\n") >= 6)
        run.send_signal(signal.SIGINT)
        _, said = run.communicate(timeout=GUARD_S)
    assert run.returncode == 130
    assert "stopped after 6 of 9 runs. The same command goes on from there." in said
    assert "Traceback" not in said


def test_what_cannot_be_graded_is_refused(tmp_path: Path) -> None:
    for project, words in (
        (Project(seconds=1.0), "EXERCISE must have a goal"),
        (Project(goal=Goal(solved="contacts > 0")), "EXERCISE must have a time limit"),
        (Project(goal=Goal(), seconds=1.0, thinking="live"), "EXERCISE must have a repeatable thinking time"),
        (Project(goal=Goal(), seconds=1.0, cases=(Cases(thinking=("live",)),)), "that of .* is 'live'"),
    ):
        project.save(tmp_path / "it.kiks")
        with pytest.raises(ParameterError, match=words):
            load_exercise(tmp_path / "it.kiks")


def test_two_runs_do_not_write_into_one_folder(tmp_path: Path) -> None:
    project, programs = exercise(tmp_path), write(tmp_path / "class", {"ann": GOOD})
    with alone_in(tmp_path / "out", "it"):
        done = grade(project, programs, "--trusted", "--out", tmp_path / "out")
    assert done.returncode == 2
    assert "--out must belong to one run, but another one writes into" in done.stderr


def test_no_cell_begins_a_formula() -> None:
    for text in ("=1+1", "+1", "-1", "@sum", "\t=1", " =1"):
        assert str(cell(text)).startswith("'")
    assert cell("a\r\nb\0") == "a  b "
    assert cell(-1.5) == -1.5


def test_without_a_sandbox_nothing_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    done = grade(exercise(tmp_path), write(tmp_path / "class", {"ann": GOOD}), "--out", tmp_path / "out")
    assert done.returncode == 2
    assert "bubblewrap" in done.stderr
    assert "--trusted" in done.stderr
    assert not (tmp_path / "out").exists()

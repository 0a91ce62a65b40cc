"""`kiks grade` from its words to its files: good, broken and hostile programs side by side."""

import csv
import json
import os
import re
import signal
import socket
import subprocess
import zipfile
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from textwrap import dedent

import pytest
from playwright.sync_api import expect
from tests import forked
from tests.at_length import AT_LENGTH
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
from kiks.trials.trial import Outcome

DUE = "2026-11-20T12:00Z"
DUE_S = datetime.fromisoformat(DUE).timestamp()

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
    title = Exercise("Ten <centimetres>")
    project = Project(Arena.box(900, 900), seconds=4.0, goal=goal, cases=cases or (Cases(seed=(1,)),), exercise=title)
    project.save(folder / "ten.kiks")
    return folder / "ten.kiks"


def write(folder: Path, programs: dict[str, str]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in programs.items():
        (folder / f"{name}.py").write_text(dedent(text))
    return folder


def grade(*words: object, **env: str) -> subprocess.CompletedProcess[str]:
    return forked.run("grade", *map(str, words), env=env)


def table(out: Path, name: str) -> list[dict[str, str]]:
    with (out / name).open(newline="") as file:
        return [*csv.DictReader(file)]


def rows_of(out: Path) -> dict[str, dict[str, str]]:
    return {row["name"]: row for row in table(out, "grades.csv")}


def outcomes_of(out: Path) -> dict[str, Outcome]:
    lines = (out / "outcomes.jsonl").read_bytes().splitlines()
    return {outcome.name: outcome for outcome in map(Outcome.from_line, lines)}


@pytest.fixture(scope="module")
def graded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with the grades of a class; what the command told is in `told.json`."""
    folder = tmp_path_factory.mktemp("graded")
    programs = write(folder / "class", {"ann": GOOD, "bob": GOOD.replace("robot", "r") + "    # mine\n", **BROKEN})
    write(programs / "frank", {"a": "", "b": ""})
    os.utime(programs / "bob.py", (DUE_S + 86401, DUE_S + 86401))
    os.utime(programs / "ann.py", (DUE_S, DUE_S))
    (folder / "names.csv").write_text("Name;Email\nAnn;ann@x.org\nBob;\nCarl;\nDora;\nFrank;\nGus;gus@x.org\n")
    stale = [folder / "out" / name for name in ("results/old.json", "feedback/old.html", "runs/old/1.mcap")]
    for path in (folder / "out" / "outcomes.jsonl", *stale):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text('{"key": []}\n' + "[" * 10_000)
    project = exercise(folder, Cases(seed=(1,)), Cases("hidden", seed=(3,), is_hidden=True))
    marking = ("--max", "100", "--full", "10", "--due", DUE, "--students", folder / "names.csv")
    done = grade(project, programs, "--trusted", "--workers", "1", "--out", folder / "out", "--json", *marking)
    assert done.returncode == 0, done.stderr
    assert not any(path.exists() for path in stale)
    (folder / "out" / "told.json").write_text(done.stdout)
    return folder / "out"


def test_a_class_is_graded(graded: Path) -> None:
    told = json.loads((graded / "told.json").read_text())
    names = ["Ann", "Bob", "Carl", "Dora", "Frank", "Gus"]
    assert [each["name"] for each in told["submissions"]] == names
    assert told["alike"] == [{"first": "Ann", "second": "Bob", "share": 1.0}]
    rows = rows_of(graded)
    assert (rows["Ann"]["solved"], rows["Carl"]["crashed"], rows["Dora"]["out of time"]) == ("2", "2", "2")
    points = float(rows["Ann"]["points"])
    assert points > 7
    # One second more than a day late are two days, and what was not graded is empty, not 0.
    assert [float(rows[name]["grade"]) for name in names[:3]] == [round(10 * points, 2), round(8 * points, 2), 0]
    assert [(rows[name]["grade"], rows[name]["points"]) for name in ("Frank", "Gus")] == [("", "")] * 2
    assert rows["Carl"]["said_last"] == "ValueError: =1+1 <b>what</b>"
    for name, words in (("Ann", "encoders"), ("Frank", "it must have one program"), ("Gus", "nothing was handed in")):
        assert rows[name]["said_last"].startswith(words)
    for number in (1, 2):
        assert (graded / "runs" / "ann" / f"{number}.mcap").is_file()
    results = json.loads((graded / "results" / "ann.json").read_text())
    assert sum(test["score"] for test in results["tests"]) == pytest.approx(results["score"], abs=0.001)
    assert [test["visibility"] for test in results["tests"]] == ["visible", "hidden"]
    assert [entry.get("order") for entry in results["leaderboard"]] == [None, None, "asc"]
    report = (graded / "report.html").read_text()
    assert "Ten &lt;centimetres&gt;" in report
    assert not re.search("<b>what|<script>alert", report)
    assert not re.search(r"(?:src|href)=.?https?:", report)
    moodle = {row["Full name"]: row for row in table(graded, "moodle.csv")}
    assert next(iter(moodle["Ann"])) == "Identifier"
    assert (moodle["Gus"]["Grade"], moodle["Gus"]["Email address"]) == ("", "gus@x.org")
    assert moodle["Bob"]["Feedback comments"].startswith("1 of 1 cases solved, beside 1 hidden case. 2 days late. enc")
    with zipfile.ZipFile(graded / "feedback.zip") as pages:
        assert sorted(pages.namelist()) == [f"{name}.html" for name in ("Gus", "ann", "bob", "carl", "dora", "frank")]
    for name in ("ann", "carl"):
        # Packed data may hold any three letters.
        page = re.sub(r"[\w+/=]{400,}", "", (graded / "feedback" / f"{name}.html").read_text())
        assert ("seed 1" in page, "hidden, seed" in page, "Bob" in page, "kiks replay" in page) == (True, *3 * (False,))


def test_the_report_opens_what_belongs_to_a_name(graded: Path, new_page: NewPage) -> None:
    page = new_page(1366, 768)
    for colours, width in (("light", 1366), ("dark", 390)):
        page.emulate_media(color_scheme=colours)
        page.set_viewport_size({"width": width, "height": 800})
        page.goto((graded / "report.html").as_uri())
        check_access(page, colours)
        for name in ("Ann", "Carl"):
            page.get_by_role("button", name=name, exact=True).click()
            expect(page.locator(".details:visible h2")).to_contain_text(name)
            page.frame_locator("iframe").get_by_role("button", name="Play").click()
            expect(page.locator("iframe")).to_have_count(1)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        leave_picture(page, f"grades_{colours}_{width}", full_page=True)
        expect(page.locator(".details:visible")).to_contain_text("ValueError: =1+1 <b>what</b>")
        page.get_by_role("button", name="Carl", exact=True).click()
        expect(page.locator(".details:visible")).to_have_count(0)
        page.goto((graded / "feedback" / "ann.html").as_uri())
        check_access(page, colours)
        page.frame_locator("iframe").get_by_role("button", name="Play").click()
        leave_picture(page, f"feedback_{colours}_{width}", full_page=True)


@needs_sandbox
def test_hostile_programs_are_named_and_cost_the_others_nothing(tmp_path: Path, graded: Path) -> None:
    project, out, before = exercise(tmp_path), tmp_path / "out", tmp_path / "before"
    with socket.create_server(("127.0.0.1", 0)) as server:
        target, port = out / "programs" / "ann" / "ann.py", server.getsockname()[1]
        neighbour = NEIGHBOUR.format(folder=tmp_path, target=target, port=port)
        programs = write(tmp_path / "class", {"ann": GOOD, "eve": neighbour, **HOSTILE})
        done = grade(project, programs, "--out", out)
    assert done.returncode == 0, done.stderr
    # Ann's run is the one that a class without them saw.
    assert replace(outcomes_of(out)["ann/1"], key="") == replace(outcomes_of(graded)["ann/1"], key="")
    rows = rows_of(out)
    assert rows["eve"]["said_last"] == "found []"
    for name, words in (("mallory", "processes"), ("oscar", "MB of memory"), ("trudy", "printed more than")):
        assert rows[name]["stopped"] == "1", rows[name]
        assert words in rows[name]["said_last"]
    points, crashed, stopped = (float(rows["victor"][column]) for column in ("points", "crashed", "stopped"))
    assert (points, crashed + stopped) == (0, 1)
    if AT_LENGTH:
        # In the same place: a traceback that a program prints names it.
        out.rename(before)
        assert grade(project, programs, "--out", out, "--workers", "1").returncode == 0
        for name in ("grades.csv", "moodle.csv", "outcomes.jsonl"):
            assert (before / name).read_bytes() == (out / name).read_bytes()


def test_ctrl_c_says_how_to_go_on(tmp_path: Path) -> None:
    programs = write(tmp_path / "class", {"ann": GOOD, "zoe": "while True: pass"})
    words = [exercise(tmp_path), programs, "--trusted", "--workers", "1", "--out", tmp_path / "out"]
    outcomes, begun = tmp_path / "out" / "outcomes.jsonl", tmp_path / "out" / "runs" / "zoe" / "1.mcap"
    line = python_line("-m", "kiks", "grade", *map(str, words))
    with subprocess.Popen(line, stderr=subprocess.PIPE, text=True) as run:
        wait_until(lambda: begun.exists() and outcomes.exists() and outcomes.read_bytes().count(b"}\n") >= 1)
        run.send_signal(signal.SIGINT)
        _, said = run.communicate(timeout=GUARD_S)
    assert run.returncode == 130
    assert "stopped after 1 of 2 runs. The same command goes on from there." in said
    assert "Traceback" not in said


def test_one_attempt_of_a_student_counts(tmp_path: Path) -> None:
    project = exercise(tmp_path)
    folders = [write(tmp_path / name, {"ann": text}) for name, text in (("late", "0"), ("early", GOOD), ("none", ""))]
    (folders[2] / "ann.py").rename(folders[2] / "ann.txt")
    for path, time_s in zip(folders, (DUE_S, DUE_S - 9, DUE_S + 9), strict=True):
        os.utime(next(path.iterdir()), (time_s, time_s))
    words = [project, *folders, "--trusted", "--out", tmp_path / "out"]
    assert "ann has 3 rows" in grade(*words).stderr
    for attempts, solved in (("best", "1"), ("last", "0")):
        assert grade(*words, "--attempts", attempts).returncode == 0
        assert [row["solved"] for row in table(tmp_path / "out", "grades.csv")] == [solved]
    done = grade(*words, "--max", "100")
    assert "--max must come with --full where the formula of points has no maximum" in done.stderr


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
    with alone_in(tmp_path / "out", "it", "outcomes.jsonl"):
        done = grade(project, programs, "--trusted", "--out", tmp_path / "out")
    assert done.returncode == 2
    assert "--out must belong to one run, but another one writes into" in done.stderr


def test_what_lies_in_a_folder_of_others_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "moodle.csv").write_text("the class")
    project = exercise(tmp_path)
    done = grade(project, write(tmp_path / "class", {"ann": GOOD}), "--trusted", "--out", tmp_path)
    assert done.returncode == 2
    assert "--out must be a new folder, an empty one, or that of an earlier run, but" in done.stderr
    assert (tmp_path / "moodle.csv").read_text() == "the class"


def test_without_a_sandbox_nothing_runs(tmp_path: Path) -> None:
    programs = write(tmp_path / "class", {"ann": GOOD})
    done = grade(exercise(tmp_path), programs, "--out", tmp_path / "out", PATH=str(tmp_path))
    assert (done.returncode, "bubblewrap" in done.stderr, "--trusted" in done.stderr) == (2, True, True)
    assert not (tmp_path / "out").exists()

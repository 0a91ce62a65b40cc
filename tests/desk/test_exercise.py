"""An exercise on the desk: its text, its lock, and a run of it."""

import io
import json
import re
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest
from tests.desk.visitor import FIRST_PICTURE, Visitor, check_access, check_reach, expect, make_project

from kiks.model.arena import Arena
from kiks.model.arena_objects import Lamp, Pose
from kiks.model.exercise import Cases, Exercise, cases_of
from kiks.model.goal import Goal
from kiks.model.project import Project
from kiks.sim.from_project import simulation_of
from kiks.sim.judge import Judge

TEXT = """Drive to the lamp.

<script>document.title = "attacked"</script> ![a plan](http://example.org/plan.png) [x](javascript:alert(1))

## Hint: how to begin

Set both wheels to 30.

## What counts

Time.
"""

DRIVE = """import time
import serial

with serial.Serial("/dev/ttyUSB0", 9600, timeout=1) as port:
    port.write(b"D,30,30\\n")
    port.readline()
    time.sleep(5)
"""


def make_exercise() -> Project:
    """Return an exercise in which a robot drives to a lamp, with two seeds and a hidden one."""
    box, cases = Arena.box(800, 400), (Cases(seed=(1, 2)), Cases("hidden", is_hidden=True))
    arena = Arena(box.brightness, box.mm_per_cell, "room", starts=(Pose(100, 200, 0.0),), lamps=(Lamp(700, 200),))
    goal = Goal("Reach the lamp", solved="light_mm < 120", failed="contacts > 0", points="10 * is_solved")
    exercise = Exercise("To the lamp", text=TEXT, template=DRIVE.replace("30,30", "0,0"))
    return Project(arena, seconds=20.0, cases=cases, goal=goal, exercise=exercise)


def test_text_loads_and_runs_nothing_and_takes_no_time() -> None:
    from kiks.desk.panels.exercise_text import parts_of

    parts = parts_of(TEXT)
    assert [part.hint for part in parts] == ["", "Hint: how to begin", ""]
    html = "".join(part.html for part in parts)
    assert not [each for each in ("<script", "<img", "href") if each in html]
    assert "<em>a plan</em>" in html
    # markdown-it would take a minute for these.
    for text in ("[" * 200_000, "![" * 100_000, "[a](" * 50_000):
        (part,) = parts_of(text)
        assert part.html == f"<p>\n{text}</p>\n"


@pytest.mark.slow
@pytest.mark.parametrize("project", [make_exercise()], ids=["exercise"])
def test_exercise_is_read_solved_tried_and_handed_in(visitor: Visitor, tmp_path: Path) -> None:
    from kiks.trials.hand_in import PAGE, PROGRAM, SCORE

    expect(visitor.at("exercise-text")).to_contain_text("Drive to the lamp")
    hint = visitor.page.get_by_text("Set both wheels to 30.")
    expect(hint).to_be_hidden()
    visitor.at("hint").click()
    expect(hint).to_be_visible()
    assert visitor.page.title() == "KiKS"
    assert (visitor.desk.is_paused, visitor.sim.now_ns) == (True, 0)

    visitor.tab("programs")
    expect(visitor.page.locator(".cm-content")).to_contain_text("D,0,0")
    for text, result in ((DRIVE.replace("sleep(5)", "sleep(0.4)"), "not solved after 0.4"), (DRIVE, "solved after 2.")):
        visitor.write(text)
        visitor.click("run-program", shows={"board-result": result})
        if text != DRIVE:
            visitor.told("All programs have ended. Goal not solved")
    expect(visitor.at("board-points")).to_have_text("10 points")
    assert ((tmp_path / "to_the_lamp.py").read_text(), visitor.desk.is_paused) == (DRIVE, True)

    visitor.click("tab-exercise", "try-all")
    expect(visitor.at("tries-state")).to_have_text("2 of 2 solved, 10 points.")
    check_access(visitor.page, "exercise")
    visitor.picture("exercise-tried")
    visitor.at("show-try-1").click()
    visitor.until(lambda: visitor.desk.past is not None and visitor.sim.seed == 2 and visitor.sim.time_s > 0.1)
    visitor.at("back-to-now").click()
    visitor.until(lambda: visitor.desk.past is None)
    assert visitor.sim.seed == 0
    with visitor.page.expect_download() as download:
        visitor.at("hand-in").click()
    file = download.value.path().read_bytes()
    assert download.value.suggested_filename == "to_the_lamp.zip"
    with zipfile.ZipFile(io.BytesIO(file)) as archive:
        assert (archive.read(PROGRAM), json.loads(archive.read(SCORE))["points"]) == (DRIVE.encode(), 10)
        assert archive.read(PAGE).startswith(b"<!DOCTYPE html>")
    given = []
    visitor.desk.hand_in = lambda data, name, is_again=False: given.append((name, data))
    visitor.page.reload()
    visitor.page.wait_for_function(FIRST_PICTURE)
    visitor.click("hand-in", told="Handed in. Now it is tried in all cases.")
    expect(visitor.at("tries-state")).to_have_text("Handed in. 2 of 2 solved, 10 points.")
    assert ([name for name, _ in given], given[1][1]) == (["to_the_lamp.zip"] * 2, file)
    visitor.desk.may_hand_in = False
    expect(visitor.at("hand-in")).to_be_disabled()

    lies = visitor.sim.pose(1)
    visitor.pull(lies[:2], (300, 200))
    expect(visitor.at("arena-notice")).to_contain_text("it is locked")
    visitor.page.mouse.up()
    visitor.tab("settings")
    expect(visitor.at("locked").locator("visible=true")).to_have_count(1)
    visitor.click("apply", told="it is locked")
    assert visitor.sim.pose(1) == lies


def test_formulas_of_the_page_can_be_judged() -> None:
    page = (Path(__file__).parents[2] / "docs" / "howto" / "exercises.md").read_text("utf-8")
    formulas = re.findall(r"^\| `(.+?)` \|", page[page.index("## Formulas") :], re.MULTILINE)
    assert len(formulas) > 15
    sim = simulation_of(replace(make_project(), seconds=1.0))
    for formula in formulas:
        Judge(sim, Goal(solved=formula))


def open_file(visitor: Visitor, typed: str, name: str) -> None:
    visitor.at("open-name").fill(typed)
    visitor.page.locator(".q-menu .q-item").get_by_text(name).click()
    visitor.at("open").click()


@pytest.mark.slow
def test_lecturer_saves_a_world_as_an_exercise_and_opens_it(visitor: Visitor, tmp_path: Path) -> None:
    expect(visitor.at("tab-exercise")).to_be_hidden()
    visitor.tab("programs")
    visitor.write(DRIVE)
    visitor.choose("dark", "Dark")
    visitor.tab("arena")
    visitor.at("save-exercise").click()
    visitor.fill({"exercise-title": "Find it", "exercise-text": TEXT})
    for typed, wrong in (("ligt_mm < 80", "Did you mean 'light_mm'?"), ("light_mm <", "must be a formula")):
        visitor.at("goal-solved").fill(typed)
        expect(visitor.page.get_by_text(wrong)).to_be_visible()
    check_access(visitor.page, "a wrong formula")
    visitor.click("dialog-yes", told="solved must be a formula")
    visitor.at("goal-solved").fill("light_mm < 80")
    expect(visitor.page.get_by_text("must be a formula")).to_have_count(0)
    visitor.fill({"limit": "30", "case-0-seed": "1..2", "case-0-start": "100, 100; 100, 300, 90"})
    visitor.at("add-case").click()
    visitor.at("case-1-family").fill("1, 2")
    visitor.at("case-1-is_hidden").click()
    visitor.page.mouse.move(5, 400)
    expect(visitor.page.locator(".q-tooltip")).to_have_count(0)
    check_access(visitor.page, "save as exercise")
    visitor.picture("save-as-exercise")
    visitor.page.set_viewport_size({"width": 390, "height": 844})
    check_reach(visitor.page, "save as exercise")
    visitor.picture("save-as-exercise-390")
    visitor.page.set_viewport_size({"width": 1366, "height": 768})
    visitor.at("exercise-name").fill("find")
    visitor.click("dialog-yes", told="Saved as find.kiks and find-students.kiks in ")

    made = Project.load(tmp_path / "find.kiks")
    assert made.exercise == Exercise("Find it", text=TEXT, template=DRIVE)
    assert (made.goal.solved, made.seconds) == ("light_mm < 80", 30)
    assert [len(cases_of([each])) for each in made.cases] == [4, 2]
    assert Project.load(tmp_path / "find-students.kiks").cases == made.cases[:1]

    # The dialog says what `kiks exercise check` finds.
    check = visitor.at("exercise-check")
    expect(check).to_contain_text("--solution PROGRAM", timeout=100_000)
    expect(check).to_contain_text("The template solves it.")
    visitor.at("goal-solved").fill("contacts == 0")
    visitor.click("dialog-yes")
    visitor.page.get_by_role("button", name="Yes").click()
    expect(check).to_have_text(
        re.compile("^The goal is solved before anything has moved, with 1 point"), timeout=100_000
    )
    check_access(visitor.page, "a checked exercise")
    visitor.picture("exercise-checked")
    visitor.at("dialog-no").click()

    open_file(visitor, "find-s", "find-students.kiks")
    expect(visitor.page.get_by_role("heading", name="Find it")).to_be_visible()
    visitor.tab("arena")
    visitor.click("save-exercise", told="it is locked")

    # An exercise in a folder has its text beside it, and so have the programs of other robots.
    folder = tmp_path / "third"
    folder.mkdir()
    made.for_students().save(folder / "exercise.kiks")
    (folder / "text.md").write_text("Here is **another** text.")
    open_file(visitor, "third", "third/exercise.kiks")
    expect(visitor.at("exercise-text")).to_contain_text("Here is another text.")

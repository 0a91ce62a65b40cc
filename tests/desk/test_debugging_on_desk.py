"""The debugger of the desk in a real browser: it stops programs, goes back, and changes nothing of a run."""

import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from tests.desk.test_exercise import make_exercise
from tests.desk.visitor import NewPage, Visitor, check_access, check_reach, expect, make_project
from tests.namespaces import needs_sandbox

from kiks.ports.program_command import ProgramCommand
from kiks.run import Run

pytestmark = pytest.mark.slow

TEXT = """import serial

port = serial.Serial("COM1", timeout=1)
seen = {"laps": 0, "last": [1, {"deep": (3, 4)}]}


def ask(command):
    port.write(command + b"\\n")
    return port.readline()


while seen:
    answer = ask(b"D,5,3")
    seen["laps"] += 1
    print("lap", seen["laps"])
"""

LINES = TEXT.split("\n")
LAPS, ASK = LINES.index('    seen["laps"] += 1') + 1, LINES.index("def ask(command):") + 2


@pytest.fixture
def project():
    """A run of a second: it ends while the program runs."""
    return replace(make_project(), seconds=1.0, speed=None)


def number(visitor: Visitor, line: int):
    """Return the number of a line in the margin."""
    return visitor.page.locator(".cm-lineNumbers .cm-gutterElement").get_by_text(str(line), exact=True)


def begin(visitor: Visitor, text: str = TEXT, line: int = LAPS) -> None:
    """Write a program with a breakpoint, and debug it up to there."""
    visitor.tab("programs")
    if visitor.desk.project.exercise is None:
        visitor.at("new-program").click()
        expect(visitor.at("name")).to_have_value("mine.py")
        visitor.at("name").fill("laps.py")
    visitor.write(text)
    visitor.page.keyboard.press("Control+Home")
    number(visitor, line).click()
    expect(visitor.page.locator(".program-breakpoint")).to_have_text(text.split("\n")[line - 1])
    visitor.click("debug-program", shows={"debug-state": f", line {line}: breakpoint"})
    expect(visitor.page.locator(".program-here")).to_have_text(text.split("\n")[line - 1])


def stands(visitor: Visitor, line: int, laps: int) -> None:
    """Wait until the page shows that the program stands at a line, with a count in a variable."""
    expect(visitor.at("debug-state")).to_contain_text(f", line {line}")
    expect(visitor.page.locator(".program-here")).to_have_text(LINES[line - 1])
    expect(visitor.at("debug-values")).to_contain_text(f"seen{{'laps': {laps}, 'last': [1, {{'deep': (3, 4)}}]}}")


def test_a_program_stops_steps_and_goes_back_and_its_run_stays_the_same(visitor: Visitor, tmp_path: Path) -> None:
    begin(visitor)
    stands(visitor, LAPS, 0)
    values, hashed = visitor.at("debug-values").inner_text(), visitor.sim.state_hash()
    check_access(visitor.page, "the debugger")
    check_reach(visitor.page, "the debugger")
    visitor.picture("debugger")
    # What is opened stays open at the next line.
    visitor.at("debug-values").locator("summary").filter(has_text="seen").click()
    expect(visitor.at("debug-values")).to_contain_text("'last'")
    visitor.page.keyboard.press("F10")
    stands(visitor, LAPS + 1, 1)
    expect(visitor.at("debug-values")).to_contain_text("'last'")
    expect(visitor.at("debug-values").locator(".is-new").first).to_have_text(
        "{'laps': 1, 'last': [1, {'deep': (3, 4)}]}"
    )
    visitor.at("debug-values").locator("summary").filter(has_text="seen").click()
    visitor.at("debug-back").click()
    stands(visitor, LAPS, 0)
    expect(visitor.at("debug-values")).to_have_text(values.replace("\n", ""))
    visitor.until(lambda: visitor.sim.state_hash() == hashed)
    # Into a function and out of it, and back to the breakpoint.
    visitor.click("debug-run")
    stands(visitor, LAPS, 1)
    for name, line in (("over", LAPS + 1), ("over", LAPS - 2), ("over", LAPS - 1), ("into", ASK)):
        visitor.click(f"debug-{name}", shows={"debug-state": f"laps.py, line {line}"})
    expect(visitor.at("debug-values")).to_contain_text("commandb'D,5,3'")
    visitor.choose("debug-frame", f"<module>, line {LAPS - 1}")
    expect(visitor.page.locator(".program-here")).to_have_text(LINES[LAPS - 2])
    expect(visitor.at("debug-values")).to_contain_text("'laps': 2")
    visitor.at("debug-out").click()
    stands(visitor, LAPS, 2)
    visitor.at("debug-rewind").click()
    stands(visitor, LAPS, 1)
    visitor.at("debug-when").fill("path_mm > 100")
    visitor.click("debug-before", told="has not become true in this run")
    # To the end.
    number(visitor, LAPS).click()
    expect(visitor.page.locator(".program-breakpoint")).to_have_count(0)
    visitor.click("debug-run", told="The project ends after 1 s")
    project = visitor.desk.project
    with Run(project, tmp_path, [ProgramCommand(tmp_path / "laps.py")]) as run:
        programs = run.take_programs(keeps_output=True)
        with run.limited(programs.end):
            programs.run()
        assert visitor.sim.now_ns == run.sim.now_ns == 10**9
        assert visitor.sim.state_hash() == run.sim.state_hash()


def test_a_drag_says_that_it_makes_another_run_and_a_running_program_is_paused(visitor: Visitor) -> None:
    begin(visitor)
    stands(visitor, LAPS, 0)
    x_mm, y_mm, _ = visitor.sim.pose(2)
    visitor.drag((x_mm, y_mm), (x_mm - 60, y_mm - 60))
    visitor.told("this is another run now")
    assert visitor.desk.programs.doubt == "a person has changed the world"
    visitor.click("debug-back", told="a person has changed the world")
    stands(visitor, LAPS, 0)
    number(visitor, LAPS).click()
    visitor.at("debug-run").click()
    expect(visitor.at("debug-run")).to_have_attribute("aria-label", "Pause")
    visitor.click("run-program", shows={"output": "lap"})  # begins again without the debugger
    expect(visitor.at("debug-state")).to_be_hidden()


def test_breakpoints_move_with_their_lines_and_have_a_key(visitor: Visitor) -> None:
    visitor.tab("programs")
    visitor.at("new-program").click()
    visitor.write("a = 1\nb = 2\nc = 3\n")
    points, keyboard = visitor.desk.debugging.breakpoints, visitor.page.keyboard
    visitor.page.locator(".cm-line").nth(1).click()
    keyboard.press("F9")
    visitor.until(lambda: points == {None: [2]})
    keyboard.press("Home")
    keyboard.press("Enter")
    visitor.until(lambda: points == {None: [3]})
    expect(visitor.page.locator(".program-breakpoint")).to_have_text("b = 2")
    visitor.page.reload()
    visitor.tab("programs")
    expect(visitor.page.locator(".program-breakpoint")).to_have_text("b = 2")
    visitor.page.locator(".cm-line").nth(2).click()
    keyboard.press("F9")
    visitor.until(lambda: points == {None: []})
    expect(visitor.page.locator(".program-breakpoint")).to_have_count(0)


def test_the_time_bar_tells_the_line_of_the_past_and_leads_there(visitor: Visitor) -> None:
    begin(visitor)
    for laps in (1, 2, 3, 4):
        visitor.at("debug-run").click()
        stands(visitor, LAPS, laps)
    visitor.at("time-slider").focus()
    visitor.page.keyboard.press("Home")
    visitor.until(lambda: visitor.desk.past is not None)
    visitor.page.keyboard.press("PageDown")
    visitor.at("back-to-now").click()
    visitor.page.keyboard.press("j")
    expect(visitor.at("back-to-line")).to_contain_text("laps.py, line ")
    expect(visitor.page.locator(".program-then")).to_have_count(1)
    line = visitor.at("back-to-line").inner_text().split("line ")[1].split()[0]
    check_access(visitor.page, "a line of the past")
    visitor.at("back-to-line").click()
    expect(visitor.at("debug-state")).to_contain_text(f"laps.py, line {line}")
    assert visitor.desk.past is None


SHORT = """import serial
import time

with serial.Serial("COM1", timeout=1) as port:
    port.write(b"D,30,30\\n")
    time.sleep(0.8)
"""


def test_one_goes_back_from_the_end_of_a_program(visitor: Visitor) -> None:
    begin(visitor, SHORT, line=5)
    visitor.click("debug-run", shows={"debug-state": ": the end."})
    visitor.at("debug-when").fill("path_mm > 50")
    visitor.click("debug-before", shows={"debug-state": "laps.py, line 6"})
    assert visitor.sim.time_s < 0.1  # where the program had been since
    visitor.click("debug-run", shows={"debug-state": ": the end."})
    visitor.click("debug-back")
    expect(visitor.at("debug-state")).to_have_text("laps.py, line 4")  # not the end, which is there, too
    visitor.click("debug-rewind", shows={"debug-state": "laps.py, line 5"})
    visitor.click("debug-run", shows={"debug-state": ": the end."})
    visitor.click("debug-run", shows={"programs": "ended with exit code 0"})
    expect(visitor.at("debug-state")).to_be_hidden()


def test_where_the_run_has_ended_a_program_goes_on_to_its_next_line_to_go_back(visitor: Visitor) -> None:
    begin(visitor)
    number(visitor, LAPS).click()
    visitor.click("debug-run", told="The project ends after 1 s")
    visitor.at("debug-when").fill("0.5")
    visitor.at("debug-before").click()
    visitor.until(lambda: visitor.desk.debugging.stop is not None and 0.4 < visitor.sim.time_s <= 0.5)
    expect(visitor.at("debug-state")).to_contain_text("laps.py, line ")


@pytest.fixture
def student(tmp_path: Path, new_page: NewPage) -> Iterator[Visitor]:
    """A student's desk with a locked exercise, as in a room."""
    from kiks.desk.server.desk import Desk
    from kiks.desk.server.rights import Rights
    from kiks.desk.server.show import Shown
    from kiks.ports.sandbox import Sandbox, SandboxLimits

    project = replace(make_exercise(), seconds=1.0)
    project = replace(project, exercise=replace(project.exercise, is_locked=True))
    with Sandbox([tmp_path], limits=SandboxLimits(waiting_s=1.0)) as sandbox:
        shown = Shown(Desk(Run.of(project, tmp_path, sandbox=sandbox), Rights.STUDENT, folder=tmp_path), port=0)
        with closing(shown):
            shown.desk.begin()
            shown.drive()
            yield Visitor(new_page(), shown)


@needs_sandbox
def test_a_student_debugs_in_a_locked_exercise_for_longer_than_a_program_may_wait(student: Visitor) -> None:
    begin(student)
    stands(student, LAPS, 0)
    begin_s = time.monotonic()
    student.until(lambda: time.monotonic() > begin_s + 2.0)
    student.at("debug-over").click()
    stands(student, LAPS + 1, 1)
    student.at("debug-back").click()
    stands(student, LAPS, 0)
    number(student, LAPS).click()
    student.click("debug-run", told="Goal")

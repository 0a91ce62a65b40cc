"""The panels of programs and of the wire in a real browser, compared with the state of the engine."""

from contextlib import closing
from pathlib import Path

import pytest
from tests.at_length import at_length
from tests.desk.visitor import NewPage, Visitor, check_access, expect, open_desk

from kiks.desk.server.rights import Rights

pytestmark = pytest.mark.slow

FOR_EVER = """import serial
port = serial.Serial("COM1", timeout=1)
port.write(b"D,5,5\\n")
print("begun", port.readline())
while True:
    port.write(b"N\\n")
    port.readline()
"""


def begin_program(visitor: Visitor, name: str, text: str) -> None:
    """Write a new program, without starting it."""
    visitor.tab("programs")
    visitor.at("new-program").click()
    visitor.at("name").fill(name)
    visitor.write(text)


@at_length
def test_loop_that_asks_for_nothing_is_told_on_the_page_while_time_stands_still(visitor: Visitor) -> None:
    begin_program(visitor, "endless", "print('begun', flush=True)\nready = False\nwhile not ready:\n    pass\n")
    visitor.click("run-program", shows={"output": "begun"})
    expect(visitor.at("output")).to_contain_text("has computed for 6 s without waiting for a time or a robot")
    visitor.click("stop", shows={"programs": "stopped"})


def test_program_is_written_saved_run_and_stopped(visitor: Visitor) -> None:
    begin_program(visitor, "mine", FOR_EVER)
    visitor.page.keyboard.press("Control+Enter")
    expect(visitor.at("output")).to_contain_text("begun b'd\\r\\n'")
    assert ((visitor.desk.folder / "mine.py").read_text(), visitor.setpoints()) == (FOR_EVER, [5, 5])
    visitor.tab("wire")
    expect(visitor.at("share-link")).not_to_contain_text("Link 0.0 %")
    visitor.send("H")
    expect(visitor.at("console-log")).to_contain_text("← h,")  # between two commands of the program
    visitor.tab("programs")
    visitor.click("stop", shows={"programs": "mine.py on robot 1: stopped"})
    visitor.until(lambda: visitor.setpoints() == [0, 0])


def test_a_program_that_ran_is_saved_with_the_project_and_shown_when_that_is_opened(visitor: Visitor) -> None:
    visitor.tab("programs")
    expect(visitor.at("name")).to_have_value("first_steps.py")  # an example
    expect(visitor.at("attached")).to_contain_text("no program yet")
    begin_program(visitor, "exercise1", FOR_EVER)
    visitor.at("arguments").fill("--fast 'a b'")
    visitor.click("run-program", shows={"attached": "exercise1.py starts with this world on robot 1."})
    visitor.tab("arena")
    saved = visitor.save_as("lesson")
    robot = saved.robots[0]
    assert (saved.arena.name, robot.program, robot.arguments) == ("lesson", "exercise1.py", ("--fast", "a b"))
    visitor.tab("programs")
    visitor.click("leave-out", shows={"attached": "no program yet"})
    visitor.at("new-program").click()
    visitor.tab("arena")
    visitor.choose("open-name", "lesson.kiks")
    visitor.click("open", told="Opened lesson")
    visitor.tab("programs")
    expect(visitor.at("editor")).to_contain_text("begun")
    expect(visitor.at("name")).to_have_value("exercise1.py")
    expect(visitor.at("arguments")).to_have_value("--fast 'a b'")
    expect(visitor.at("programs")).to_contain_text("exercise1.py on robot 1: running")

    visitor.page.reload()
    visitor.tab("programs")
    expect(visitor.at("name")).to_have_value("exercise1.py")
    for text in ("# the first draft", "# the second draft"):  # what is not saved is there on the next page, too
        visitor.write(text)
        visitor.until(lambda text=text: text in visitor.desk.drafts.values())
        visitor.page.reload()
        visitor.tab("programs")
        expect(visitor.at("editor")).to_contain_text(text)
        visitor.at("new-program").click()
        expect(visitor.at("editor")).not_to_contain_text(text)


def test_a_program_does_not_start_after_halt_while_it_is_saved(
    visitor: Visitor, monkeypatch: pytest.MonkeyPatch
) -> None:
    from kiks.desk.panels.programs import ProgramsPanel

    command = ProgramsPanel.command

    async def halted(panel: ProgramsPanel) -> object:
        saved = await command(panel)
        await panel._desk.halt()
        return saved

    begin_program(visitor, "late", FOR_EVER)
    monkeypatch.setattr(ProgramsPanel, "command", halted)
    visitor.click("run-program", told="late.py was not started: Halt was pressed.")
    assert (visitor.desk.folder / "late.py").read_text() == FOR_EVER
    assert visitor.desk.programs.handles == []


def test_mistake_is_marked_as_it_is_typed_and_before_anything_runs(visitor: Visitor) -> None:
    begin_program(visitor, "wrong.py", "x = 1\nif x = 2:\n    pass\n")
    expect(visitor.at("mistake")).to_contain_text("Line 2: invalid syntax")
    expect(visitor.page.locator(".program-wrong-line")).to_have_text("if x = 2:")
    expect(visitor.page.locator(".program-wrong")).to_have_text("x = 2")
    visitor.picture("mistake")
    visitor.click("run-program", shows={"mistake": "Line 2: invalid syntax"})
    check_access(visitor.page, "a mistake")
    assert not (visitor.desk.folder / "wrong.py").exists()
    visitor.write("x = 1\n1 / 0\n")
    expect(visitor.at("mistake")).to_have_text("")
    expect(visitor.page.locator(".program-wrong-line")).to_have_count(0)
    visitor.click("run-program", shows={"output": "ZeroDivisionError: division by zero"})
    expect(visitor.at("output")).to_contain_text("line 2, in <module>")


@at_length
def test_console_has_history_and_suggestions_and_the_wire_is_filtered_held_and_cleared(visitor: Visitor) -> None:
    visitor.pause()
    visitor.tab("wire")
    console = visitor.at("console")
    expect(visitor.at("hints")).to_contain_text("D,left,right: set speed")
    console.fill("d,3")
    expect(visitor.at("hints")).to_have_text("D,left,right: set speed (pulses/10 ms, -127..127, clamped)")
    console.fill("D,3,4")
    console.press("Enter")
    expect(visitor.at("console-log")).to_contain_text("→ D,3,4")
    visitor.told("Time is paused")
    expect(visitor.at("console-log")).not_to_contain_text("←")
    visitor.click("run", shows={"console-log": "← d"})
    assert visitor.setpoints() == [3, 4]
    console.fill("D,0,0")
    console.press("Enter")
    expect(console).to_have_value("")
    for key, text in (("ArrowUp", "D,0,0"), ("ArrowUp", "D,3,4"), ("ArrowDown", "D,0,0")):
        console.press(key)
        expect(console).to_have_value(text)
    # The list of what goes over the line.
    wire = visitor.at("wire")

    def send(text: str) -> None:
        visitor.send(text)
        expect(console).to_have_value("")

    send("E")
    expect(wire).to_contain_text("→ E\\n")
    visitor.at("wire-filter").fill("H")
    expect(wire).not_to_contain_text("E\\n")
    send("H")
    expect(wire).to_contain_text("→ H\\n")
    visitor.at("wire-filter").fill("")
    expect(wire).to_contain_text("→ E\\n")
    visitor.at("wire-hold").click()
    send("B")
    expect(visitor.at("console-log")).to_contain_text("← b,")
    expect(wire).not_to_contain_text("B\\n")
    visitor.at("wire-hold").click()
    expect(wire).to_contain_text("→ B\\n")
    visitor.at("wire-clear").click()
    expect(wire).to_have_text("")
    # The line is watched only while the panel is visible.
    assert [wire.log is not None for wire in visitor.sim.wires] == [True, False]
    visitor.tab("arena")
    visitor.until(lambda: not any(wire.log is not None for wire in visitor.sim.wires))


@pytest.mark.parametrize(
    ("owns_world", "reason", "other"),
    [(True, "the desk is open to other computers", ""), (False, "Another program owns this world", "No program runs")],
)
def test_a_page_that_may_not_start_programs_tells_why(owns_world, reason, other, new_page: NewPage, tmp_path: Path):
    with closing(open_desk(tmp_path, rights=Rights(owns_world=owns_world))) as shown:
        visitor = Visitor(new_page(), shown)
        visitor.click("tab-programs", shows={"may-not": reason})
        if other:
            expect(visitor.at("programs")).not_to_contain_text(other)
        assert visitor.at("run-program").count() == 0

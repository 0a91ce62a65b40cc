"""The panels of programs and of the wire in a real browser (panels_page.py)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect
from tests.at_length import at_length
from tests.desk.visits import NewPage, address_of

pytestmark = pytest.mark.slow

FOR_EVER = """import serial
port = serial.Serial("COM1", timeout=1)
port.write(b"D,5,5\\n")
print("begun", port.readline())
while True:
    port.write(b"N\\n")
    port.readline()
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("folder")


@pytest.fixture(scope="module")
def address(folder: Path) -> Iterator[str]:
    with address_of("panels_page", str(folder), "may") as address:
        yield address


@pytest.fixture
def page(new_page: NewPage, address: str) -> Page:
    page = new_page(900, 1000)
    page.goto(address)
    expect(editor(page)).to_contain_text("First steps")
    return page


def at(page: Page, name: str) -> Locator:
    return page.get_by_test_id(name)


def editor(page: Page) -> Locator:
    return page.locator(".cm-content")


def write(page: Page, text: str) -> None:
    """Put a text into the editor as if it were pasted: no brackets and indents of the editor's own."""
    editor(page).click()
    page.keyboard.press("Control+a")
    page.keyboard.insert_text(text)


def speeds(page: Page, address: str) -> list[list[int]]:
    found: list[list[int]] = page.request.get(f"{address}/speeds").json()
    return found


@at_length
def test_loop_that_asks_for_nothing_is_told_on_the_page_while_time_stands_still(page: Page) -> None:
    at(page, "new-program").click()
    at(page, "name").fill("endless")
    write(page, "print('begun', flush=True)\nready = False\nwhile not ready:\n    pass\n")
    at(page, "run-program").click()
    expect(at(page, "output")).to_contain_text("begun")
    expect(at(page, "output")).to_contain_text("has computed for 6 s without waiting for a time or a robot")
    at(page, "stop").click()
    expect(at(page, "programs")).to_contain_text("stopped")


def test_program_is_written_saved_run_and_stopped(page: Page, address: str, folder: Path) -> None:
    at(page, "new-program").click()
    at(page, "name").fill("mine")
    write(page, FOR_EVER)
    page.keyboard.press("Control+Enter")
    expect(at(page, "output")).to_contain_text("begun b'd\\r\\n'")
    assert (folder / "mine.py").read_text() == FOR_EVER
    assert speeds(page, address)[0] == [5, 5]
    expect(at(page, "share-link")).not_to_contain_text("Link 0.0 %")
    at(page, "console").fill("H")
    at(page, "console").press("Enter")
    expect(page.locator(".q-notification")).to_contain_text("line of robot 1 must be free")
    at(page, "stop").click()
    expect(at(page, "programs")).to_contain_text("mine.py on robot 1: stopped")
    at(page, "console").press("Enter")
    expect(at(page, "console-log")).to_contain_text("← h,")
    assert speeds(page, address)[0] == [0, 0]


def test_mistake_is_shown_by_its_line_before_anything_runs(page: Page, folder: Path) -> None:
    at(page, "new-program").click()
    at(page, "name").fill("wrong.py")
    write(page, "x = 1\nif x = 2:\n    pass\n")
    at(page, "run-program").click()
    expect(at(page, "mistake")).to_contain_text("Line 2: invalid syntax")
    assert not (folder / "wrong.py").exists()
    write(page, "x = 1\n1 / 0\n")
    expect(at(page, "mistake")).to_have_text("")
    at(page, "run-program").click()
    expect(at(page, "output")).to_contain_text("ZeroDivisionError: division by zero")
    expect(at(page, "output")).to_contain_text("line 2, in <module>")


@at_length
def test_console_has_history_suggestions_and_replies(page: Page, address: str) -> None:
    console = at(page, "console")
    expect(at(page, "hints")).to_contain_text("D,left,right: set speed")
    console.fill("d,3")
    expect(at(page, "hints")).to_have_text("D,left,right: set speed (pulses/10 ms, -127..127, clamped)")
    page.request.get(f"{address}/pause")
    console.fill("D,3,4")
    console.press("Enter")
    expect(at(page, "console-log")).to_contain_text("→ D,3,4")
    expect(page.locator(".q-notification")).to_contain_text("Time is paused")
    expect(at(page, "console-log")).not_to_contain_text("←")
    page.request.get(f"{address}/go-on")
    expect(at(page, "console-log")).to_contain_text("← d")
    assert speeds(page, address)[0] == [3, 4]
    console.fill("D,0,0")
    console.press("Enter")
    expect(console).to_have_value("")
    console.press("ArrowUp")
    expect(console).to_have_value("D,0,0")
    console.press("ArrowUp")
    expect(console).to_have_value("D,3,4")
    console.press("ArrowDown")
    expect(console).to_have_value("D,0,0")


@at_length
def test_wire_is_filtered_held_and_cleared(page: Page) -> None:
    console, wire = at(page, "console"), at(page, "wire")

    def send(text: str) -> None:
        console.fill(text)
        console.press("Enter")
        expect(console).to_have_value("")

    send("E")
    expect(wire).to_contain_text("→ E\\n")
    at(page, "wire-filter").fill("H")
    expect(wire).not_to_contain_text("E\\n")
    send("H")
    expect(wire).to_contain_text("→ H\\n")
    at(page, "wire-filter").fill("")
    expect(wire).to_contain_text("→ E\\n")
    at(page, "wire-hold").click()
    send("B")
    expect(at(page, "console-log")).to_contain_text("← b,")
    expect(wire).not_to_contain_text("B\\n")
    at(page, "wire-hold").click()
    expect(wire).to_contain_text("→ B\\n")
    at(page, "wire-clear").click()
    expect(wire).to_have_text("")


@at_length
def test_line_is_watched_only_while_the_panel_is_visible(new_page: NewPage, tmp_path: Path) -> None:
    with address_of("panels_page", str(tmp_path), "may") as address:
        page = new_page()
        page.goto(address)
        expect(editor(page)).to_contain_text("First steps")
        seen = "(fact) => fetch('/watched').then(a => a.json()).then(a => JSON.stringify(a) === fact)"
        page.wait_for_function(seen, arg="[true,false]", polling=100)
        page.goto(f"{address}/speeds")
        page.wait_for_function(seen, arg="[false,false]", polling=100)
        page.close()


def test_page_of_a_public_desk_starts_no_programs(new_page: NewPage, tmp_path: Path) -> None:
    with address_of("panels_page", str(tmp_path), "may-not") as address:
        page = new_page()
        page.goto(address)
        expect(at(page, "may-not")).to_contain_text("cannot start programs from this page")
        assert at(page, "run-program").count() == 0
        page.close()

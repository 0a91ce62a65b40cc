"""The desk of a session in a real browser, with a real Octave at a terminal."""

import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.at_length import at_length, share
from tests.desk.visitor import FIRST_PICTURE, NewPage, Page, check_access, expect, leave_picture
from tests.forked import kiks_command
from tests.matlab.octave import need_tcp, needs_octave
from tests.matlab.terminal import Terminal

pytestmark = [needs_octave, pytest.mark.slow]

SPEEDS = "() => import('kiks-desk').then(({ pageFeed }) => pageFeed().frame.robot(0).speeds.map(Math.abs))"
STANDS = f"async () => (await ({SPEEDS})()).every((speed) => speed === 0)"
DRIVES = f"async () => (await ({SPEEDS})()).some((speed) => speed > 1)"


def terminal_in(folder: Path, **environment: str) -> Terminal:
    own = {"KIKS_COMMAND": " ".join(kiks_command()), "KIKS_WINDOW": "1", **environment}
    return Terminal(folder, own, edits_lines=True)


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    with terminal_in(tmp_path) as each:
        yield each


def begin(terminal: Terminal, new_page: NewPage, command="kiks", fact=FIRST_PICTURE, then="ref = kiks_kopen;") -> Page:
    """Open the desk that a command shows, here that of a session; wait for a fact of it, and type another command."""
    terminal.type(command)
    page = new_page()
    page.goto(terminal.wait_for(r"shown at http\S+").split()[-1])
    page.wait_for_function(fact)
    terminal.type(then)
    return page


def evaluate(page: Page, command: str) -> None:
    page.get_by_test_id("octave").fill(command)
    page.get_by_test_id("octave").press("Enter")


def drive_and_halt(terminal: Terminal, page: Page, loop: str) -> None:
    """Halt a program that drives, and check that it is told, that the robot stands, and that the port opens again."""
    terminal.type(f"kSetSpeed(ref, 5, 5), {loop}")
    page.wait_for_function(DRIVES)
    page.get_by_test_id("halt").click()
    terminal.wait_for("error: Simulation halted: Halt was pressed on the desk")
    page.wait_for_function(STANDS)
    assert terminal.ask("isempty(kiks_ktime(-1))") == "1"
    terminal.type("ref = kiks_kopen;")
    assert terminal.ask("numel(kProximity(ref))") == "8"


@at_length
def test_halt_stops_a_program_of_octave(terminal: Terminal, new_page: NewPage) -> None:
    page = begin(terminal, new_page)
    loops = "while true, kProximity(ref); end", "kiks_pause(1e5)", "while kiks_ktime(-1) < 1e5, end"
    for loop in share(loops[:1], loops):
        drive_and_halt(terminal, page, loop)
    # At the prompt there is no program to be told.
    terminal.type("kSetSpeed(ref, 5, 5)")
    page.wait_for_function(DRIVES)
    page.get_by_test_id("halt").click()
    page.wait_for_function(STANDS)
    assert terminal.ask("7") == "7"
    assert not terminal.has_printed("halted")


@at_length
def test_halt_reaches_a_program_that_speaks_tcp(tmp_path: Path, new_page: NewPage) -> None:
    """As MATLAB does."""
    need_tcp()
    with terminal_in(tmp_path, KIKS_TRANSPORT="tcp") as terminal:
        page = begin(terminal, new_page)
        drive_and_halt(terminal, page, "kiks_pause(1e5)")


@at_length
def test_what_is_typed_on_the_desk_is_evaluated_in_octave(tmp_path: Path, new_page: NewPage) -> None:
    # Ctrl-C reaches a session that is a process of its own.
    with terminal_in(tmp_path, KIKS_COMMAND=f"{sys.executable} -m kiks") as terminal:
        page = begin(terminal, new_page)
        terminal.type("kiks_print('half way')")
        expect(page.locator(".desk-hint")).to_contain_text("half way")
        page.get_by_test_id("tab-octave").click()
        expect(page.get_by_test_id("log")).to_contain_text("The world is shown at")
        expect(page.get_by_test_id("log")).not_to_contain_text("token")
        before = terminal.ask("hex2dec(kiks('--state')(1:8))")
        # At the prompt, in the middle of a line that a person types.
        os.write(terminal.end, b"y = x +")
        evaluate(page, "x = 6 * 7")
        expect(page.get_by_test_id("log")).to_contain_text("x = 42")
        terminal.wait_for("x = 42")
        terminal.type(" 1")
        assert terminal.ask("y") == "43"
        assert terminal.ask("hex2dec(kiks('--state')(1:8))") == before, "polls let no time pass"
        # In a program, with functions of KiKS and with errors.
        terminal.type("while true, kProximity(ref); end")
        evaluate(page, "kSetSpeed(ref, 3, 4); z = kGetSpeed(ref);")
        page.wait_for_function(DRIVES)
        evaluate(page, "error('no %d', 1), end")
        expect(page.get_by_test_id("log")).to_contain_text("parse error")
        evaluate(page, "error('no %d', 2)")
        expect(page.get_by_test_id("log")).to_contain_text("error: no 2")
        for colours in ("light", "dark"):
            page.emulate_media(color_scheme=colours)
            check_access(page, f"octave, {colours}")
            leave_picture(page, f"octave_{colours}")
        terminal.press_ctrl_c()
        assert terminal.ask("numel(z)") == "2"
        assert terminal.ask("numel(kProximity(ref))") == "8"
        # It may even end the session: here when the page is closed, which would miss the desk.
        terminal.type("fread(stdin, 1);")
        evaluate(page, "kiks_quit")
        expect(page.get_by_test_id("log")).to_contain_text(">> kiks_quit")
        page.close()
        terminal.type("")
        terminal.wait_for("The KiKS session has ended")
        assert terminal.ask("7") == "7"
        assert terminal.sessions() == []


def test_log_places_and_sensors_are_those_of_octave(terminal: Terminal, new_page: NewPage) -> None:
    page = begin(terminal, new_page)
    terminal.type("here = kiks_siminfo_robotpos;")
    x, y = float(terminal.ask("here(1)")), float(terminal.ask("here(2)"))
    expect(page.get_by_test_id("facts")).to_contain_text(f"x {x:.1f}, y {y:.1f} mm")
    expect(page.locator(".kiks-chip-name").first).to_have_text("1")
    page.get_by_test_id("proximity-7").click()
    expect(page.get_by_test_id("explanation-text")).to_contain_text(re.compile(r"^Sensor 8 \(back left\)"))
    # `kiks_status` may replace a line of the log.
    page.get_by_test_id("tab-octave").click()
    log = page.get_by_test_id("log")
    terminal.type("kiks_status('first'), kiks_status('1 of 9')")
    expect(log).to_contain_text("1 of 9")
    terminal.type("kiks_status('2 of 9', 0, 1), kiks_status('9 of 9', 0, 1), kiks_status('last')")
    expect(log).to_contain_text("last")
    expect(log).to_have_text(re.compile(r"first[\s\d:]+ 9 of 9[\s\d:]+ last\s*$"))
    expect(page.locator(".desk-hint")).to_contain_text("last")


@at_length
def test_desk_shows_a_world_without_a_robot_and_then_the_robot(terminal: Terminal, new_page: NewPage) -> None:
    drawn = "() => window.kiksDesk?.stats().frames_drawn > 3"
    page = begin(terminal, new_page, "kiks_arena([], [], 1)", drawn, "")
    for tab in ("wire", "programs", "settings", "robot"):
        page.get_by_test_id(f"tab-{tab}").click()
        # The page ignores a click on the tab that it shows until the server has answered the click before it.
        expect(page.get_by_test_id(f"tab-{tab}")).to_have_attribute("aria-selected", "true")
    terminal.type("kiks_spawn(2)")
    terminal.type("ref = kiks_kopen; kSetSpeed(ref, 2, 2)")
    page.wait_for_function(FIRST_PICTURE)
    expect(page.get_by_test_id("monitor-robot")).to_have_value("robot 1")
    page.wait_for_function(DRIVES)
    page.get_by_test_id("tab-wire").click()
    expect(page.get_by_test_id("wire-robot")).to_have_value("robot 1")

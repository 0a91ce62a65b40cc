"""The desk in a real browser: the tabs beside the arena, compared with the state of the engine."""

import math
import re
from collections import deque
from contextlib import closing

import pytest
from tests.at_length import at_length
from tests.desk.visitor import Visitor, expect

from kiks.ports.programs import Programs
from kiks.sim.simulation import Simulation

pytestmark = pytest.mark.slow


def test_typed_command_drives_the_robot_and_appears_on_the_wire(visitor: Visitor) -> None:
    visitor.tab("wire")
    visitor.send("D,10,15")
    visitor.until(lambda: visitor.setpoints() == [10, 15])
    visitor.until(lambda: math.dist(visitor.sim.pose(1)[:2], (150, 200)) > 5)
    visitor.shows({"console-log": "← d", "wire": "→ D,10,15\\n"})
    expect(visitor.at("wire")).to_contain_text("← d\\r\\n")
    expect(visitor.at("wire-bar")).to_have_attribute("aria-label", re.compile("Link .* Robot .* Waiting"))
    visitor.picture("wire")
    visitor.send("D,0,0")
    visitor.until(lambda: visitor.setpoints() == [0, 0])


AT_ONCE = """([input, ...texts]) => {
    for (const text of texts) {
        input.value = text;
        input.dispatchEvent(new Event("input"));
        input.dispatchEvent(new KeyboardEvent("keydown", { key: "Enter", bubbles: true }));
    }
    input.value = "D,7,";
    input.dispatchEvent(new Event("input"));
}"""
"""Types commands, and half of another one, before the page has been answered."""


@at_length
def test_commands_typed_faster_than_the_page_is_answered_all_arrive(visitor: Visitor) -> None:
    visitor.tab("wire")
    texts = [f"C,{k},{k}" for k in range(5)] + ["D,7,8"]
    visitor.page.evaluate(AT_ONCE, [visitor.at("console").element_handle(), *texts])
    visitor.until(lambda: visitor.setpoints() == [7, 8])
    for text in texts:
        expect(visitor.at("console-log")).to_contain_text(f"→ {text}")
    expect(visitor.at("console")).to_have_value("D,7,")
    visitor.at("console").press("ArrowUp")
    expect(visitor.at("console")).to_have_value("D,7,8")


COVERED = """() => {
    const box = (element) => element.getBoundingClientRect();
    const tip = box(document.querySelector(".q-tooltip"));
    const others = ".q-tab, .desk-panels :is(button, input, .q-field), .desk-bar button, .kiks-bar";
    return [...document.querySelectorAll(others)].filter((other) => other.checkVisibility()).filter((other) => {
        const { left, right, top, bottom } = box(other);
        return left < tip.right && right > tip.left && top < tip.bottom && bottom > tip.top;
    }).length;
}"""


def test_tooltips_cover_no_control(visitor: Visitor) -> None:
    visitor.tab("arena")
    for name in ("tool-line", "snap", "save", "film", "event-before", "bookmark", "step", "help"):
        visitor.at(name).hover()
        expect(visitor.page.locator(".q-tooltip")).to_have_count(1)
        expect(visitor.page.locator(".q-tooltip")).to_have_css("opacity", "1")
        assert visitor.answer(COVERED) == 0, name


def test_programs_are_looked_at_with_the_lock_under_which_halt_drops_their_requests() -> None:
    """Else the thread that moves the world would end in an error, and a robot would drive on."""
    sim = Simulation()
    were_locked: list[bool] = []

    class Requests(deque):
        def __bool__(self) -> bool:
            were_locked.append(sim.lock._is_owned())
            return False

    with closing(Programs(sim)) as programs:
        programs.admit("a program for which the world does not wait", 1)._requests = Requests()
        assert not programs.drive
    assert set(were_locked) == {True}


def test_halt_stops_programs_and_robots(visitor: Visitor) -> None:
    """A robot drives on only if the thread that moves the world has ended, which `until` would tell.

    Halt puts a stop on each line, with the lock. What the program of robot 1 sends later comes before the stop of
    `_free_robots`, the last that its line gets: a program that has left is not heard. The page says "stopped" when the
    program has left; then time runs at least until all commands on the way have acted (`ProgramScheduler.finish`). An
    event is lost only without the lock, and all that sends or moves time has it.
    """
    visitor.tab("wire")
    visitor.choose("wire-robot", "robot 2")
    visitor.send("D,4,4")
    visitor.tab("programs")
    visitor.choose("script", "example: avoid")
    expect(visitor.page.locator(".cm-content")).to_contain_text("Braitenberg")
    visitor.at("run-program").click()
    visitor.until(lambda: visitor.setpoints() != [0, 0] and visitor.setpoints(2) == [4, 4])
    visitor.click("halt", told="All programs and all robots are stopped.")
    expect(visitor.at("programs")).to_contain_text("avoid.py on robot 1: stopped")
    visitor.until(lambda: visitor.setpoints() == visitor.setpoints(2) == [0, 0])


@at_length
def test_places_and_sensors_in_the_coordinates_of_kiks_2(visitor: Visitor) -> None:
    """From the upper left corner of 600 x 400 mm; x and y count from 1 in the middle of the first millimetre."""
    expect(visitor.at("facts")).to_contain_text("x 150.0, y 200.0 mm")
    # A click on a sensor in the arena explains its reading.
    x_mm, y_mm, heading_rad = visitor.sim.pose(1)
    visitor.page.mouse.click(*visitor.on_page(x_mm, y_mm))
    angle = heading_rad + math.radians(66.4)
    visitor.page.mouse.click(*visitor.on_page(x_mm + 24 * math.cos(angle), y_mm + 24 * math.sin(angle)))
    expect(visitor.at("explanation")).to_contain_text("Sensor 0 (left 90) of robot 1")
    visitor.tab("settings")
    visitor.at("old-coordinates").click()
    visitor.tab("robot")
    expect(visitor.at("facts")).to_contain_text("x 150.5, y 200.5 mm")
    visitor.page.mouse.click(*visitor.on_page(450, 300))
    expect(visitor.at("facts")).to_contain_text("x 450.5, y 100.5 mm")
    expect(visitor.page.locator(".kiks-chip-name").last).to_have_text("8")
    visitor.click("proximity-0", shows={"explanation-text": "Sensor 1 (left 90) of robot 2"})


def test_applying_settings_restarts_the_world(visitor: Visitor) -> None:
    visitor.drag((150, 200), (250, 250))
    old = visitor.sim
    visitor.tab("settings")
    visitor.at("seed").fill("42")
    visitor.choose("model", "fast: a table of those networks")
    visitor.choose("baud", "38400")
    visitor.choose("link", "wifi")
    visitor.click("noise", "add-robot")
    visitor.picture("settings")
    visitor.click("apply", told="Restarted with these settings.")
    assert visitor.sim is not old
    project = visitor.desk.project
    assert (project.seed, project.response, project.baud, project.noise) == (42, "fast", 38400, False)
    assert (visitor.sim.seed, visitor.sim.robot_count, visitor.sim.link) == (42, 3, "wifi")
    assert visitor.sim.pose(1)[:2] == pytest.approx((250, 250), abs=1)
    visitor.page.wait_for_function("() => kiksDesk.scene().robots.length === 3 && kiksDesk.pose(2)")
    visitor.click("start-over", told="Started over.")
    assert visitor.sim.robot_count == 3
    expect(visitor.at("seed")).to_have_value("42")
    visitor.picture("another_world")
    old = visitor.sim
    visitor.at("seed").fill("1.5")
    visitor.click("apply", told="Seed must be a whole number of at least 0, but it was 1.5.")
    visitor.picture("wrong_setting")
    for typed in ("-1", "42"):  # what is typed stays, also after it was left and the page has answered
        visitor.at("seed").fill(typed)
        visitor.click("add-robot")
        expect(visitor.page.get_by_label("Name", exact=True)).to_have_count(4 + (typed == "42"))
        expect(visitor.at("seed")).to_have_value(typed)
    assert visitor.sim is old


@at_length
def test_all_robots_may_be_removed(visitor: Visitor) -> None:
    old = visitor.sim
    visitor.tab("settings")
    buttons = visitor.page.get_by_role("button", name="Remove", exact=True).and_(visitor.page.locator(".q-btn--round"))
    for left in (1, 0):
        buttons.first.click()
        expect(buttons).to_have_count(left)
    visitor.click("apply", told="Restarted with these settings.")
    assert (visitor.sim is old, visitor.sim.robot_count) == (False, 0)
    visitor.page.wait_for_function("() => kiksDesk.scene().robots.length === 0")
    for tab in ("robot", "wire", "programs"):
        visitor.at(f"tab-{tab}").click()
        expect(visitor.at(f"tab-{tab}")).to_have_attribute("aria-selected", "true")
    visitor.picture("no_robot")
    visitor.tab("settings")
    visitor.click("add-robot", "apply")
    visitor.page.wait_for_function("() => kiksDesk.scene().robots.length === 1 && kiksDesk.pose(0)")

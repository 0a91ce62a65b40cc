"""The monitor in a real browser, compared with the state of the engine."""

import re
from dataclasses import replace

import pytest
from tests.desk.visitor import NewPage, Shown, Visitor, expect, make_project

from kiks.model.arena_objects import Lamp, Pose
from kiks.model.project import Project, ProjectRobot

pytestmark = pytest.mark.slow


@pytest.fixture
def project() -> Project:
    """The first robot stands by a wall, with a camera and a radio."""
    project = make_project()
    starts = (Pose(45, 240, 2.9), *project.arena.starts[1:])
    arena = replace(project.arena, starts=starts, lamps=(Lamp(200, 60, 2.0), Lamp(30, 330, 1.0)))
    return replace(project, arena=arena, robots=(ProjectRobot(turrets=("k213", "radio")), *project.robots[1:]))


@pytest.fixture
def visitor(shown: Shown, new_page: NewPage) -> Visitor:
    visitor = Visitor(new_page(1280, 1100), shown)
    drawn(visitor, 3)
    return visitor


def drive(visitor: Visitor) -> None:
    visitor.tab("wire")
    visitor.send("D,4,6")
    visitor.tab("robot")


def drawn(visitor: Visitor, more: int) -> None:
    """Wait until the monitor has drawn itself some more times."""
    visitor.page.wait_for_function("() => window.kiksMonitor")
    before = visitor.answer("kiksMonitor.drawn()")
    visitor.page.wait_for_function("(least) => kiksMonitor.drawn() > least", arg=before + more)


def painted(visitor: Visitor, selector: str) -> int:
    """Return how many different colours are on a canvas."""
    return visitor.answer(
        """(selector) => {
            const canvas = document.querySelector(selector);
            const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
            return new Set(new Uint32Array(data.buffer)).size;
        }""",
        selector,
    )


def test_readings_on_the_page_equal_the_simulations(visitor: Visitor) -> None:
    drive(visitor)
    drawn(visitor, 30)
    visitor.pause()
    sim = visitor.sim
    for name, readings in (("proximity", sim.proximity(1, noise=True)), ("ambient", sim.ambient(1, noise=True))):
        for sensor in range(8):
            expect(visitor.at(f"{name}-{sensor}")).to_have_text(f"{readings[sensor]:.0f}")
    assert max(sim.proximity(1)) > 100
    visitor.shows({"facts": f"Clock0:{int(sim.time_s * 100 + 1e-6) / 100:05.2f}", "speed-left": ", set 4"})
    assert painted(visitor, ".kiks-monitor-robot canvas") > 20


def test_a_click_or_a_key_explains_a_reading(visitor: Visitor) -> None:
    visitor.pause()
    why = visitor.sim.explain(1, 2)
    answer = visitor.at("explanation")
    visitor.click("proximity-2", shows={"explanation": f"Why does it read {why.count}?"})
    expect(answer).to_contain_text(f"Sensor 2 (left 10) of robot 1 reads {why.count}.")
    rows = visitor.at("explanation-table").locator("tbody tr")
    expect(rows).to_have_count(7)
    shown = [rows.nth(k).locator("td").nth(1).inner_text() for k in range(7)]
    assert shown == [f"{ray.length_mm:.1f}" if ray.brightness else "–" for ray in why.rays]
    assert any(ray.brightness for ray in why.rays)
    expect(visitor.at("explanation-drawing").locator("svg")).to_have_attribute("aria-label", re.compile("wall at"))
    expect(visitor.at("proximity-2")).to_have_attribute("aria-pressed", "true")
    visitor.click("ambient-5", shows={"explanation": "Light sensor 5 (right 90) of robot 1 reads"})
    expect(answer).to_contain_text("Lamp 2 (1 W)")
    expect(rows).to_have_count(2)
    visitor.at("close-explanation").click()
    expect(answer).to_be_hidden()
    # With keys alone; test_desk_for_all.py reaches each control with Tab.
    visitor.at("proximity-1").press("Enter")
    expect(answer).to_contain_text("Sensor 1 (")
    visitor.page.keyboard.press("Escape")
    expect(answer).to_be_hidden()
    # It follows the robot if it is told to keep looking.
    visitor.click("proximity-1", "keep-looking")
    text = visitor.at("explanation-text")
    before = text.inner_text()
    x_mm, y_mm, _ = visitor.sim.pose(1)
    visitor.drag((x_mm, y_mm), (300, 250))
    expect(text).not_to_have_text(before)


def test_curves_can_be_chosen_and_lines_left_out(visitor: Visitor) -> None:
    drive(visitor)
    for kind in ("ambient", "speeds", "proximity"):
        visitor.at(f"curves-{kind}").press("Enter")
        expect(visitor.at(f"curves-{kind}")).to_have_attribute("aria-checked", "true")
        drawn(visitor, 10)
        assert painted(visitor, ".kiks-curves") > 8
    first = visitor.page.locator(".kiks-legend button").first
    first.click()
    expect(first).to_have_attribute("aria-pressed", "false")


def test_another_robot_shows_its_own_turrets(visitor: Visitor) -> None:
    expect(visitor.at("camera-strip")).to_be_visible()
    expect(visitor.at("turret-words")).to_contain_text("K213 linear vision (turret 2): a picture every 200 ms")
    expect(visitor.at("turret-words")).to_contain_text("Radio (turret 4): silent")
    visitor.tab("wire")
    visitor.page.mouse.click(*visitor.on_page(450, 300))
    expect(visitor.at("monitor-robot")).to_have_value("robot 2")
    expect(visitor.at("facts")).to_contain_text("x 450.0, y 300.0 mm")
    expect(visitor.at("camera-strip")).to_be_hidden()
    expect(visitor.at("facts")).to_contain_text("127 of 255, upright")
    expect(visitor.at("turret-words")).to_have_text("Gripper (turret 1): holds nothing")

"""The monitor in a real browser, beside a real simulation (monitor_page.py)."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect
from tests.at_length import at_length
from tests.desk.visitor import leave_picture
from tests.desk.visits import NewPage, address_of

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Serve monitor_page.py in a process of its own."""
    with address_of("monitor_page") as address:
        yield address


class Visit:
    """A page with the monitor, and what the simulation says."""

    def __init__(self, page: Page, address: str, query: str) -> None:
        self.page, self.address = page, page.request.get(address).url.split("/desk/")[0]
        page.request.get(f"{self.address}/ask/reset")
        page.goto(f"{self.address}/monitor?{query}")
        page.wait_for_function("() => window.kiksMonitor?.drawn() > 3")

    def get(self, path: str) -> Any:
        return json.loads(self.page.request.get(f"{self.address}{path}").text())

    def find(self, name: str) -> Locator:
        return self.page.get_by_test_id(name)

    def fact(self, name: str) -> str:
        """Return the value of a row of numbers."""
        row = self.find("facts").locator("div", has=self.page.get_by_text(name, exact=True))
        return row.locator("dd").inner_text()

    def painted(self, selector: str) -> int:
        """Return how many different colours are on a canvas."""
        count: int = self.page.evaluate(
            """(selector) => {
                const canvas = document.querySelector(selector);
                const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
                return new Set(new Uint32Array(data.buffer)).size;
            }""",
            selector,
        )
        return count


@pytest.fixture
def visit(new_page: NewPage, address: str) -> Visit:
    return Visit(new_page(520, 1100), address, "")


def test_readings_on_the_page_equal_the_simulations(visit: Visit) -> None:
    visit.get("/ask/drive")
    visit.page.wait_for_function("() => kiksMonitor.drawn() > 30")
    visit.get("/ask/pause")
    world = visit.get("/world")
    for sensor in range(8):
        expect(visit.find(f"proximity-{sensor}")).to_have_text(f"{world['counts'][0][sensor]:.0f}")
        expect(visit.find(f"ambient-{sensor}")).to_have_text(f"{world['light'][0][sensor]:.0f}")
    assert max(world["counts"][0]) > 100
    expect(visit.find("facts")).to_contain_text(f"Clock0:{int(world['time_s'] * 100 + 1e-6) / 100:05.2f}")
    expect(visit.find("speed-left")).to_contain_text(", set 4")
    assert visit.painted(".kiks-monitor-robot canvas") > 20


def test_a_click_explains_a_reading(visit: Visit) -> None:
    visit.get("/ask/pause")
    world = visit.get("/world")
    visit.find("proximity-2").click()
    answer = visit.find("explanation")
    expect(answer).to_contain_text(f"Why does it read {world['count']}?")
    expect(answer).to_contain_text(f"Sensor 2 (left 10) of robot 1 reads {world['count']}.")
    rows = visit.find("explanation-table").locator("tbody tr")
    expect(rows).to_have_count(7)
    shown = [rows.nth(k).locator("td").nth(1).inner_text() for k in range(7)]
    assert shown == ["–" if length is None else f"{length:.1f}" for length in world["lengths_mm"]]
    assert any(length is not None for length in world["lengths_mm"])
    expect(visit.find("explanation-drawing").locator("svg")).to_have_attribute("aria-label", re.compile("wall at"))
    expect(visit.find("proximity-2")).to_have_attribute("aria-pressed", "true")
    visit.find("ambient-5").click()
    expect(answer).to_contain_text("Light sensor 5 (right 90) of robot 1 reads")
    expect(answer).to_contain_text("Lamp 2 (1 W)")
    expect(rows).to_have_count(2)
    visit.find("close-explanation").click()
    expect(answer).to_be_hidden()


def test_keep_looking_updates_the_explanation(visit: Visit) -> None:
    visit.find("proximity-1").click()
    visit.find("keep-looking").click()
    text = visit.find("explanation-text")
    before = text.inner_text()
    visit.get("/ask/drive")
    expect(text).not_to_have_text(before)


@at_length
def test_the_monitor_works_with_keys_alone(visit: Visit) -> None:
    visit.page.get_by_label("Robot").first.focus()
    for _ in range(6):
        visit.page.keyboard.press("Tab")
    focused = visit.page.evaluate("document.activeElement.dataset.testid")
    assert focused in [f"{which}-{sensor}" for which in ("proximity", "ambient") for sensor in range(8)]
    visit.page.keyboard.press("Enter")
    expect(visit.find("explanation")).to_contain_text(f"ensor {focused[-1]} (")
    visit.find("curves-speeds").focus()
    visit.page.keyboard.press("Enter")
    expect(visit.find("curves-speeds")).to_have_attribute("aria-checked", "true")


def test_curves_can_be_chosen_and_lines_left_out(visit: Visit) -> None:
    visit.get("/ask/drive")
    for kind in ("ambient", "speeds", "proximity"):
        visit.find(f"curves-{kind}").click()
        expect(visit.find(f"curves-{kind}")).to_have_attribute("aria-checked", "true")
        visit.page.wait_for_function(
            "(drawn) => kiksMonitor.drawn() > drawn + 10", arg=visit.page.evaluate("kiksMonitor.drawn()")
        )
        assert visit.painted(".kiks-curves") > 8
    first = visit.page.locator(".kiks-legend button").first
    first.click()
    expect(first).to_have_attribute("aria-pressed", "false")


def test_another_robot_shows_its_own_turrets(visit: Visit) -> None:
    expect(visit.find("camera-strip")).to_be_visible()
    expect(visit.find("turret-words")).to_contain_text("K213 linear vision (turret 2): a picture every 200 ms")
    expect(visit.find("turret-words")).to_contain_text("Radio (turret 4): silent")
    visit.get("/ask/show2")
    expect(visit.find("camera-strip")).to_be_hidden()
    expect(visit.find("facts")).to_contain_text("127 of 255, upright")
    expect(visit.find("turret-words")).to_have_text("Gripper (turret 1): holds nothing")
    assert visit.fact("Turrets") == "Gripper"


@at_length
def test_dark_pages_have_dark_colours(new_page: NewPage, address: str) -> None:
    """The same page by day and by night, with pictures for a person to look at."""
    for name in ("light", "dark"):
        page = new_page(520, 1100)
        visit = Visit(page, address, f"dark={name == 'dark'}")
        visit.find("proximity-2").click()
        expect(visit.find("explanation")).to_be_visible()
        visit.page.wait_for_function("() => kiksMonitor.drawn() > 20")
        leave_picture(page, f"monitor_{name}", full_page=True)
        assert visit.page.evaluate("document.body.classList.contains('body--dark')") == (name == "dark")
        assert visit.painted(".kiks-curves") > 8

"""The world of a page that people change: its readings are those that a simulation gives in the same place."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.desk.visitor import NewPage, Page, expect, in_each_browser, leave_picture

from kiks import Arena, Champion, Khepera, Recording, Simulation, Timing, controllers
from kiks.export.kinds import export
from kiks.model.arena import PAD

Open = Callable[[Path], Page]

TIME_S = 4.26
"""When the page leaves the recording [s]: not at a tick of 40 ms."""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("free") / "run.mcap"
    walls = np.zeros((400, 600), np.uint8)
    walls[180:220, 300:340] = 200
    sim = Simulation(Arena.from_array(walls), robots=0, seed=4)
    for pose in ((100, 100, 0), (480, 300, 2)):
        sim.add_robot(pose=pose)
    sim.add_ball(480, 80)
    sim.add_lamp(60, 330, 1.0)
    with sim.record(file):
        for number, speeds in ((1, (6, 5)), (2, (4, 6))):
            Khepera(sim.port(number)).set_speed(*speeds)
        sim.run(8 - sim.time_s)
    export(Recording(file), file.with_suffix(".html"))
    return file


@pytest.fixture
def opened(new_page: NewPage) -> Open:
    def visit(file: Path) -> Page:
        page = new_page(1280, 800, offline=True)
        page.goto(file.as_uri())
        page.wait_for_function("() => window.kiksPage?.stage.frames_drawn > 0")
        return page

    return visit


def shown(page: Page) -> tuple[Any, Any]:
    """Return the readings of all robots that the page shows."""
    found = page.evaluate(
        """() => {
            const { frame } = kiksPage.feed;
            const robots = Array.from({ length: frame.robot_count }, (_, k) => frame.robot(k));
            return [robots.map((robot) => [...robot.proximity]), robots.map((robot) => [...robot.ambient])];
        }"""
    )
    return found[0], found[1]


def read(sim: Simulation) -> tuple[Any, Any]:
    seen = sim.look()
    return seen.proximity.tolist(), seen.ambient.tolist()


def seek(page: Page, time_s: float) -> None:
    page.evaluate("(time_s) => kiksPage.player.seek(time_s)", time_s)
    page.wait_for_function("(time_s) => Math.abs(kiksPage.player._shown_s - time_s) < 1e-9", arg=time_s)


def move(page: Page, what: str, index: int, **place: float) -> None:
    """Do what the hand does with a thing."""
    page.evaluate(
        """([what, index, place]) => {
            const { feed } = kiksPage;
            feed.send({ kind: "grab", what, index });
            if ("x_mm" in place) feed.send({ kind: "move", ...place });
            else feed.send({ kind: "turn", ...place });
            feed.send({ kind: "drop" });
        }""",
        [what, index, place],
    )


@pytest.mark.slow
@in_each_browser
def test_what_is_dragged_is_read_as_a_simulation_reads_it(recorded: Path, opened: Open) -> None:
    page, sim = opened(recorded.with_suffix(".html")), Recording(recorded).world_at(TIME_S)
    seek(page, TIME_S)
    page.evaluate("(time_s) => kiksPage.free.begin(time_s)", TIME_S)
    before = shown(page)
    assert before == read(sim)
    move(page, "robot", 0, x_mm=265.0, y_mm=205.0)
    move(page, "robot", 0, heading_rad=0.3)
    sim.place(1, 265.0, 205.0, 0.3)
    assert shown(page) == read(sim)
    move(page, "body", 0, x_mm=270.0, y_mm=140.0)
    move(page, "lamp", 0, x_mm=200.0, y_mm=250.0)
    bodies: Any = sim.world.state.bodies[0]
    bodies["x_mm"], bodies["y_mm"], bodies["trail"], bodies["velocity_x"], bodies["velocity_y"] = (
        270,
        150,
        (270, 150),
        0,
        0,
    )
    sim.world.lamps[0, :2] = 200, 250
    sim.world.rebuild_scene()
    assert shown(page) == read(sim)
    # There is no room in a wall, nor in another robot.
    for place in ((320.0, 200.0), (270.0, 140.0)):
        move(page, "robot", 1, x_mm=place[0], y_mm=place[1])
    assert shown(page) == read(sim)
    expect(page.locator("#free-state")).to_contain_text("Not the recording any more: this world left it at 0:04.26.")
    page.locator("#back").click()
    expect(page.locator("#free-state")).to_contain_text("What if?")
    page.evaluate("(time_s) => kiksPage.free.begin(time_s)", TIME_S)
    assert shown(page) == before


@pytest.mark.slow
def test_walls_are_moved_drawn_and_removed(recorded: Path, opened: Open) -> None:
    page, sim = opened(recorded.with_suffix(".html")), Recording(recorded).world_at(TIME_S)
    seek(page, TIME_S)
    before = shown(page)
    for tool, points in (
        ("move", [[320, 200], [200, 150]]),  # y counts from below, rows of the array from above
        ("draw", [[90, 60], [160, 60], [160, 160]]),
        ("erase", [[120, 60], [140, 60]]),
    ):
        page.evaluate("([tool, points]) => kiksPage.free.draw({ points }, tool, 20)", [tool, points])
    cells = page.evaluate("() => { const { world } = kiksPage.feed; return [...world.view('brightness')]; }")
    rows, columns = (count + 2 * PAD for count in sim.arena.brightness.shape)
    raster = np.array(cells, np.uint8).reshape(rows, columns)[PAD:-PAD, PAD:-PAD]
    assert 0 < (raster != sim.arena.brightness).sum() < 10_000
    changed = Simulation(Arena.from_array(raster[::-1]), robots=0, seed=4)
    for number in (1, 2):
        changed.add_robot(pose=sim.pose(number))
    move(page, "body", 0, x_mm=560.0, y_mm=40.0)
    move(page, "lamp", 0, x_mm=560.0, y_mm=40.0)
    leave_picture(page, "walls_on_a_page")
    gaps = page.evaluate(
        """() => [[150, 100], [200, 100], [330, 200]].map(([x, y]) => {
            const { world } = kiksPage.feed, { pad, cell_mm } = world.numbers;
            return world.engine.call("clearance_of_disc", world.arrays.clearance, cell_mm, pad, x, y, 10);
        })"""
    )
    assert gaps == [changed.world.free_space.wall_gap_mm(x, y, 10) for x, y in ((150, 100), (200, 100), (330, 200))]
    # What hangs together with the border of the arena stays.
    page.evaluate("() => kiksPage.free.draw({ points: [[560, 1], [560, 60]] }, 'draw', 20)")
    is_same = page.evaluate(
        """() => {
            const { free, feed: { world } } = kiksPage, cells = world.view("brightness").slice();
            free.draw({ points: [[560, 40], [200, 300]] }, "move", 20);
            return world.view("brightness").every((brightness, k) => brightness === cells[k]);
        }"""
    )
    assert is_same
    page.locator("#back").click()
    page.wait_for_function("() => !kiksPage.free.isOn")
    assert shown(page) == before


@pytest.mark.slow
def test_a_champion_drives_on_in_its_page(tmp_path: Path, opened: Open) -> None:
    made = controllers.linear()
    champion = Champion(made, (0.5, 0.5, *[0.0] * 16), task="straight on", timing=Timing(period_s=0.05, baud=None))
    champion.save(tmp_path / "champion.toml")
    export(tmp_path / "champion.toml", tmp_path / "champion.html", duration_s=5.0)
    page = opened(tmp_path / "champion.html")
    expect(page.locator("h1")).to_have_text("Champion of straight on")
    assert page.locator("#controller option").all_text_contents() == ["Champion of straight on", "Braitenberg vehicle"]
    seek(page, 1.0)
    before_mm = page.evaluate("kiksPage.feed.frame.robot(0).forwards_mm")
    page.locator("#go-on").click()
    page.wait_for_function("(before_mm) => kiksPage.feed.frame.robot(0).forwards_mm > before_mm + 20", arg=before_mm)
    page.locator("#free summary").click()
    page.locator("#parameters input").first.fill("-0.5")
    page.wait_for_function(
        "() => kiksPage.feed.frame.robot(0).speeds[0] < 0 && kiksPage.feed.frame.robot(0).speeds[1] > 0"
    )
    page.locator("#go-on").click()
    expect(page.locator("#go-on")).to_have_text("Go on from here")


@pytest.mark.slow
def test_a_finger_drags_things_and_scrolls_the_page_from_the_floor(recorded: Path, new_page: NewPage) -> None:
    page = new_page(390, 844, offline=True, has_touch=True, is_mobile=True)
    page.goto(recorded.with_suffix(".html").as_uri())
    page.wait_for_function("() => window.kiksPage?.stage.frames_drawn > 0")
    seek(page, TIME_S)
    fingers = page.context.new_cdp_session(page)

    def swipe(begin: list[float], y_px: float) -> None:
        fingers.send(
            "Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": begin[0], "y": begin[1]}]}
        )
        for step in range(1, 11):
            place = {"x": begin[0], "y": begin[1] + y_px * step / 10}
            fingers.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [place]})
        fingers.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    before = page.evaluate("kiksPage.feed.frame.pose(0)")
    to_client = "([x_mm, y_mm]) => kiksPage.stage.toClient(x_mm, y_mm)"
    swipe(page.evaluate(to_client, [before["x_mm"], before["y_mm"]]), -60)
    page.wait_for_function("(y_mm) => kiksPage.feed.frame.pose(0).y_mm > y_mm + 30", arg=before["y_mm"])
    assert page.evaluate("scrollY") == 0
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    swipe(page.evaluate(to_client, [450, 200]), -200)
    page.wait_for_function("() => scrollY > 100")
    leave_picture(page, "what_if_on_a_phone")


@pytest.mark.slow
def test_parameters_evolve_in_a_page(tmp_path: Path, opened: Open) -> None:
    champion = Champion(controllers.linear(), [0.0] * 18, timing=Timing(period_s=0.05, baud=None))
    champion.save(tmp_path / "champion.toml")
    export(tmp_path / "champion.toml", tmp_path / "champion.html", duration_s=2.0)
    page, evolved = opened(tmp_path / "champion.html"), "document.getElementById('evolved').textContent"
    seek(page, 1.0)
    state = "kiksPage.feed.world.save().bytes.join()"
    page.evaluate("kiksPage.free.begin(1.0)")
    before = page.evaluate(state)
    page.locator("#free summary").click()
    page.locator("#evolve").click()
    # It stood still, and now it gets away.
    page.wait_for_function(f"() => Number({evolved}.match(/roaming ([0-9.]+)[.]/)?.[1]) > 0.1")
    assert not page.evaluate("kiksPage.feed.send({ kind: 'grab', what: 'robot', index: 0 })")
    page.locator("#evolve").click()
    expect(page.locator("#evolve")).to_have_text("Evolve")
    assert page.evaluate(state) == before, "each candidate begins there, and so does what a person does next"
    found = [float(each) for each in page.locator("#parameters output").all_text_contents()]
    assert any(found)
    page.locator("#go-on").click()
    page.wait_for_function(
        "() => kiksPage.feed.frame.robot(0).forwards_mm + kiksPage.feed.frame.robot(0).backwards_mm > 20"
    )
    page.locator("#back").click()
    page.wait_for_function("() => !kiksPage.free.isOn && kiksPage.feed.frame.robot(0).forwards_mm === 0")

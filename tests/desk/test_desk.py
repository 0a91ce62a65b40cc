"""The desk in a real browser: time, drags and views, compared with the state of the engine."""

from __future__ import annotations

import math

import pytest
from playwright.sync_api import Browser, expect
from tests.at_length import at_length
from tests.desk.visitor import Visitor
from tests.desk.visits import NewPage

from kiks.desk.server.show import Shown

pytestmark = pytest.mark.slow


def clock_text(now_ns: int) -> str:
    """Return what the clock shows at a simulated time."""
    hundredths = now_ns // 10_000_000
    return f"{hundredths // 6000}:{hundredths // 100 % 60:02d}.{hundredths % 100:02d}"


def centre_of_view(visitor: Visitor) -> tuple[float, float]:
    box = visitor.at("arena-top").bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


# ---- time ----


def test_time_passes_at_the_chosen_speed(visitor: Visitor) -> None:
    assert visitor.page.title() == "KiKS"
    assert visitor.seen(1) == pytest.approx(visitor.sim.pose(1), abs=1e-3)
    begun_ns = visitor.sim.now_ns
    visitor.until(lambda: visitor.sim.now_ns > begun_ns + 200_000_000)
    expect(visitor.at("rate")).to_contain_text("1.0 x now")
    visitor.picture("first_picture")
    visitor.choose("speed", "10 x")
    visitor.until(lambda: visitor.desk.gate.speed == 10)
    visitor.choose("speed", "full speed")
    visitor.until(lambda: visitor.desk.gate.speed is None)
    visitor.until(lambda: visitor.desk.meter.momentary > 10)
    visitor.picture("as_fast_as_it_can")
    visitor.choose("speed", "0.1 x")
    visitor.until(lambda: visitor.desk.gate.speed == 0.1)


def test_run_pause_and_step(visitor: Visitor) -> None:
    visitor.pause()
    visitor.until(lambda: visitor.sim.now_ns == visitor.desk.gate.pace.now_ns())
    now_ns = visitor.sim.now_ns
    clock = visitor.at("clock")
    expect(clock).to_have_text(clock_text(now_ns))
    expect(visitor.at("run")).to_have_attribute("aria-label", "Run")
    visitor.at("step").click()
    visitor.until(lambda: visitor.sim.now_ns == now_ns + 10_000_000)
    visitor.choose("step-size", "1 s")
    visitor.page.keyboard.press(".")
    visitor.until(lambda: visitor.sim.now_ns == now_ns + 1_010_000_000)
    expect(clock).to_have_text(clock_text(now_ns + 1_010_000_000))
    visitor.picture("paused")
    visitor.page.keyboard.press("Space")
    visitor.until(lambda: not visitor.desk.gate.is_paused and visitor.sim.now_ns > now_ns + 1_100_000_000)
    visitor.page.keyboard.press("Space")
    visitor.until(lambda: visitor.desk.gate.is_paused)


@at_length
def test_space_on_a_button_presses_only_that_button(visitor: Visitor) -> None:
    visitor.at("step").focus()
    visitor.page.keyboard.press("Space")
    gate = visitor.desk.gate
    visitor.until(lambda: gate.is_paused and visitor.sim.now_ns == gate.pace.now_ns())
    now_ns = visitor.sim.now_ns
    visitor.page.keyboard.press("Space")
    visitor.until(lambda: visitor.sim.now_ns > now_ns)
    expect(visitor.at("clock")).to_have_text(clock_text(now_ns + 10_000_000))
    assert visitor.desk.gate.is_paused


def test_checkpoint_and_reset(visitor: Visitor) -> None:
    visitor.drag((150, 200), (250, 250))
    visitor.at("mark").click()
    visitor.told("Checkpoint taken.")
    there = visitor.sim.pose(1)
    visitor.drag(there[:2], (120, 120))
    assert visitor.sim.pose(1) != there
    now_ns = visitor.sim.now_ns
    visitor.at("reset").click()
    visitor.told("Everything is back where it stood.")
    assert visitor.sim.pose(1) == pytest.approx(there)
    assert visitor.sim.now_ns >= now_ns
    visitor.picture("reset")


# ---- hands ----


def test_robot_is_dragged_and_slides_along_a_wall(visitor: Visitor) -> None:
    visitor.pull((150, 200), (250, 250))
    assert visitor.until(lambda: visitor.sim.pose(1)[:2] == pytest.approx((250, 250), abs=1))
    for step in range(1, 11):
        visitor.page.mouse.move(*visitor.on_page(250 - 10 * step, 250 - 25 * step))
        assert visitor.is_free(1)
    visitor.until(lambda: visitor.sim.pose(1)[1] < 40)
    visitor.picture("dragged_along_a_wall")
    visitor.let_go()
    assert visitor.is_free(1)
    x_mm, y_mm, heading_rad = visitor.sim.pose(1)
    assert y_mm == pytest.approx(37.5, abs=1)
    assert x_mm == pytest.approx(150, abs=1)
    assert heading_rad == 0


@at_length
def test_robot_is_turned_by_its_rim(visitor: Visitor) -> None:
    visitor.pull((150 + 25.5, 200), (150, 260))
    assert visitor.until(lambda: visitor.sim.pose(1)[2] == pytest.approx(math.pi / 2, abs=0.02))
    visitor.picture("turned")
    visitor.let_go()
    assert visitor.sim.pose(1)[:2] == pytest.approx((150, 200))


@at_length
def test_ball_and_lamp_are_dragged(visitor: Visitor) -> None:
    visitor.pull((300, 100), (350, 200))
    visitor.until(lambda: math.dist(visitor.sim.bodies()[0][["x_mm", "y_mm"]].item(), (350, 200)) < 1)
    visitor.let_go()
    visitor.pull((80, 340), (250, 300))
    visitor.until(lambda: math.dist(visitor.sim.lamps[0][:2], (250, 300)) < 1)
    visitor.picture("ball_and_lamp_dragged")
    visitor.let_go()


@at_length
def test_keys_alone_move_and_turn(visitor: Visitor) -> None:
    for _ in range(60):
        visitor.page.keyboard.press("Tab")
        if visitor.answer("document.activeElement.dataset.testid") == "arena-top":
            break
    visitor.page.keyboard.press("n")
    expect(visitor.page.locator(".kiks-live")).to_contain_text("robot 1 selected")
    for key in ("ArrowRight", "ArrowRight", "Shift+ArrowUp"):
        visitor.page.keyboard.press(key)
    assert visitor.until(lambda: visitor.sim.pose(1)[:2] == pytest.approx((170, 201), abs=0.01))
    visitor.page.keyboard.press("q")
    assert visitor.until(lambda: visitor.sim.pose(1)[2] == pytest.approx(math.radians(5), abs=1e-3))
    for _ in range(2):
        visitor.page.keyboard.press("e")
    assert visitor.until(lambda: math.remainder(visitor.sim.pose(1)[2], math.tau) < -0.08)
    visitor.picture("moved_by_keys")
    visitor.page.keyboard.press("Space")
    visitor.until(lambda: visitor.desk.gate.is_paused)


@at_length
def test_two_browsers_see_one_world_and_both_drag(visitor: Visitor, new_page: NewPage) -> None:
    other = Visitor(new_page(), visitor.shown)
    visitor.pull((150, 200), (150, 300))
    other.pull((450, 300), (400, 200))
    visitor.until(lambda: visitor.sim.pose(1)[1] == pytest.approx(300, abs=1))
    other.until(lambda: other.sim.pose(2)[1] == pytest.approx(200, abs=1))
    for one in (visitor, other):
        for robot in (1, 2):
            one.until(lambda one=one, robot=robot: one.seen(robot) == pytest.approx(one.sim.pose(robot), abs=0.01))
    other.picture("two_browsers_drag")
    other.page.mouse.up()
    other.pull((150, 300), (160, 310))
    expect(other.at("arena-notice")).to_contain_text("one hand must let go")
    visitor.page.mouse.up()
    other.page.mouse.up()
    other.at("run").click()
    expect(visitor.at("run")).to_have_attribute("aria-label", "Run")


# ---- views ----


def test_robot_is_followed_and_layers_are_chosen(visitor: Visitor) -> None:
    visitor.page.mouse.move(*visitor.on_page(300, 200))
    visitor.page.mouse.wheel(0, -600)
    visitor.menu("follow", "Robot 2")
    centre = centre_of_view(visitor)

    def is_in_the_middle() -> bool:
        return math.dist(visitor.on_page(*visitor.sim.pose(2)[:2]), centre) < 3

    visitor.until(is_in_the_middle)
    visitor.sim.place(2, 300, 250, 0)
    visitor.until(is_in_the_middle)
    visitor.picture("followed")
    visitor.menu("follow", "No robot")
    visitor.sim.place(2, 450, 300, 0)
    visitor.until(lambda: not is_in_the_middle())
    # Layers go on and off.
    visitor.at("layers").click()
    for name in ("rays", "grid", "ruler", "trails"):
        was_shown = visitor.answer("(name) => kiksDesk.shown()[name]", name)
        visitor.at(f"show-{name}").click()
        visitor.page.wait_for_function("([name, shown]) => kiksDesk.shown()[name] === shown", arg=[name, not was_shown])
    visitor.picture("layers")


def test_3d_view_shows(visitor: Visitor) -> None:
    visitor.at("views").get_by_text("3-D").click()
    visitor.page.wait_for_function("() => kiksDesk.isSolid()")
    expect(visitor.at("arena-solid").locator("canvas")).to_be_visible()
    visitor.drag((150, 200), (220, 240))
    assert visitor.sim.pose(1)[:2] == pytest.approx((220, 240), abs=2)
    visitor.picture("3d")
    visitor.at("views").get_by_text("both").click()
    expect(visitor.at("arena-top")).to_be_visible()
    expect(visitor.at("arena-solid").locator("canvas")).to_be_visible()
    visitor.until(lambda: visitor.answer("kiksDesk.stats().solid_frames") > 5)
    visitor.picture("both_views")


@at_length
def test_without_webgl_the_desk_shows_the_top_view(
    new_page: NewPage, shown: Shown, browser_without_3d: Browser
) -> None:
    visitor = Visitor(new_page(by=browser_without_3d), shown)
    visitor.at("views").get_by_text("both").click()
    expect(visitor.at("arena-solid")).to_contain_text("needs WebGL 2")
    visitor.drag((150, 200), (200, 200))
    assert visitor.sim.pose(1)[0] == pytest.approx(200, abs=1)
    visitor.picture("without_webgl")


@at_length
def test_a_hidden_page_gets_frames_again_when_visible(visitor: Visitor) -> None:
    hide = """(isHidden) => {
        Object.defineProperty(document, 'hidden', { value: isHidden, configurable: true });
        document.dispatchEvent(new Event('visibilitychange'));
    }"""
    received = "kiksDesk.stats().frames_received"
    visitor.answer(hide, True)
    at_most = visitor.answer(received) + 4
    begun_ns = visitor.sim.now_ns
    visitor.until(lambda: visitor.sim.now_ns > begun_ns + 1_000_000_000)
    assert visitor.answer(received) <= at_most
    visitor.sim.place(1, 300, 300, 1.0)
    visitor.answer(hide, False)
    visitor.until(lambda: visitor.seen(1) == pytest.approx((300, 300, 1.0), abs=1e-3))
    visitor.picture("awake_again")

"""The desk in a real browser: time, drags and views, compared with the state of the engine."""

import math

import pytest
from tests.desk.visitor import Visitor, expect

pytestmark = pytest.mark.slow


def clock_text(now_ns: int) -> str:
    """Return what the clock shows at a simulated time."""
    hundredths = now_ns // 10_000_000
    return f"{hundredths // 6000}:{hundredths // 100 % 60:02d}.{hundredths % 100:02d}"


def centre_of_view(visitor: Visitor) -> tuple[float, float]:
    box = visitor.at("arena-top").bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_time_passes_at_the_chosen_speed(visitor: Visitor) -> None:
    assert visitor.page.title() == "KiKS"
    assert visitor.seen(1) == pytest.approx(visitor.sim.pose(1), abs=1e-3)
    begun_ns = visitor.sim.now_ns
    visitor.until(lambda: visitor.sim.now_ns > begun_ns + 200_000_000)
    expect(visitor.at("rate")).to_contain_text("1.0 x now")
    visitor.picture("first_picture")
    for text, speed in (("10 x", 10), ("0.1 x", 0.1), ("full speed", None)):
        visitor.choose("speed", text)
        visitor.until(lambda speed=speed: visitor.desk.gate.speed == speed)
    visitor.until(lambda: visitor.desk.shown.meter.momentary > 10)
    visitor.picture("as_fast_as_it_can")


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
    # What was clicked passes the key on, and is not pressed again.
    for clicked in ("proximity-0", "curves-speeds", "tab-wire", "mark", "tab-settings", "noise"):
        visitor.click(clicked)
        visitor.page.keyboard.press("Space")
        visitor.until(lambda: not visitor.desk.gate.is_paused)
        visitor.page.keyboard.press("Space")
        visitor.until(lambda: visitor.desk.gate.is_paused)
    expect(visitor.at("noise")).to_have_attribute("aria-checked", "false")
    # A button to which Tab has come takes it, and only that one is pressed.
    visitor.choose("step-size", "10 ms")
    now_ns = visitor.sim.now_ns
    visitor.at("run").focus()
    visitor.page.keyboard.press("Tab")
    visitor.page.keyboard.press("Space")
    visitor.until(lambda: visitor.sim.now_ns > now_ns)
    expect(clock).to_have_text(clock_text(now_ns + 10_000_000))
    assert visitor.desk.gate.is_paused


def test_checkpoint_and_reset(visitor: Visitor) -> None:
    visitor.drag((150, 200), (250, 250))
    visitor.click("mark", told="Checkpoint taken.")
    there = visitor.sim.pose(1)
    visitor.drag(there[:2], (120, 120))
    assert visitor.sim.pose(1) != there
    now_ns = visitor.sim.now_ns
    visitor.click("reset", told="Everything is back where it stood.")
    assert visitor.sim.pose(1) == pytest.approx(there)
    assert visitor.sim.now_ns >= now_ns
    visitor.picture("reset")


def test_robot_is_dragged_and_slides_along_a_wall(visitor: Visitor) -> None:
    visitor.pull((150, 200), (250, 250))
    assert visitor.until(lambda: visitor.sim.pose(1)[:2] == pytest.approx((250, 250), abs=1))
    for step in range(1, 11):
        visitor.page.mouse.move(*visitor.on_page(250 - 10 * step, 250 - 25 * step))
        assert visitor.is_free(1)
    visitor.until(lambda: visitor.sim.pose(1)[:2] == pytest.approx((150, 37.5), abs=1))
    visitor.picture("dragged_along_a_wall")
    visitor.let_go()
    assert visitor.is_free(1)
    assert visitor.sim.pose(1) == (pytest.approx(150, abs=1), pytest.approx(37.5, abs=1), 0)


def test_robot_is_followed_and_layers_are_chosen(visitor: Visitor) -> None:
    visitor.page.mouse.move(*visitor.on_page(300, 200))
    visitor.page.mouse.wheel(0, -600)
    visitor.choose("follow", "Robot 2")
    centre = centre_of_view(visitor)

    def is_in_the_middle() -> bool:
        return math.dist(visitor.on_page(*visitor.sim.pose(2)[:2]), centre) < 3

    visitor.until(is_in_the_middle)
    visitor.sim.place(2, 300, 250, 0)
    visitor.until(is_in_the_middle)
    visitor.picture("followed")
    visitor.choose("follow", "No robot")
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

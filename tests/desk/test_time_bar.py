"""The time bar in a real browser: what it shows is compared with the state of the engine."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.at_length import at_length
from tests.desk.visitor import NewPage, Shown, Visitor, check_access, expect

from kiks import Khepera, Recording, Simulation
from kiks.desk.server.rights import Rights
from kiks.model.arena import Arena
from kiks.run import Run

pytestmark = pytest.mark.slow


@pytest.fixture
def played(tmp_path: Path) -> Iterator[Shown]:
    """A desk with a recording of four seconds, in which something happens."""
    from kiks.desk.server.desk import Desk
    from kiks.desk.server.show import Shown

    sim = Simulation(Arena.box(500, 400), robots=2, seed=2)
    sim.place(1, 100, 100, 0.5)
    sim.place(2, 350, 300, 1.0)
    file, robot = tmp_path / "run.mcap", Khepera(sim.port(1))
    with sim.record(file) as recorder:
        robot.set_speed(8, 6)
        sim.run(1.0 - sim.time_s)
        recorder.mark("look here")
        sim.run(0.5)
        recorder.say(1, "I have seen it")
        sim.set_score(1, 2)
        sim.set_score(2, 1)
        sim.run(0.5)
        sim.place(1, 100, 200, 3.1)
        robot.set_speed(15, 15)
        sim.run(4.0 - sim.time_s)
    recording = Recording(file)
    desk = Desk(Run.in_world(recording.world_at(0), tmp_path), Rights(owns_world=True), folder=tmp_path)
    desk.looking.show_recording(file, 0)
    shown = Shown(desk, port=0)
    shown.drive()
    yield shown
    shown.close()


@pytest.fixture
def replay(played: Shown, new_page: NewPage) -> Visitor:
    return Visitor(new_page(), played)


def drag_to(visitor: Visitor, share: float) -> None:
    """Drag the thumb from where it is to a share of the bar."""
    track, thumb = visitor.at("time-slider").bounding_box(), visitor.page.locator(".kiks-bar-thumb").bounding_box()
    mouse, y = visitor.page.mouse, thumb["y"] + thumb["height"] / 2
    mouse.move(thumb["x"] + thumb["width"] / 2, y)
    mouse.down()
    mouse.move(track["x"] + share * track["width"], y, steps=8)
    mouse.up()


def at_time(visitor: Visitor, time_s: float, tolerance_s: float = 1e-6) -> None:
    """Wait until the world and the page are at a time."""
    visitor.until(lambda: visitor.sim.time_s == pytest.approx(time_s, abs=tolerance_s))
    visitor.until(lambda: visitor.seen(1) == pytest.approx(visitor.sim.pose(1), abs=0.1))


def test_a_recording_is_played_stepped_and_jumped_through(replay: Visitor) -> None:
    visitor = replay
    expect(visitor.at("bar-state")).to_have_text("Recording")
    expect(visitor.at("bar-end")).to_have_text("0:04.00")
    expect(visitor.at("back-to-now")).to_be_hidden()
    drag_to(visitor, 0.5)
    at_time(visitor, 2.0, 0.05)
    visitor.picture("replay")
    expect(visitor.at("board-match")).to_have_text("2 : 1")
    page, begin_s = visitor.page, visitor.sim.time_s
    for press, by_s in (("on-short", 0.1), ("on-long", 1.0), ("back-long", -1.0), ("back-short", -0.1)):
        visitor.at(press).click()
        begin_s += by_s
        at_time(visitor, begin_s)
    for key, by_s in (("l", 0.1), ("Shift+L", 1.0), ("Shift+J", -1.0), ("j", -0.1), (".", 0.01), (",", -0.01)):
        page.keyboard.press(key)
        begin_s += by_s
        at_time(visitor, begin_s)
    visitor.at("time-slider").focus()
    for key, time_s in (("Home", 0.0), ("ArrowRight", 0.1), ("PageUp", 1.1), ("ArrowLeft", 1.0), ("End", 4.0)):
        page.keyboard.press(key)
        at_time(visitor, time_s)
    expect(visitor.at("time-slider")).to_have_attribute("aria-valuetext", "0:04.00 of 0:04.00")
    marks = visitor.desk.looking.marks
    assert {mark.kind for mark in marks} == {"contact", "bookmark", "output", "change", "score"}
    expect(page.locator(".kiks-bar-mark")).to_have_count(len(marks))
    times = sorted({mark.time_s for mark in marks})
    for time_s in reversed(times):
        visitor.at("event-before").click()
        at_time(visitor, time_s)
    expect(visitor.at("board")).to_be_hidden()  # there was no score yet
    visitor.click("event-before", told="Nothing happened before this.")
    page.keyboard.press("o")
    at_time(visitor, times[1])
    expect(visitor.at("bar-event")).to_contain_text(marks[1].text)
    box = page.locator(".kiks-bar-bookmark").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 10)
    expect(visitor.at("bar-tip")).to_contain_text("look here")
    page.keyboard.press("b")
    visitor.at("bookmark-note").fill("and here")
    page.keyboard.press("Enter")
    expect(visitor.at("bar-event")).to_contain_text("and here")
    expect(page.locator(".kiks-bar-bookmark")).to_have_count(2)
    visitor.choose("speed", "10 x")
    visitor.at("play").click()
    visitor.until(lambda: visitor.sim.time_s == 4.0 and visitor.desk.is_paused)
    expect(visitor.at("bar-now")).to_have_text("0:04.00")
    visitor.page.mouse.move(5, 300)
    visitor.drag_refused()
    visitor.click("hall", shows={"board-clock": "0:04.0", "board": "robot 1"})
    expect(visitor.at("run")).to_be_hidden()
    visitor.picture("hall")
    check_access(page, "the hall view")
    page.keyboard.press("Escape")
    expect(visitor.at("run")).to_be_visible()


@at_length
def test_a_person_goes_on_from_a_recording(replay: Visitor) -> None:
    visitor = replay
    drag_to(visitor, 0.25)
    at_time(visitor, 1.0, 0.05)
    poses, time_s = visitor.sim.poses(), visitor.sim.time_s
    visitor.click("go-on-from-here", shows={"dialog-text": "have hung up"})
    visitor.picture("go_on_from_a_recording")
    scene = visitor.answer("kiksDesk.scene().scene")
    visitor.click("dialog-yes", told="The world is yours.")
    expect(visitor.page.locator(".q-dialog__backdrop")).to_have_count(0)
    expect(visitor.at("bar-state")).to_have_text("Now")
    assert (visitor.sim.time_s, visitor.sim.poses()) == (time_s, pytest.approx(poses))
    visitor.until(lambda: visitor.answer("kiksDesk.scene().scene") > scene)
    x_mm, y_mm, _ = visitor.sim.pose(1)
    visitor.drag((x_mm, y_mm), (250, 60))
    assert visitor.sim.pose(1)[:2] == pytest.approx((250, 60), abs=2)
    visitor.page.keyboard.press("Space")
    visitor.until(lambda: visitor.sim.time_s > time_s + 0.5)
    # The bar goes back to what was recorded before.
    drag_to(visitor, 0.2)
    expect(visitor.at("bar-state")).to_have_text("Past")
    visitor.until(lambda: visitor.sim.time_s < time_s)
    visitor.picture("branch")


@at_length
def test_a_living_world_is_looked_back_at_and_goes_on(visitor: Visitor, new_page: NewPage) -> None:
    present = visitor.sim
    expect(visitor.at("bar-state")).to_have_text("Now")
    expect(visitor.at("on-long")).to_be_disabled()
    visitor.tab("wire")
    visitor.send("D,6,3")
    visitor.until(lambda: present.now_ns > 2_000_000_000)
    drag_to(visitor, 0.5)
    expect(visitor.at("bar-state")).to_have_text("Past")
    now_ns = present.now_ns
    assert visitor.sim is not present
    visitor.until(lambda: visitor.seen(1) == pytest.approx(visitor.sim.pose(1), abs=0.1))
    assert visitor.sim.pose(1) != present.pose(1)
    visitor.picture("looking_back")
    visitor.drag_refused()
    visitor.send("D,0,0")
    visitor.told("which cannot be changed")
    other = Visitor(new_page(), visitor.shown)
    expect(other.at("bar-state")).to_have_text("Past")
    other.at("back-long").click()
    visitor.until(lambda: visitor.sim.time_s < present.time_s - 1)
    assert present.now_ns == now_ns, "it stands still meanwhile"
    visitor.click("go-on-from-here", shows={"dialog-text": "ends. Time is paused first"})
    visitor.at("dialog-no").click()
    visitor.at("back-to-now").click()
    for each in (visitor, other):
        expect(each.at("bar-state")).to_have_text("Now")
    assert visitor.sim is present
    visitor.until(lambda: present.now_ns > now_ns)
    visitor.pause()

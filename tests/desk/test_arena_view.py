"""The arena view in a real browser, against a desk without a simulation (fake_desk.py)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser
from tests.at_length import at_length, cases
from tests.desk.visits import NewPage, Visit, fake_desk

SENSOR_RAD = math.radians(66.4)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with fake_desk() as address:
        yield address


@pytest.fixture
def visit(new_page: NewPage, address: str) -> Callable[..., Visit]:
    def open_page(query: str = "", **options: Any) -> Visit:
        return Visit(new_page(1200, 800, **options), address, query)

    return open_page


def last(said: list[dict[str, Any]], kind: str) -> dict[str, Any]:
    return [message for message in said if message["kind"] == kind][-1]


@at_length
@pytest.mark.parametrize("dark", ["true", "false"])
def test_both_views_draw(visit: Callable[..., Visit], dark: str) -> None:
    here = visit(f"view=both&dark={dark}")
    here.wait("() => kiksDesk.isSolid() && kiksDesk.stats().solid_frames > 3")
    assert ("kiks-dark" in here.page.locator("[data-testid=arena]").get_attribute("class")) == (dark == "true")
    # Before robots drive, which would come here.
    shades = {here.colour(115 + 90 * k, 195)[0] // 8 for k in range(5)} | {here.colour(300, 300)[0] // 8}
    assert len(shades) == 6, "walls of five brightnesses and the floor look different"
    here.ask("drive")
    drawn = here.page.evaluate("kiksDesk.stats().frames_drawn")
    here.wait("(drawn) => kiksDesk.stats().frames_drawn > drawn + 10", drawn)
    assert here.page.evaluate("kiksDesk.stats().bytes") > 1000


def test_a_frame_is_read_as_it_was_written(visit: Callable[..., Visit]) -> None:
    here = visit()
    robot = here.feed(
        """(({ speeds, commanded, encoders, ambient, arm, jaws, leds, straight_mm }) => ({
            speeds: [...speeds], commanded: [...commanded], encoders: [...encoders], ambient: [...ambient],
            arm, jaws, leds, straight_mm,
        }))(feed.frame.robot(1))"""
    )
    assert robot["speeds"] == robot["commanded"] == [10, 10]
    assert robot["encoders"] == [5, 6]
    assert robot["ambient"] == [450] * 8
    assert (robot["arm"], robot["jaws"], robot["straight_mm"], robot["leds"]) == (230, 120, 3, [False, False])
    assert here.feed("feed.frame.lamp(1).isOn") is False
    assert here.feed("feed.frame.body(0)") == {"x_mm": 420, "y_mm": 320, "isGripped": False, "isLifted": False}
    assert here.feed("[feed.frame.camera(0).pixels.length, feed.frame.camera(1), feed.frame.rays(2).length]") == [
        64,
        None,
        56,
    ]
    assert here.feed("[feed.frame.speed_now, feed.frame.isPaused, feed.connection]") == [1, False, "open"]


def test_a_robot_is_dragged(visit: Callable[..., Visit]) -> None:
    here = visit()
    x_mm, y_mm, _ = here.pose(1)
    here.drag((x_mm + 3, y_mm), (x_mm + 63, y_mm + 40))
    said = here.heard("(said) => said.some((message) => message.kind === 'drop')")
    assert said[0] == {"kind": "grab", "what": "robot", "index": 1}
    moved = last(said, "move")
    assert (moved["x_mm"], moved["y_mm"]) == pytest.approx((x_mm + 60, y_mm + 40), abs=0.1)
    assert said[-1]["kind"] == "drop"


@pytest.mark.parametrize("how", cases(["rim", "right button", "shift"]))
def test_a_robot_is_turned(visit: Callable[..., Visit], how: str) -> None:
    here = visit()
    x_mm, y_mm, heading_rad = here.pose(2)
    arm = 25.5 if how == "rim" else 15.0
    if how == "shift":
        here.page.keyboard.down("Shift")
    here.drag((x_mm + arm, y_mm), (x_mm, y_mm + 60), "right" if how == "right button" else "left")
    said = here.heard("(said) => said.some((message) => message.kind === 'drop')")
    assert {message["kind"] for message in said} == {"grab", "turn", "drop"}
    turned = last(said, "turn")["heading_rad"] - heading_rad
    assert math.remainder(turned - math.pi / 2, 2 * math.pi) == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize(
    ("what", "index", "place"),
    cases([("body", 0, (420, 320)), ("lamp", 1, (80, 300)), ("body", 1, (500, 320))], 2),
)
def test_bodies_and_lamps_are_dragged(
    visit: Callable[..., Visit], what: str, index: int, place: tuple[float, float]
) -> None:
    here = visit()
    here.drag(place, (place[0] + 20, place[1] + 30))
    said = here.heard("(said) => said.some((message) => message.kind === 'drop')")
    assert said[0] == {"kind": "grab", "what": what, "index": index}
    assert (last(said, "move")["x_mm"], last(said, "move")["y_mm"]) == pytest.approx(
        (place[0] + 20, place[1] + 30), abs=0.1
    )
    here.drag((place[0] + 20, place[1] + 30), place)
    here.heard("(said) => said.filter((message) => message.kind === 'drop').length === 2")


@at_length
def test_escape_moves_a_dragged_thing_back(visit: Callable[..., Visit]) -> None:
    here = visit()
    here.page.mouse.move(*here.on_page(420, 320))
    here.page.mouse.down()
    here.page.mouse.move(*here.on_page(460, 350), steps=4)
    here.page.keyboard.press("Escape")
    here.page.mouse.up()
    said = here.heard("(said) => said.some((message) => message.kind === 'drop')")
    assert (last(said, "move")["x_mm"], last(said, "move")["y_mm"]) == (420, 320)


def test_keys_select_move_and_turn(visit: Callable[..., Visit]) -> None:
    here = visit()
    here.page.locator("[data-testid=arena-top]").focus()
    here.page.keyboard.press("n")
    assert "robot 1 selected" in here.page.locator("[aria-live]").inner_text()
    x_mm, y_mm, heading_rad = here.pose(0)
    for key in ("ArrowRight", "Shift+ArrowUp", "q"):
        here.page.keyboard.press(key)
    said = here.heard("(said) => said.filter((message) => message.kind === 'drop').length === 3")
    assert [message["kind"] for message in said] == [
        "grab",
        "move",
        "drop",
        "grab",
        "move",
        "drop",
        "grab",
        "turn",
        "drop",
    ]
    assert (last(said, "move")["x_mm"], last(said, "move")["y_mm"]) == pytest.approx((x_mm + 10, y_mm + 1), abs=0.01)
    assert math.remainder(said[7]["heading_rad"] - heading_rad, 2 * math.pi) == pytest.approx(math.radians(5), abs=1e-3)
    here.page.keyboard.press("Escape")
    assert here.page.locator("[aria-live]").inner_text() == "Nothing selected"


@at_length
def test_tab_leaves_the_view_after_the_last_thing(visit: Callable[..., Visit]) -> None:
    here = visit()
    here.page.locator("[data-testid=arena-top]").focus()
    count = here.feed("feed.frame.robot_count + feed.frame.body_count + feed.frame.lamp_count")
    for _ in range(count):
        here.page.keyboard.press("Tab")
    assert here.page.evaluate("document.activeElement.dataset.testid") == "arena-top"
    here.page.keyboard.press("Tab")
    assert here.page.evaluate("document.activeElement.dataset.testid") is None


def test_a_click_picks_and_selects(visit: Callable[..., Visit]) -> None:
    here = visit()
    x_mm, y_mm, heading_rad = here.pose(2)
    angle = heading_rad + SENSOR_RAD
    sensor_mm = x_mm + 24 * math.cos(angle), y_mm + 24 * math.sin(angle)
    for count, place_mm in enumerate(((x_mm, y_mm), sensor_mm, (500, 520)), 1):
        here.click(*place_mm)
        # One after the other: the server may hear two that come at once in either order.
        said = here.heard(f"(said) => said.length === {count}")
    assert [(pick["what"], pick["index"], pick["sensor"]) for pick in said] == [
        ("robot", 2, -1),
        ("sensor", 2, 0),
        ("floor", -1, -1),
    ]
    assert (said[2]["x_mm"], said[2]["y_mm"]) == pytest.approx((500, 520), abs=0.7)


@pytest.mark.parametrize(
    ("tool", "points"),
    [
        ("rectangle", [[200, 480], [260, 520]]),
        ("line", [[200, 480], [260, 520]]),
        ("point", [[260, 520]]),
        ("freehand", None),
    ],
)
def test_tools_draw_on_the_grid(visit: Callable[..., Visit], tool: str, points: list[list[float]] | None) -> None:
    here = visit(f"tool={tool}")
    here.drag((198, 482), (263, 517))
    (said,) = here.heard("(said) => said.length === 1")
    assert (said["kind"], said["what"]) == ("draw", tool)
    if points is None:
        assert (said["points"][0], said["points"][-1]) == ([200, 480], [260, 520])
        assert len(said["points"]) > 2
        assert all(value % 10 == 0 for point in said["points"] for value in point)
    else:
        assert said["points"] == points


@at_length
def test_escape_ends_a_stroke_and_strokes_end_at_the_arena(visit: Callable[..., Visit]) -> None:
    here = visit("tool=line")
    here.page.mouse.move(*here.on_page(200, 500))
    here.page.mouse.down()
    here.page.mouse.move(*here.on_page(250, 500))
    here.page.keyboard.press("Escape")
    here.page.mouse.up()
    here.drag((40, 500), (-15, 500))
    (said,) = here.heard("(said) => said.length === 1")
    assert said["points"] == [[40, 500], [0, 500]]


def test_the_wheel_zooms_about_the_pointer_and_the_floor_is_dragged(visit: Callable[..., Visit]) -> None:
    here = visit()
    x, y = here.on_page(450, 520)
    here.page.mouse.move(x, y)
    wide = here.on_page(500, 520)[0] - x
    here.page.mouse.wheel(0, -300)
    here.wait("([x, y, wide]) => kiksDesk.toClient(500, 520)[0] - x > 1.3 * wide", [x, y, wide])
    assert here.on_page(450, 520) == pytest.approx((x, y), abs=0.5)
    here.page.mouse.down()
    here.page.mouse.move(x - 80, y + 30, steps=3)
    here.page.mouse.up()
    assert here.on_page(450, 520) == pytest.approx((x - 80, y + 30), abs=1)
    here.ask("fit")
    here.wait(
        "([x, y]) => Math.hypot(kiksDesk.toClient(450, 520)[0] - x, kiksDesk.toClient(450, 520)[1] - y) < 0.01", [x, y]
    )


def test_fingers_drag_and_pinch(visit: Callable[..., Visit]) -> None:
    here = visit(has_touch=True)
    touch = here.page.context.new_cdp_session(here.page)

    def fingers(kind: str, *places: tuple[float, float]) -> None:
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y} for x, y in places]})

    fingers("touchStart", here.on_page(420, 320))
    for step in range(1, 6):
        fingers("touchMove", here.on_page(420 + 8 * step, 320))
    fingers("touchEnd")
    said = here.heard("(said) => said.some((message) => message.kind === 'drop')")
    assert said[0] == {"kind": "grab", "what": "body", "index": 0}
    assert last(said, "move")["x_mm"] == pytest.approx(460, abs=1)
    x, y = here.on_page(500, 520)
    wide = here.on_page(600, 520)[0] - x
    fingers("touchStart", (x - 50, y), (x + 50, y))
    fingers("touchMove", (x - 100, y), (x + 100, y))
    fingers("touchEnd")
    assert here.on_page(600, 520)[0] - here.on_page(500, 520)[0] == pytest.approx(2 * wide, rel=0.02)


@at_length
def test_select_from_python(visit: Callable[..., Visit]) -> None:
    here = visit()
    here.ask("select")
    here.wait("() => document.querySelector('[aria-live]').textContent.startsWith('cylinder 2 selected')")


def test_a_lost_connection_is_restored(visit: Callable[..., Visit]) -> None:
    here = visit()
    here.page.evaluate(
        """import('kiks-desk').then(({ pageFeed }) => {
            window.heard = [];
            pageFeed().on('connection', (now) => window.heard.push(now));
        })"""
    )
    received = here.page.evaluate("kiksDesk.stats().frames_received")
    here.ask("cut")
    here.wait("() => window.heard.join() === 'lost,open'")
    here.wait("(received) => kiksDesk.stats().frames_received > received + 5 && kiksDesk.pose(0)", received)
    assert here.page.locator("[data-testid=arena-notice]").is_hidden()


@pytest.mark.parametrize("end", ["close", "replace"])
def test_a_page_leaves_a_desk_that_has_ended(visit: Callable[..., Visit], end: str) -> None:
    here = visit()
    here.page.evaluate("import('kiks-desk').then(({ pageFeed }) => { window.feed = pageFeed(); })")
    here.wait("() => window.socket.connected")
    here.ask(end)
    if end == "close":
        here.wait("() => window.feed.connection === 'lost'")
        here.page.evaluate("{ const now = performance.now.bind(performance); performance.now = () => now() + 61_000; }")
    # Another server may have the port now. The page recognises that and stops sending requests.
    here.wait("() => window.feed.connection === 'gone' && window.feed._socket.readyState === WebSocket.CLOSED")
    assert here.page.evaluate("[window.feed._timer, window.socket.active]") == [None, False]
    assert "has ended" in here.page.locator("[data-testid=arena-notice]").inner_text()


def test_a_hidden_page_gets_no_frames(visit: Callable[..., Visit]) -> None:
    here = visit()
    hide = """(isHidden) => {
        Object.defineProperty(document, 'hidden', { value: isHidden, configurable: true });
        document.dispatchEvent(new Event('visibilitychange'));
    }"""
    here.page.evaluate(hide, True)
    here.page.evaluate("import('kiks-desk').then(({ pageFeed }) => { window.feed = pageFeed(); })")
    here.wait("() => window.feed._owed === 3")
    received = here.feed("feed.frames_received")
    here.page.evaluate(hide, False)
    here.wait("(received) => window.feed._owed <= 1 && window.feed.frames_received > received + 5", received)


def test_a_new_scene_replaces_the_old_one(visit: Callable[..., Visit]) -> None:
    here = visit("view=both")
    here.wait("() => kiksDesk.isSolid()")
    count, number = here.feed("[feed.scene.robots.length, feed.scene.scene]")
    parts = here.page.evaluate("kiksDesk.stats().solid_parts")
    here.ask("scene")
    here.wait("([count, number]) => kiksDesk.scene().scene === number + 1 && kiksDesk.pose(count)", [count, number])
    drawn = here.page.evaluate("kiksDesk.stats().solid_frames")
    here.wait("(drawn) => kiksDesk.stats().solid_frames > drawn + 3", drawn)
    assert here.feed("feed.frame.scene === feed.scene.scene")
    grown = here.page.evaluate("kiksDesk.stats().solid_parts") - parts
    assert grown <= 2, "the graphics card keeps the one more robot's name and turrets, and nothing of the old scene"


@at_length
def test_without_webgl_the_top_view_works(visit: Callable[..., Visit], browser_without_3d: Browser) -> None:
    here = visit("view=both", by=browser_without_3d)
    here.wait("() => document.querySelector('[data-testid=arena-solid]').textContent.includes('needs WebGL 2')")
    x_mm, y_mm, _ = here.pose(1)
    here.drag((x_mm, y_mm), (x_mm + 10, y_mm))
    here.heard("(said) => said.some((message) => message.kind === 'drop')")
    assert not here.page.evaluate("kiksDesk.isSolid()")

"""The arena view and its feed in a real browser: hands, keys, fingers, zoom, and connections."""

import math
import re
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from tests.at_length import at_length, cases
from tests.desk.visitor import Browser, NewPage, Page, Shown, Visitor, expect

from kiks.engine.sensing.lamplight import light_floor
from kiks.export.light import light_scale
from kiks.export.looks import LED_COLOURS
from kiks.firmware.khepera import kind
from kiks.firmware.robot_looks import Led, RobotLooks, Slab, disc
from kiks.model.robot import Body

pytestmark = pytest.mark.slow


def test_a_frame_is_read_as_it_was_written(visitor: Visitor) -> None:
    visitor.sim.add_lamp(100, 50, power_w=3.0, is_on=False)
    visitor.tab("wire")
    visitor.choose("wire-robot", "robot 2")
    for command in ("D,3,-4", "L,1,1", "T,1,E,200", "T,1,D,1"):
        visitor.send(command)
    visitor.until(lambda: visitor.setpoints(2) == [3, -4])
    visitor.pause()
    visitor.until(lambda: visitor.feed("feed.frame.isPaused && feed.frame.time_s") == visitor.sim.time_s)
    sim, record = visitor.sim, visitor.sim.world.state.robots[0, 1]
    counted = (record["pulse_count"] + record["counter_offset"]).tolist()
    read = [sim.proximity(2, noise=True), pytest.approx(sim.ambient(2, noise=True))]
    names = ["commanded", "encoders", "proximity", "ambient"]
    robot = visitor.feed(f"{names}.map((name) => [...feed.frame.robot(1)[name]])")
    assert robot == [[3, -4], counted, *read]
    assert visitor.feed("[0, 1].map((led) => feed.frame.robot(1).isLit(led))") == [False, True]
    assert visitor.feed("feed.frame.lamp(1)") == {"x_mm": 100, "y_mm": 50, "power_w": 3, "isOn": False}
    assert visitor.feed("feed.frame.body(0)") == {"x_mm": 300, "y_mm": 100, "isGripped": False, "isLifted": False}
    sizes = "[feed.frame.camera(0).pixels.length, feed.frame.camera(1), feed.frame.rays(1).length]"
    assert visitor.feed(sizes) == [64, None, 56]


YELLOW = """([x_mm, y_mm]) => {
    const canvas = document.querySelector("[data-testid=arena-top]"), [x, y] = kiksDesk.toClient(x_mm, y_mm);
    const { left, top, width } = canvas.getBoundingClientRect(), ratio = canvas.width / width;
    const [red, , blue] = canvas.getContext("2d").getImageData(ratio * (x - left), ratio * (y - top), 1, 1).data;
    return red - blue;
}"""
"""How yellow the arena is at a place."""


LIGHT = """async ([cells, shape, lamps, step_mm, strengths, flux]) => {
    const { engine } = (await import("kiks-desk")).pageFeed(), { top } = engine;
    const put = (Kind, numbers, shape) => {
        const array = engine.array(Kind.BYTES_PER_ELEMENT, shape);
        new Kind(engine.memory.buffer, array.at, numbers.length).set(numbers);
        return array;
    };
    const out = engine.array(4, [30, 40]);
    engine.call("light_floor", put(Uint8Array, cells, shape), 5, put(Float64Array, lamps, [lamps.length / 4, 4]),
        put(Float64Array, strengths, [strengths.length]), step_mm, flux, out);
    const found = [...new Float32Array(engine.memory.buffer, out.at, 1200)];
    engine.release(top);
    return found;
}"""
"""What the engine in the browser says of the light on a floor."""


def test_the_engine_of_the_page_lights_the_floor_as_that_of_the_desk_to_the_bit(visitor: Visitor) -> None:
    cells, lamps = np.zeros((60, 80), np.uint8), np.array([[101.5, 120.0, 0.2, 1.0], [300.0, 40.0, 0.3, 1.0]])
    cells[20:40, 38:41] = cells[5:9, 60:70] = 255
    scale, out = light_scale(visitor.sim.specs[0]), np.empty((30, 40), np.float32)
    light_floor(cells, 5.0, lamps, np.array(scale.strengths), scale.step_mm, scale.background_flux, out)
    told = [cells.ravel().tolist(), cells.shape, lamps.ravel().tolist(), *scale]
    visitor.until(lambda: visitor.feed("feed.engine !== null"))
    assert visitor.page.evaluate(LIGHT, told) == out.ravel().tolist()
    assert out.min() < 0.2 < 0.8 < out.max()


def test_the_floor_is_lit_around_lamps_that_are_on(visitor: Visitor) -> None:
    page, sim = visitor.page, visitor.sim
    visitor.pause()
    visitor.until(lambda: page.evaluate(YELLOW, (125, 335)) > page.evaluate(YELLOW, (555, 45)) + 15)
    with sim.lock:
        sim.lamps[0, :2] = 525, 45
    visitor.until(lambda: page.evaluate(YELLOW, (555, 45)) > page.evaluate(YELLOW, (125, 335)) + 15)
    with sim.lock:
        sim.lamps[0, 3] = 0
    visitor.until(lambda: page.evaluate(YELLOW, (555, 45)) == page.evaluate(YELLOW, (125, 335)))


def test_pictures_do_not_wait_for_the_engine_and_a_desk_that_is_found_again_is_asked_for_it(
    new_page: NewPage, shown: Shown
) -> None:
    page = new_page()
    asked: list[Any] = []
    page.route("**/engine.wasm", lambda route: asked.append(route))
    visitor = Visitor(page, shown)
    visitor.until(lambda: asked)
    drawn = visitor.answer("kiksDesk.stats().frames_drawn")
    visitor.until(lambda: visitor.answer("kiksDesk.stats().frames_drawn") > drawn + 5)
    assert visitor.feed("feed.engine") is None
    with page.expect_console_message(lambda said: "no light of lamps" in said.text):
        asked[0].fulfill(body="no engine")
    cut(page)
    visitor.until(lambda: len(asked) > 1)
    asked[1].continue_()
    visitor.until(lambda: visitor.feed("feed.engine !== null"))
    page.unroute("**/engine.wasm")


@pytest.mark.parametrize("view", ["2-D", "3-D"])
def test_a_kind_of_robot_has_its_own_shapes_and_leds(
    monkeypatch: pytest.MonkeyPatch, new_page: NewPage, shown: Shown, view: str
) -> None:
    def looks(body: Body) -> RobotLooks:
        # They stand out on the side from which the robot is seen, as a turret covers it.
        leds = tuple(Led(name, 20.0 - 10.0 * k, -34.0, 30.0, "green") for k, name in enumerate("abcde"))
        return RobotLooks("#1020f0", slabs=(Slab(disc(body.radius_mm, "#1020f0"), 5.0, 25.0),), leds=leds)

    toy = replace(kind.KHEPERA, looks=looks, lit=lambda records: records["registers"][:, :5])
    monkeypatch.setattr(kind, "KHEPERA", toy)
    visitor, colour = Visitor(new_page(), shown), "lit" if view == "2-D" else "solid_lit"
    visitor.at("views").get_by_text(view).click()
    visitor.shows({"facts": "a off, b off, c off, d off, e off"})

    def greens() -> int:
        picture = np.asarray(Image.open(BytesIO(visitor.at("arena").screenshot())).convert("RGB"))
        away = picture.astype(int) - list(bytes.fromhex(LED_COLOURS["green"][colour][1:]))
        return int((np.abs(away).max(axis=-1) < 10).sum())

    assert greens() == 0
    visitor.sim.world.state.robots["registers"][0, 0, 2:5] = 1
    visitor.shows({"facts": "a off, b off, c on, d on, e on"})
    assert visitor.until(greens) > 3
    assert visitor.feed("[0, 1].map((robot) => feed.frame.robot(robot).isLit(4))") == [True, False]
    visitor.picture(f"looks of a kind, {view}")


def test_between_two_frames_a_robot_turns_the_short_way_from_the_one_to_the_other(visitor: Visitor) -> None:
    headings_rad = visitor.feed(
        """[[0.5, 1.0], [1.0, 0.5], [3.0, -3.0]].map(([begin_rad, end_rad]) => {
            const { constructor: Frame, buffer } = feed.frame, heading_at = 32 + 4 * 2;
            const [before, frame] = [begin_rad, end_rad].map((heading_rad) => {
                const copy = buffer.slice(0);
                new DataView(copy).setFloat32(heading_at, heading_rad, true);
                return new Frame(copy, 1000);
            });
            Object.assign(frame, { previous: before, interval_ms: 100 });
            return [1000, 1050, 1100].map((now_ms) => frame.pose(0, now_ms).heading_rad);
        })"""
    )
    assert headings_rad[0] == pytest.approx([0.5, 0.75, 1.0], abs=1e-6)
    assert headings_rad[1] == pytest.approx([1.0, 0.75, 0.5], abs=1e-6)
    assert headings_rad[2] == pytest.approx([3.0 - 2 * math.pi, -math.pi, -3.0], abs=1e-6)


# ---- hands ----


@pytest.mark.parametrize("how", cases(["rim", "right button", "shift"]))
def test_a_robot_is_turned(visitor: Visitor, how: str) -> None:
    x_mm, y_mm, _ = visitor.sim.pose(1)
    arm_mm = 25.5 if how == "rim" else 15.0
    if how == "shift":
        visitor.page.keyboard.down("Shift")
    button = "right" if how == "right button" else "left"
    visitor.pull((x_mm + arm_mm, y_mm), (x_mm, y_mm + 60), button)
    visitor.page.mouse.up(button=button)
    visitor.until(lambda: visitor.sim.pose(1) == pytest.approx((x_mm, y_mm, math.pi / 2), abs=0.01))


def test_bodies_and_lamps_are_dragged_escape_moves_them_back_and_delete_removes_them(visitor: Visitor) -> None:
    def is_shown() -> bool:
        seen = visitor.feed("[feed.frame.body(0).x_mm, feed.frame.body(1).x_mm]")
        return bool(seen == pytest.approx(visitor.sim.bodies()["x_mm"].tolist(), abs=0.01))

    for place_mm in ((300.0, 100.0), (450.0, 100.0), (80.0, 340.0)):
        there_mm = place_mm[0] + 20, place_mm[1] - 30
        visitor.drag(place_mm, there_mm)
        visitor.until(is_shown)
        visitor.pull(there_mm, place_mm)
        visitor.page.keyboard.press("Escape")
        visitor.let_go()

    def places_mm() -> list[float]:
        bodies, lamp = visitor.sim.bodies(), visitor.sim.lamps[0]
        return [*bodies["x_mm"], *bodies["y_mm"], *lamp[:2]]

    # What Escape moves back comes over the network.
    visitor.until(lambda: places_mm() == pytest.approx([320, 470, 70, 70, 100, 310], abs=0.6))
    visitor.page.mouse.click(*visitor.on_page(320, 70))
    visitor.page.keyboard.press("Delete")
    visitor.until(lambda: visitor.sim.bodies()["x_mm"].tolist() == pytest.approx([470], abs=0.6))
    assert visitor.sim.robot_count == 2


def test_keys_select_move_and_turn_and_tab_leaves_the_view(visitor: Visitor) -> None:
    live = visitor.page.locator(".kiks-live")
    visitor.at("arena-top").focus()
    visitor.page.keyboard.press("n")
    expect(live).to_contain_text("robot 1 selected")
    x_mm, y_mm, heading_rad = visitor.sim.pose(1)
    for key in ("ArrowRight", "Shift+ArrowUp", "q"):
        visitor.page.keyboard.press(key)
    there = x_mm + 10, y_mm + 1, heading_rad + math.radians(5)
    visitor.until(lambda: visitor.sim.pose(1) == pytest.approx(there, abs=0.01))
    visitor.page.keyboard.press("Escape")
    expect(live).to_have_text("Nothing selected")
    # Tab leaves the view after the last thing.
    for _ in range(visitor.feed("feed.frame.robot_count + feed.frame.body_count + feed.frame.lamp_count")):
        visitor.page.keyboard.press("Tab")
    expect(visitor.at("arena-top")).to_be_focused()
    visitor.page.keyboard.press("Tab")
    expect(visitor.at("arena-top")).not_to_be_focused()


def test_the_wheel_zooms_about_the_pointer_and_the_floor_is_dragged(visitor: Visitor) -> None:
    mouse, wait = visitor.page.mouse, visitor.page.wait_for_function
    (x_before, y_before), (x, y) = visitor.on_page(200, 320), visitor.on_page(300, 320)
    mouse.move(x, y)
    mouse.wheel(0, -300)
    wait("([x, wide]) => x - kiksDesk.toClient(200, 320)[0] > 1.3 * wide", arg=[x, x - x_before])
    assert visitor.on_page(300, 320) == pytest.approx((x, y), abs=0.5)
    mouse.down()
    mouse.move(x - 80, y + 30, steps=3)
    mouse.up()
    assert visitor.on_page(300, 320) == pytest.approx((x - 80, y + 30), abs=1)
    visitor.at("fit").click()
    visitor.until(lambda: visitor.on_page(200, 320) == pytest.approx((x_before, y_before), abs=0.01))


def test_fingers_drag_and_pinch(new_page: NewPage, shown: Shown) -> None:
    visitor = Visitor(new_page(has_touch=True), shown)
    touch = visitor.page.context.new_cdp_session(visitor.page)

    def fingers(kind: str, *places: tuple[float, float]) -> None:
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y} for x, y in places]})

    fingers("touchStart", visitor.on_page(300, 100))
    for x_mm in (320, 340):
        fingers("touchMove", visitor.on_page(x_mm, 100))
    fingers("touchEnd")
    visitor.until(lambda: visitor.sim.bodies()["x_mm"][0] == pytest.approx(340, abs=1))
    x, y = visitor.on_page(300, 320)
    wide = visitor.on_page(400, 320)[0] - x
    fingers("touchStart", (x - 50, y), (x + 50, y))
    fingers("touchMove", (x - 100, y), (x + 100, y))
    fingers("touchEnd")
    assert visitor.on_page(400, 320)[0] - visitor.on_page(300, 320)[0] == pytest.approx(2 * wide, rel=0.02)


@at_length
def test_without_webgl_the_top_view_works(new_page: NewPage, shown: Shown, browser_without_3d: Browser) -> None:
    visitor = Visitor(new_page(by=browser_without_3d), shown)
    visitor.at("views").get_by_text("both").click()
    expect(visitor.at("arena-solid")).to_contain_text("needs WebGL 2")
    visitor.drag((150, 200), (160, 200))
    assert not visitor.answer("kiksDesk.isSolid()")


def test_a_snapshot_is_a_picture_of_what_is_seen(visitor: Visitor, tmp_path: Path) -> None:
    visitor.pause()
    visitor.at("views").get_by_text("both").click()
    visitor.page.wait_for_function("() => kiksDesk.isSolid()")
    with visitor.page.expect_download() as downloaded:
        visitor.at("snapshot").click()
    assert re.fullmatch(r"room \dm\d\d\.\d\ds\.png", downloaded.value.suggested_filename)
    downloaded.value.save_as(tmp_path / "snapshot.png")
    box = visitor.at("arena").bounding_box()
    with Image.open(tmp_path / "snapshot.png") as picture:
        assert picture.size == pytest.approx((box["width"], box["height"]), abs=1)
        assert len(picture.convert("RGB").getcolors(1_000_000) or ()) > 100  # not blank


# ---- scenes and connections ----


def test_a_new_scene_replaces_the_old_one(visitor: Visitor) -> None:
    wait = visitor.page.wait_for_function
    visitor.at("views").get_by_text("both").click()
    wait("() => kiksDesk.isSolid() && kiksDesk.stats().solid_frames > 1")
    parts, number = visitor.answer("[kiksDesk.stats().solid_parts, kiksDesk.scene().scene]")
    visitor.sim.add_robot()
    wait("(number) => kiksDesk.scene().scene > number && kiksDesk.pose(2)", arg=number)
    drawn = visitor.answer("kiksDesk.stats().solid_frames")
    wait("(drawn) => kiksDesk.stats().solid_frames > drawn + 1", arg=drawn)
    assert visitor.feed("feed.frame.scene === feed.scene.scene")
    # The graphics card keeps what one more robot needs, and nothing of the old scene.
    assert visitor.answer("kiksDesk.stats().solid_parts") <= parts + 2


def cut(page: Page) -> None:
    """Cut the connection of a page, whose feed is `window.feed` from now on."""
    page.evaluate("import('kiks-desk').then(({ pageFeed }) => { window.heard = []; window.feed = pageFeed(); })")
    page.evaluate("{ feed.on('connection', (now) => window.heard.push(now)); feed._socket.close(); }")


def test_a_lost_connection_is_restored(visitor: Visitor) -> None:
    visitor.page.wait_for_function("() => window.socket.connected")
    cut(visitor.page)
    visitor.page.wait_for_function("() => window.heard.join() === 'lost,open'")
    received = visitor.answer("kiksDesk.stats().frames_received")
    visitor.page.wait_for_function("(received) => kiksDesk.stats().frames_received > received + 5", arg=received)
    assert visitor.at("arena-notice").is_hidden()


@pytest.mark.parametrize("end", ["closed", "replaced"])
def test_a_page_leaves_a_desk_that_has_ended(new_page: NewPage, shown: Shown, end: str) -> None:
    page, is_closed = new_page(), False
    page.route_web_socket("**/feed", lambda feed: feed.close() if is_closed else feed.connect_to_server())
    visitor = Visitor(page, shown)
    page.wait_for_function("() => window.socket.connected")
    is_closed = end == "closed"
    if end == "replaced":
        shown.desk.secret = "that of another desk"
        number = visitor.answer("kiksDesk.scene().scene")
        shown.desk.renew_scene()
        page.wait_for_function("(number) => kiksDesk.scene().scene > number", arg=number)
    cut(page)
    if is_closed:
        page.wait_for_function("() => feed.connection === 'lost'")
        page.evaluate("{ const now = performance.now.bind(performance); performance.now = () => now() + 61_000; }")
    # Another server may have the port now. The page recognises that and stops sending requests.
    page.wait_for_function("() => feed.connection === 'gone' && feed._socket.readyState === WebSocket.CLOSED")
    assert page.evaluate("[feed._timer, window.socket.active]") == [None, False]
    expect(visitor.at("arena-notice")).to_contain_text("has ended")


def test_a_hidden_page_gets_no_frames(visitor: Visitor) -> None:
    hide = """(isHidden) => {
        Object.defineProperty(document, 'hidden', { value: isHidden, configurable: true });
        document.dispatchEvent(new Event('visibilitychange'));
    }"""
    visitor.answer(hide, True)
    visitor.feed("window.feed = feed, 0")
    visitor.page.wait_for_function("() => feed._unacknowledged === 3")
    received = visitor.answer("feed.frames_received")
    visitor.answer(hide, False)
    seen = "(received) => feed._unacknowledged <= 1 && feed.frames_received > received + 5"
    visitor.page.wait_for_function(seen, arg=received)

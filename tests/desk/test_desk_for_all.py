"""Accessibility of the desk: keyboard, screen readers, contrast, small screens, and many pages."""

import gc
import threading
from collections.abc import Iterator

import pytest
from tests.at_length import at_length, cases, share
from tests.desk.visitor import COLOURS, INSIDE, NewPage, Shown, Visitor, check_access, check_reach, expect

pytestmark = pytest.mark.slow

FOCUS = """() => {
    const each = document.activeElement, style = getComputedStyle(each);
    if (each === document.body) return null;
    each._number ??= window._numbers = (window._numbers ?? 0) + 1;
    const field = each.closest('.q-field, .q-slider'), { outlineStyle, boxShadow } = style;
    const isSeen = field !== null || outlineStyle !== 'none' || boxShadow !== 'none' || each.matches('.cm-content');
    const name = each.closest('[data-testid]')?.dataset.testid;
    return [each._number, name ?? each.ariaLabel ?? each.innerText, isSeen];
}"""
"""Which element has the focus: a number of its own, a name, and whether one sees that it has it."""

ARENA_SHARE = """() => {
    const { width, height } = document.querySelector(".kiks-arena").getBoundingClientRect();
    return (width * height) / (innerWidth * innerHeight);
}"""


def walk(visitor: Visitor) -> Iterator[str]:
    """Press Tab until the focus returns to the start; return all elements that had it."""
    seen: list[int] = []
    for _ in range(120):
        if seen and visitor.answer("document.activeElement.matches('.cm-content')"):
            # There Tab indents, until Escape was pressed: the help says so.
            visitor.page.keyboard.press("Escape")
        visitor.page.keyboard.press("Tab")
        here = visitor.answer(FOCUS)
        if here is None:
            continue
        number, name, is_seen = here
        if len(seen) > 1 and number == seen[0]:
            return
        assert is_seen, f"one does not see that {name!r} has the focus"
        seen.append(number)
        yield name
    raise AssertionError("Tab does not come round")


@pytest.mark.parametrize(
    ("tab", "inside"),
    cases(
        [
            ("programs", ("script", "new-program", "editor", "save-program", "robot", "run-program")),
            ("robot", ("monitor-robot", "proximity-0", "ambient-7", "curves-speeds")),
            ("wire", ("wire-robot", "wire-filter", "wire-hold", "wire-window", "console", "console-send")),
            ("arena", ("tool-rectangle", "brush", "material", "new-arena", "open", "save-name", "save")),
            ("settings", ("seed", "thinking", "baud", "link", "model", "noise", "add-robot", "apply", "start-over")),
        ]
    ),
)
def test_tab_reaches_everything(visitor: Visitor, tab: str, inside: tuple[str, ...]) -> None:
    visitor.tab(tab)
    visitor.answer("document.activeElement.blur()")
    above = ("run", "step", "speed", "mark", "reset", "views", "layers", "follow", "fit", "dark", "help", "arena-top")
    assert set(walk(visitor)) >= {*above, *inside, f"tab-{tab}"}


def test_axe_finds_nothing_serious(visitor: Visitor) -> None:
    for theme, rules in (("Light", None), ("Dark", share(COLOURS, None))):
        visitor.choose("dark", theme)
        expect(visitor.page.locator("body.body--dark .kiks-arena.kiks-dark")).to_have_count(int(theme == "Dark"))
        for tab in INSIDE:
            visitor.tab(tab)
            visitor.page.mouse.move(5, 400)
            if tab == "robot":
                visitor.at("proximity-0").click()
                expect(visitor.at("explanation")).to_be_visible()
            elif tab == "arena":
                visitor.at("arena-top").press("n")
                visitor.at("arena-top").press("Enter")
                expect(visitor.at("properties")).to_be_visible()
            check_access(visitor.page, f"{tab}, {theme}", rules)
            visitor.picture(f"{tab}_{theme.lower()}")
        for opener in ("help", "layers", "follow"):
            visitor.at(opener).click()
            expect(opened := visitor.page.locator(".q-menu, .q-dialog__inner")).to_be_visible()
            check_access(visitor.page, f"{opener}, {theme}", rules)
            visitor.picture(f"{opener}_{theme.lower()}")
            visitor.page.keyboard.press("Escape")
            expect(opened).to_have_count(0)


def test_readers_of_screens_hear_what_happens(visitor: Visitor) -> None:
    live = visitor.page.locator(".kiks-live")
    visitor.page.keyboard.press("Space")
    expect(live).to_contain_text("Paused at 0:")
    visitor.page.keyboard.press("Space")
    expect(live).to_have_text("Time goes on")
    visitor.sim.place(1, 555, 200, 0.0)
    visitor.tab("wire")
    visitor.send("D,10,10")
    expect(live).to_have_text("robot 1 touches something")


@pytest.mark.parametrize(
    ("width", "height"), cases([(390, 844), (768, 1024), (844, 390), (800, 600), (1024, 768)], normally=2)
)
def test_fingers_reach_everything_on_small_screens(new_page: NewPage, shown: Shown, width: int, height: int) -> None:
    visitor = Visitor(new_page(width, height, has_touch=True, is_mobile=True), shown)
    for tab in INSIDE:
        visitor.tab(tab)
        visitor.picture(f"{tab}_{width}x{height}")
        assert visitor.answer("document.documentElement.scrollWidth") == width
        check_reach(visitor.page, tab)
    assert visitor.answer("document.querySelector('.q-header').offsetHeight") < 90  # the bar has two rows at most
    fingers = visitor.page.context.new_cdp_session(visitor.page)
    for kind, x_mm in (("touchStart", 150), ("touchMove", 180), ("touchMove", 200), ("touchEnd", None)):
        places = [] if x_mm is None else [dict(zip("xy", visitor.on_page(x_mm, 200), strict=True))]
        fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": places})
    visitor.until(lambda: visitor.sim.pose(1)[0] == pytest.approx(200, abs=2))
    visitor.pause()


def test_the_arena_has_half_of_the_page_and_a_browser_remembers_its_edge(new_page: NewPage, shown: Shown) -> None:
    page, known = new_page(1366, 768), ("66", False)
    visitor = Visitor(page, shown)
    for width, height in ((683, 384), (960, 540), (1366, 768)):  # a small laptop and a large screen at 200 %
        page.set_viewport_size({"width": width, "height": height})
        visitor.until(lambda: visitor.answer(ARENA_SHARE) >= 0.5)
    expect(visitor.at("reset").locator(".desk-word")).to_be_visible()
    visitor.tab("programs")
    for width, height in ((1920, 1080), (1366, 768)):
        page.set_viewport_size({"width": width, "height": height})
        editor, output = (visitor.at(name).bounding_box() for name in ("editor", "output"))
        assert editor["height"] > 0.25 * height
        assert output["y"] + output["height"] <= height
    visitor.at("edge").focus()
    for key in ("Right", "Right", "Left"):
        page.keyboard.press(f"Arrow{key}")
    expect(visitor.at("edge")).to_have_attribute("aria-valuenow", "66")
    visitor.click("close-hint")
    expect(page.locator(".desk-hint")).to_be_hidden()
    visitor = Visitor(page, shown)
    assert (visitor.at("edge").get_attribute("aria-valuenow"), page.locator(".desk-hint").is_visible()) == known
    box = visitor.at("edge").bounding_box()
    page.mouse.move(box["x"] + 9, 300)
    page.mouse.down()
    page.mouse.move(box["x"] - 300, 300, steps=3)
    page.mouse.up()
    visitor.until(lambda: float(visitor.at("edge").get_attribute("aria-valuenow")) < 50)


@at_length
def test_closed_pages_leave_nothing_behind(new_page: NewPage, shown: Shown) -> None:
    from nicegui import Client

    from kiks.desk.panels.page import Page

    page = new_page()
    for _ in range(share(2, 4)):
        visitor = Visitor(page, shown)
        for tab in INSIDE:
            visitor.tab(tab)
    page.goto("about:blank")
    visitor.until(lambda: not any(client.has_socket_connection for client in Client.instances.values()))
    visitor.until(lambda: not shown.gateway._viewers)
    forget_all()
    visitor.until(lambda: gc.collect() >= 0 and not any(type(each) is Page for each in gc.get_objects()))
    assert all(wire.log is None for wire in shown.desk.sim.wires), "no line is watched"


def forget_all() -> None:
    """Delete what NiceGUI keeps for pages that may come back, as it does by itself after ten seconds."""
    from nicegui import Client

    from kiks.desk.server.server import SERVER

    done = threading.Event()

    def forget() -> None:
        for client in list(Client.instances.values()):
            for task in client._delete_tasks.values():
                task.cancel()
            client.delete()
        done.set()

    SERVER._loop.call_soon_threadsafe(forget)
    assert done.wait(20)

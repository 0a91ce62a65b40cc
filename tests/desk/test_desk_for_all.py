"""Accessibility of the desk: keyboard, screen readers, contrast, small screens, and many pages."""

from __future__ import annotations

import gc
import re
import threading
from collections.abc import Iterator

import pytest
from nicegui import Client
from playwright.sync_api import expect
from tests.at_length import at_length, cases, share
from tests.desk.visitor import NewPage, Visitor

from kiks.desk.panels.page import Page
from kiks.desk.server.server import SERVER
from kiks.desk.server.show import Shown

pytestmark = pytest.mark.slow

TABS = ("robot", "wire", "arena", "programs", "settings")

NAMELESS = re.compile(
    r"^\s*- (?:button|link|textbox|combobox|spinbutton|slider|switch|checkbox|tab|radio|application)\b(?! \")",
    re.MULTILINE,
)
"""Controls without an accessible name, in Playwright's notation for what a screen reader announces."""

FAINT = """() => {
    const luminance = ([red, green, blue]) => [red, green, blue].map((part) => part / 255)
        .map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4))
        .reduce((sum, part, k) => sum + part * [0.2126, 0.7152, 0.0722][k], 0);
    const pixel = new OffscreenCanvas(1, 1).getContext('2d', { willReadFrequently: true });
    const rgba = (colour) => {
        pixel.clearRect(0, 0, 1, 1);
        pixel.fillStyle = colour;
        pixel.fillRect(0, 0, 1, 1);
        return [...pixel.getImageData(0, 0, 1, 1).data];
    };
    const over = ([r, g, b, a], below) => [r, g, b].map((part, k) => (part * a + below[k] * (255 - a)) / 255);
    const ground = (each) => {
        if (!each) return document.body.classList.contains('body--dark') ? [18, 18, 18] : [255, 255, 255];
        const colour = rgba(getComputedStyle(each).backgroundColor);
        return colour[3] === 255 ? colour : over(colour, ground(each.parentElement));
    };
    const faint = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
        const text = walker.currentNode.textContent.trim(), each = walker.currentNode.parentElement;
        if (!text || !each.checkVisibility({ opacityProperty: true, visibilityProperty: true })) continue;
        if (each.closest('[disabled], .disabled, style, .q-tooltip, .kiks-live, .cm-editor, .q-chip__icon')) continue;
        const below = ground(each), lights = [over(rgba(getComputedStyle(each).color), below), below].map(luminance);
        const contrast = (Math.max(...lights) + 0.05) / (Math.min(...lights) + 0.05);
        if (contrast < 4.5) faint.push(`${contrast.toFixed(2)} ${text.slice(0, 40)} <${each.className}>`);
    }
    return faint;
}"""
"""Texts whose contrast with what is below them is less than 4.5 to 1; those of icons, too, which are letters here."""

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
            ("settings", ("seed", "thinking", "baud", "model", "noise", "add-robot", "apply", "start-over")),
        ]
    ),
)
def test_tab_reaches_everything(visitor: Visitor, tab: str, inside: tuple[str, ...]) -> None:
    visitor.tab(tab)
    visitor.answer("document.activeElement.blur()")
    above = ("run", "step", "speed", "mark", "reset", "views", "layers", "follow", "fit", "dark", "help", "arena-top")
    assert set(walk(visitor)) >= {*above, *inside, f"tab-{tab}"}


@pytest.mark.parametrize("theme", cases(["Light", "Dark"]))
def test_everything_has_a_name_and_enough_contrast(visitor: Visitor, theme: str) -> None:
    visitor.choose("dark", theme)
    expect(visitor.page.locator("body.body--dark .kiks-arena.kiks-dark")).to_have_count(int(theme == "Dark"))
    for tab in TABS:
        visitor.tab(tab)
        visitor.page.mouse.move(5, 400)
        visitor.page.wait_for_function(
            "() => document.getAnimations().every((one) => one.playState !== 'running' || "
            "one.animationName === 'desk-fade')"
        )
        visitor.picture(f"{tab}_{theme.lower()}")
        assert NAMELESS.findall(visitor.page.locator("body").aria_snapshot()) == [], tab
        assert visitor.answer(FAINT) == [], tab
    visitor.at("help").click()
    expect(visitor.page.get_by_role("dialog")).to_be_visible()
    visitor.picture(f"help_{theme.lower()}")


@pytest.mark.parametrize(("width", "height"), cases([(390, 844), (768, 1024), (800, 600), (1024, 768)]))
def test_small_windows_stay_usable(new_page: NewPage, shown: Shown, width: int, height: int) -> None:
    visitor = Visitor(new_page(width, height), shown)
    for tab in TABS:
        visitor.tab(tab)
        visitor.picture(f"{tab}_{width}x{height}")
        assert visitor.answer("document.documentElement.scrollWidth") == width
        above = ("run", "step", "speed", "clock", "reset", "views", "layers", "help")
        for name in (*above, *(f"tab-{one}" for one in TABS)):
            box = visitor.at(name).bounding_box()
            assert box is not None, name
            assert box["x"] >= 0, name
            assert box["x"] + box["width"] <= width, name
        assert visitor.answer("document.querySelector('.desk-panels').scrollWidth") <= width
    visitor.drag((150, 200), (200, 200))
    assert visitor.sim.pose(1)[0] == pytest.approx(200, abs=2)
    visitor.pause()


@at_length
def test_closed_pages_leave_nothing_behind(new_page: NewPage, shown: Shown) -> None:
    page = new_page()
    for _ in range(share(2, 4)):
        visitor = Visitor(page, shown)
        for tab in TABS:
            visitor.tab(tab)
    page.goto("about:blank")
    visitor.until(lambda: not any(client.has_socket_connection for client in Client.instances.values()))
    visitor.until(lambda: not shown.gateway._viewers)
    forget_all()
    visitor.until(lambda: gc.collect() >= 0 and not any(type(each) is Page for each in gc.get_objects()))
    assert all(wire.log is None for wire in shown.desk.sim.wires), "no line is watched"


def forget_all() -> None:
    """Delete what NiceGUI keeps for pages that may come back, as it does by itself after ten seconds."""
    done = threading.Event()

    def forget() -> None:
        for client in list(Client.instances.values()):
            for task in client._delete_tasks.values():
                task.cancel()
            client.delete()
        done.set()

    assert SERVER._loop is not None
    SERVER._loop.call_soon_threadsafe(forget)
    assert done.wait(20)

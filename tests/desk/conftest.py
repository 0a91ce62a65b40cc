"""Browsers: Chromium for nearly all tests, and Firefox for a few. What is missing skips its tests."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from tests.at_length import AT_LENGTH
from tests.desk import firefox_relay
from tests.desk.visitor import Browser, NewPage, Page, Shown, Visitor, make_project, open_desk
from tests.guard import GUARD_S

from kiks.model.project import Project

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, Playwright

CHROMIUM = Path("/usr/bin/chromium")
ARGUMENTS = [
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update", "--enable-unsafe-swiftshader"),
]

SELDOM = """
    window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 50);
    window.cancelAnimationFrame = clearTimeout;
"""
"""Lets a page draw 20 pictures a second in place of 60, as the processor paints them; not in `make test-all`."""

FAULTS: list[str] = []
"""What the pages of a test have printed as errors on their consoles, and the errors that they did not catch."""


@pytest.fixture(scope="module")
def playwright() -> Iterator[Playwright]:
    """Of a module, not of the session: while it is there, its thread has a running event loop, and other modules
    call `asyncio.run`. Chromium begins within 0.3 s."""
    from playwright.sync_api import expect, sync_playwright

    expect.set_options(timeout=1000 * GUARD_S)
    with sync_playwright() as playwright:
        yield playwright


@pytest.fixture(scope="module")
def browser(request: Any, playwright: Playwright, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Chromium, or what a test's parameter names (`in_each_browser`)."""
    if getattr(request, "param", "chromium") == "chromium":
        launched = chromium(playwright)
    elif firefox_relay.FIREFOX is None:
        pytest.skip("tests in Firefox need it as firefox-esr or firefox")
    else:
        launched = firefox_relay.firefox(playwright, tmp_path_factory.mktemp("firefox"))
    with launched as browser:
        yield browser


def chromium(playwright: Playwright, *arguments: str) -> AbstractContextManager[Browser]:
    if not CHROMIUM.exists():
        pytest.skip(f"tests in a browser need Chromium at {CHROMIUM}")
    return playwright.chromium.launch(executable_path=CHROMIUM, args=[*ARGUMENTS, *arguments])


@pytest.fixture
def browser_without_3d(playwright: Playwright) -> Iterator[Browser]:
    with chromium(playwright, "--disable-3d-apis") as browser:
        yield browser


@pytest.fixture(scope="module")
def context(browser: Browser) -> BrowserContext:
    """Of a module: its pages share a cache, and so read the desk's files once."""
    return watched(browser.new_context())


def watched(context: BrowserContext) -> BrowserContext:
    context.set_default_timeout(1000 * GUARD_S)
    context.on("weberror", lambda fault: FAULTS.append(str(fault.error)))
    context.on("console", lambda said: FAULTS.append(said.text) if said.type == "error" else None)
    if not AT_LENGTH:
        context.add_init_script(SELDOM)
    return context


@pytest.fixture
def new_page(browser: Browser, context: BrowserContext) -> Iterator[NewPage]:
    """Open pages; at the end, no page may have had an error or printed one on its console.

    A page with options, or of another browser, has a cache and cookies of its own. Of the others, the first one of each
    test is the same page of Chromium, which then has compiled the desk's code already; it loads all anew.
    """
    given: list[Page] = []
    own: list[BrowserContext] = []

    def open_page(width: int = 1280, height: int = 800, *, by: Browser | None = None, **options: Any) -> Page:
        if by or options:
            own.append(watched((by or browser).new_context(**options)))
            page = own[-1].new_page()
        else:
            page = next((each for each in context.pages if each not in given), None) or context.new_page()
            page.emulate_media(color_scheme="light")
        page.set_viewport_size({"width": width, "height": height})
        given.append(page)
        return page

    FAULTS.clear()
    yield open_page
    for each in own:
        each.close()
    for page in context.pages[1:]:
        page.close()
    for page in context.pages:
        page.goto("about:blank")
    context.clear_cookies()
    assert not FAULTS


@pytest.fixture
def project() -> Project:
    """What the desk shows."""
    return make_project()


@pytest.fixture
def shown(tmp_path: Path, project: Project) -> Iterator[Shown]:
    """A desk of its own for each test, in this process; its folder is the test's."""
    shown = open_desk(tmp_path, project)
    yield shown
    shown.close()


@pytest.fixture
def visitor(shown: Shown, new_page: NewPage) -> Visitor:
    """A page of the desk. Pages close before the desk: they ask for pictures until their connection ends."""
    return Visitor(new_page(), shown)

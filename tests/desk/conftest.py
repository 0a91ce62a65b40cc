"""Chromium for all browser tests, which are skipped if it is missing."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Playwright, expect, sync_playwright
from tests.desk.visitor import NewPage, Visitor, open_desk
from tests.guard import GUARD_S

from kiks.desk.server.show import Shown

CHROMIUM = Path("/usr/bin/chromium")
ARGUMENTS = [
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update", "--enable-unsafe-swiftshader"),
]
GUARD_MS = 1000 * GUARD_S


@pytest.fixture(scope="module")
def playwright() -> Iterator[Playwright]:
    """Of a module, not of the session: while it is there, its thread has a running event loop, and other modules
    call `asyncio.run`. Chromium begins within 0.3 s."""
    if not CHROMIUM.exists():
        pytest.skip(f"tests in a browser need Chromium at {CHROMIUM}")
    expect.set_options(timeout=GUARD_MS)
    with sync_playwright() as playwright:
        yield playwright


@pytest.fixture(scope="module")
def browser(playwright: Playwright) -> Iterator[Browser]:
    browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
    yield browser
    browser.close()


@pytest.fixture
def browser_without_3d(playwright: Playwright) -> Iterator[Browser]:
    browser = playwright.chromium.launch(executable_path=CHROMIUM, args=[*ARGUMENTS, "--disable-3d-apis"])
    yield browser
    browser.close()


@pytest.fixture(scope="module")
def context(browser: Browser) -> BrowserContext:
    """Of a module: its pages share a cache, and so read the desk's files once."""
    return browser.new_context()


@pytest.fixture
def new_page(browser: Browser, context: BrowserContext) -> Iterator[NewPage]:
    """Open pages; at the end, no page may have had an error or printed one on its console.

    A page with options has a cache and cookies of its own.
    """
    pages: list[Page] = []
    faults: list[str] = []

    def open_page(width: int = 1280, height: int = 800, *, by: Browser | None = None, **options: Any) -> Page:
        if by or options:
            page = (by or browser).new_page(**options)
        else:
            page = context.new_page()
        page.set_viewport_size({"width": width, "height": height})
        page.set_default_timeout(GUARD_MS)
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on("console", lambda said: faults.append(said.text) if said.type == "error" else None)
        pages.append(page)
        return page

    yield open_page
    for page in pages:
        page.close()
    context.clear_cookies()
    assert not faults


@pytest.fixture
def shown(tmp_path: Path) -> Iterator[Shown]:
    """A desk of its own for each test, in this process; its folder is the test's."""
    shown = open_desk(tmp_path)
    yield shown
    shown.close()


@pytest.fixture
def visitor(shown: Shown, new_page: NewPage) -> Visitor:
    """A page of the desk. Pages close before the desk: they ask for pictures until their connection ends."""
    return Visitor(new_page(), shown)

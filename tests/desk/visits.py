"""A page of the desk in a real browser; tests wait for conditions and never sleep."""

from __future__ import annotations

import io
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Page

ROOT = Path(__file__).parents[2]

NewPage = Callable[..., Page]
"""What the fixture `new_page` of conftest.py is."""


@contextmanager
def fake_desk() -> Iterator[str]:
    """Serve the desk of fake_desk.py in a process of its own; yield its address."""
    command = [sys.executable, "-m", "tests.desk.fake_desk"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        try:
            assert process.stdout is not None
            *_, address = process.stdout.readline().split() or [""]
            assert address.startswith("http"), "the page did not start"
            yield address
        finally:
            process.kill()


class Visit:
    """A page with the arena, and the messages that the server receives from it."""

    def __init__(self, page: Page, address: str, query: str) -> None:
        self.page, self.address = page, address
        self.ask("reset")
        self.mark = len(page.request.get(f"{address}/received").json())
        page.goto(f"{address}/?{query}")
        page.wait_for_function("() => window.kiksDesk?.stats().frames_drawn > 3 && kiksDesk.pose(0)")

    def ask(self, what: str) -> None:
        self.page.request.get(f"{self.address}/ask/{what}")

    def wait(self, fact: str, argument: object = None) -> Any:
        return self.page.wait_for_function(fact, arg=argument).json_value()

    def heard(self, fact: str) -> list[dict[str, Any]]:
        """Wait for a condition on all messages since the start of the visit, and return them."""
        self.page.evaluate(
            """([mark, fact]) => {
                window.said = null;
                const ask = async () => {
                    const said = (await (await fetch('/received')).json()).slice(mark);
                    if (eval(fact)(said)) window.said = said;
                    else requestAnimationFrame(ask);
                };
                ask();
            }""",
            [self.mark, fact],
        )
        said: list[dict[str, Any]] = self.wait("() => window.said")
        return said

    def feed(self, expression: str) -> Any:
        return self.page.evaluate(
            f"import('kiks-desk').then(({{ pageFeed }}) => {{ const feed = pageFeed(); return {expression}; }})"
        )

    def pose(self, robot: int = 0) -> tuple[float, float, float]:
        frame = self.feed(f"(({{x_mm, y_mm, heading_rad}}) => [x_mm, y_mm, heading_rad])(feed.frame.robot({robot}))")
        return frame[0], frame[1], frame[2]

    def on_page(self, x_mm: float, y_mm: float) -> tuple[float, float]:
        x, y = self.page.evaluate("([x, y]) => kiksDesk.toClient(x, y)", [x_mm, y_mm])
        return x, y

    def drag(self, start: tuple[float, float], end: tuple[float, float], button: Any = "left") -> None:
        mouse = self.page.mouse
        mouse.move(*self.on_page(*start))
        mouse.down(button=button)
        mouse.move(*self.on_page(*end), steps=8)
        mouse.up(button=button)

    def click(self, x_mm: float, y_mm: float) -> None:
        self.page.mouse.click(*self.on_page(x_mm, y_mm))

    def colour(self, x_mm: float, y_mm: float) -> tuple[int, ...]:
        x, y = self.on_page(x_mm, y_mm)
        pixel = Image.open(io.BytesIO(self.page.screenshot())).convert("RGB").getpixel((round(x), round(y)))
        assert isinstance(pixel, tuple)
        return pixel

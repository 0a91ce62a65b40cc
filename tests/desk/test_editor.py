"""The arena panel in a real browser: edits and files, compared with the engine and the folder."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("nicegui", reason="the desk needs NiceGUI")
pytest.importorskip("playwright", reason="tests in a browser need Playwright for Python")

from playwright.sync_api import Page
from tests.desk.visitor import FIRST_PICTURE, SCREENSHOTS
from tests.desk.visits import NewPage

from kiks.desk.server.desk import Desk
from kiks.desk.server.show import Shown
from kiks.model.arena import Arena, Pose
from kiks.model.project import Project
from kiks.sim.from_project import simulation_of

pytestmark = pytest.mark.slow


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    project = Project(replace(Arena.box(600, 500), starts=(Pose(120.0, 120.0, 0.0),)))
    desk = Desk(simulation_of(project), project=project, folder=tmp_path, owns_world=True)
    desk.gate.pause(0)
    return desk


@pytest.fixture
def page(desk: Desk, new_page: NewPage) -> Iterator[Page]:
    shown = Shown(desk, port=0)
    shown.drive()
    page = new_page(1400, 1000)
    page.goto(shown.url)
    page.wait_for_function(FIRST_PICTURE)
    page.get_by_test_id("tab-arena").click()
    page.get_by_test_id("tool-rectangle").wait_for()
    yield page
    page.close()
    shown.close()


def drag(page: Page, *points: tuple[float, float]) -> None:
    places = [page.evaluate("([x, y]) => kiksDesk.toClient(x, y)", list(point)) for point in points]
    page.mouse.move(*places[0])
    page.mouse.down()
    for place in places[1:]:
        page.mouse.move(*place, steps=8)
    page.mouse.up()


def take(page: Page, tool: str) -> None:
    """Choose a tool, and wait until the arena has it."""
    page.get_by_test_id(f"tool-{tool}").click()
    page.locator(f"[data-testid=tool-{tool}].bg-accent").wait_for()


def wait_for_step(page: Page, *, undo: bool = True, redo: bool = False) -> None:
    for name, is_there in (("undo", undo), ("redo", redo)):
        state = ":not([disabled])" if is_there else "[disabled]"
        page.locator(f"[data-testid={name}]{state}").wait_for()


def tell(page: Page, words: str) -> None:
    page.locator(".q-notification", has_text=words).first.wait_for()


def wait_until(page: Page, fact: Callable[[], object]) -> None:
    """Wait for a condition of the engine, one picture of the screen at a time."""
    for _ in range(1200):
        if fact():
            return
        page.wait_for_function("() => new Promise((done) => requestAnimationFrame(() => done(true)))")
    raise AssertionError("it did not come true")


def look(page: Page, name: str) -> None:
    """Leave a picture of the page for a person."""
    SCREENSHOTS.mkdir(exist_ok=True)
    page.screenshot(path=SCREENSHOTS / f"arena_{name}.png")


def test_walls_are_drawn_and_undone(desk: Desk, page: Page) -> None:
    def brightness(x_mm: int, y_mm: int) -> int:
        return int(desk.sim.arena.brightness[y_mm, x_mm])

    take(page, "rectangle")
    drag(page, (250, 250), (330, 330))
    wait_for_step(page)
    wait_until(page, lambda: brightness(290, 290) == 255)
    page.get_by_test_id("material").click()
    page.get_by_role("option", name="wood").click()
    take(page, "freehand")
    drag(page, (400, 100), (450, 200), (520, 150))
    take(page, "line")
    drag(page, (400, 400), (550, 400))
    take(page, "erase")
    drag(page, (290, 200), (290, 400))
    take(page, "ball")
    drag(page, (150, 400))
    take(page, "lamp")
    drag(page, (50, 300))
    wait_until(page, lambda: len(desk.sim.lamps) == 1)
    look(page, "drawn")
    assert (brightness(450, 200), brightness(475, 400), brightness(290, 290)) == (190, 190, 0)
    assert len(desk.sim.bodies()) == 1
    take(page, "remove")
    drag(page, (150, 405))
    wait_until(page, lambda: len(desk.sim.bodies()) == 0)
    take(page, "rectangle")
    drag(page, (100, 100), (140, 140))
    tell(page, "robot 1")
    look(page, "refused")
    assert brightness(120, 120) == 0
    page.locator("canvas").first.focus()
    for _ in range(7):
        page.keyboard.press("Control+z")
    wait_for_step(page, undo=False, redo=True)
    wait_until(page, lambda: np.array_equal(desk.sim.arena.brightness, Arena.box(600, 500).brightness))
    page.keyboard.press("Control+y")
    wait_for_step(page, undo=True, redo=True)
    wait_until(page, lambda: brightness(290, 290) == 255)
    assert desk.sim.pose(1) == (120.0, 120.0, 0.0)
    page.get_by_test_id("tab-wire").click()
    page.get_by_test_id("tool-rectangle").wait_for(state="detached")
    drag(page, (120, 120), (150, 180))
    wait_until(page, lambda: desk.sim.pose(1)[1] > 170)


def test_worlds_are_created_saved_and_opened(desk: Desk, page: Page) -> None:
    page.get_by_test_id("new-arena").click()
    page.get_by_test_id("box-width").fill("700")
    page.get_by_test_id("box-rounded").fill("80")
    look(page, "new")
    page.get_by_test_id("dialog-ok").click()
    wait_until(page, lambda: desk.sim.arena.width_mm == 700)
    take(page, "robot")
    drag(page, (400, 300))
    wait_until(page, lambda: desk.sim.robot_count == 2)
    name = page.get_by_test_id("save-name")
    for bad, words in (("../out", "folder"), ("/etc/out", "folder"), ("con", "device")):
        name.fill(bad)
        page.get_by_test_id("save").click()
        tell(page, words)
    name.fill("mine")
    page.get_by_test_id("save").click()
    tell(page, "Saved as mine.kiks")
    assert [path.name for path in desk.folder.iterdir()] == ["mine.kiks"]
    saved = Project.load(desk.folder / "mine.kiks")
    assert (saved.arena.width_mm, len(saved.robots)) == (700, 2)
    with page.expect_download() as download:
        page.get_by_test_id("download").click()
    assert Path(download.value.path()).read_bytes() == saved.to_bytes()
    page.get_by_test_id("new-maze").click()
    page.get_by_test_id("dialog-ok").click()
    wait_until(page, lambda: desk.sim.arena.name == "maze")
    look(page, "maze")
    page.get_by_test_id("open-name").click()
    page.get_by_role("option", name="mine.kiks").click()
    page.get_by_test_id("open").click()
    wait_until(page, lambda: desk.sim.arena.width_mm == 700)
    assert desk.sim.robot_count == 2
    page.get_by_test_id("save").click()
    page.get_by_test_id("dialog-yes").click()
    tell(page, "Saved as mine.kiks")


def test_files_are_uploaded(desk: Desk, page: Page) -> None:
    picture = io.BytesIO()
    Image.fromarray(np.zeros((300, 400), np.uint8)).save(picture, "PNG")
    chooser = page.locator("[data-testid=upload] input[type=file]")
    for file, mime, data, fact in (
        ("a.png", "image/png", picture.getvalue(), lambda: desk.sim.arena.width_mm == 400),
        ("b.kiks", "text/plain", Project(Arena.box(450, 300)).to_bytes(), lambda: desk.sim.arena.width_mm == 450),
    ):
        chooser.set_input_files({"name": file, "mimeType": mime, "buffer": data})
        wait_until(page, fact)
    chooser.set_input_files({"name": "c.kad", "mimeType": "text/plain", "buffer": b"nothing"})
    tell(page, "level 5")
    assert desk.sim.arena.width_mm == 450
    assert list(desk.folder.iterdir()) == []

"""The arena panel in a real browser: edits and files, compared with the engine and the folder."""

import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.at_length import at_length
from tests.desk.visitor import NewPage, Shown, Visitor, expect

from kiks.model import brush
from kiks.model.arena import Arena, Pose, Wall
from kiks.model.project import Project

pytestmark = pytest.mark.slow


@pytest.fixture
def project() -> Project:
    return Project(replace(Arena.box(600, 500), starts=(Pose(120.0, 120.0, 0.0),)))


@pytest.fixture
def visitor(shown: Shown, new_page: NewPage) -> Visitor:
    shown.desk.gate.pause(0)
    visitor = Visitor(new_page(1400, 1000), shown)
    visitor.tab("arena")
    return visitor


def click(visitor: Visitor, x_mm: float, y_mm: float) -> None:
    visitor.page.mouse.click(*visitor.on_page(x_mm, y_mm))


def use(visitor: Visitor, tool: str, *places: tuple[float, float]) -> None:
    """Click a place with a tool, or draw with it from one place to another."""
    visitor.take(tool)
    click(visitor, *places[0]) if len(places) == 1 else visitor.stroke(*places)


def wait_for_step(visitor: Visitor, *, undo: bool = True, redo: bool = False) -> None:
    for name, is_there in (("undo", undo), ("redo", redo)):
        expect(visitor.at(name)).to_be_enabled(enabled=is_there)


def test_walls_are_drawn_and_undone(visitor: Visitor) -> None:
    desk, page = visitor.desk, visitor.page

    def brightness(x_mm: int, y_mm: int) -> int:
        return int(desk.sim.arena.brightness[y_mm, x_mm])

    use(visitor, "rectangle", (250, 250), (330, 330))
    wait_for_step(visitor)
    visitor.until(lambda: brightness(290, 290) == 255)
    visitor.choose("material", "wood")
    visitor.take("freehand")
    visitor.pull((400, 100), (450, 200))
    page.mouse.move(*visitor.on_page(520, 150), steps=8)
    visitor.let_go()
    use(visitor, "line", (400, 400), (550, 400))
    use(visitor, "erase", (290, 200), (290, 400))
    use(visitor, "ball", (150, 400))
    use(visitor, "lamp", (50, 300))
    visitor.until(lambda: len(desk.sim.lamps) == 1)
    visitor.picture("arena_drawn")
    assert (brightness(450, 200), brightness(475, 400), brightness(290, 290)) == (190, 190, 0)
    assert len(desk.sim.bodies()) == 1
    use(visitor, "remove", (150, 405))
    visitor.until(lambda: len(desk.sim.bodies()) == 0)
    use(visitor, "rectangle", (100, 100), (140, 140))
    visitor.told("robot 1")
    visitor.picture("arena_refused")
    assert brightness(120, 120) == 0
    page.locator("canvas").first.focus()
    for _ in range(7):
        page.keyboard.press("Control+z")
    wait_for_step(visitor, undo=False, redo=True)
    visitor.until(lambda: np.array_equal(desk.sim.arena.brightness, Arena.box(600, 500).brightness))
    page.keyboard.press("Control+y")
    wait_for_step(visitor, undo=True, redo=True)
    visitor.until(lambda: brightness(290, 290) == 255)
    assert desk.sim.pose(1) == (120.0, 120.0, 0.0)
    visitor.at("tab-wire").click()
    visitor.at("tool-rectangle").wait_for(state="detached")
    visitor.drag((120, 120), (150, 180))
    visitor.until(lambda: desk.sim.pose(1)[1] > 170)


def test_strokes_snap_to_the_grid_end_at_the_arena_and_are_dropped_with_escape(visitor: Visitor) -> None:
    desk = visitor.desk
    arena = brush.line(desk.sim.arena, [(400, 300), (600, 300)], width_mm=10)
    walls = brush.rectangle(arena, 200, 380, 260, 420).brightness
    visitor.choose("snap", "10 mm")
    visitor.take("line")
    visitor.pull((200, 250), (250, 250))
    visitor.page.keyboard.press("Escape")
    visitor.page.mouse.up()
    visitor.stroke((400, 300), (620, 300))
    wait_for_step(visitor)
    use(visitor, "rectangle", (198, 382), (263, 417))
    visitor.until(lambda: np.array_equal(desk.sim.arena.brightness, walls))
    use(visitor, "ball", (303, 198))
    visitor.until(lambda: desk.sim.bodies()["x_mm"].tolist() == [300])


def test_worlds_are_created_saved_and_opened(visitor: Visitor) -> None:
    desk, page = visitor.desk, visitor.page
    visitor.at("new-arena").click()
    visitor.fill({"box-width": "700", "box-rounded": "80"})
    visitor.picture("arena_new")
    visitor.at("dialog-yes").click()
    visitor.until(lambda: desk.sim.arena.width_mm == 700)
    use(visitor, "robot", (400, 300))
    visitor.until(lambda: desk.sim.robot_count == 2)
    for bad, words in (("../out", "folder"), ("/etc/out", "folder"), ("con", "device")):
        visitor.at("save-name").fill(bad)
        visitor.click("save", told=words)
    use(visitor, "hand", desk.sim.pose(2)[:2], (500, 350))
    visitor.until(lambda: desk.sim.pose(2)[:2] == pytest.approx((500, 350), abs=1e-3))
    poses = desk.sim.poses()
    saved = visitor.save_as("mine")
    assert [path.name for path in desk.folder.iterdir()] == ["mine.kiks"]
    assert (saved.arena.width_mm, len(saved.robots)) == (700, 2)
    with page.expect_download() as download:
        visitor.at("download").click()
    assert Path(download.value.path()).read_bytes() == saved.to_bytes()
    visitor.click("new-maze", "dialog-yes")
    visitor.until(lambda: desk.sim.arena.name == "maze")
    visitor.picture("arena_maze")
    visitor.at("example-name").scroll_into_view_if_needed()
    visitor.click("open-example", told="Opened ")
    visitor.choose("open-name", "mine.kiks")
    visitor.at("open").click()
    visitor.until(lambda: desk.sim.arena.width_mm == 700)
    assert desk.sim.poses() == pytest.approx(poses, abs=1e-3)
    visitor.click("save", "dialog-yes", told="Saved as mine.kiks")


@at_length
def test_files_are_uploaded(visitor: Visitor) -> None:
    desk, page = visitor.desk, visitor.page
    picture = io.BytesIO()
    Image.fromarray(np.zeros((300, 400), np.uint8)).save(picture, "PNG")
    chooser = page.locator("[data-testid=upload] input[type=file]")
    for file, mime, data, fact in (
        ("a.png", "image/png", picture.getvalue(), lambda: desk.sim.arena.width_mm == 400),
        ("b.kiks", "text/plain", Project(Arena.box(450, 300)).to_bytes(), lambda: desk.sim.arena.width_mm == 450),
    ):
        chooser.set_input_files({"name": file, "mimeType": mime, "buffer": data})
        visitor.until(fact)
    chooser.set_input_files({"name": "c.kad", "mimeType": "text/plain", "buffer": b"nothing"})
    visitor.told("level 5")
    assert (desk.sim.arena.width_mm, [*desk.folder.iterdir()]) == (450, [])


def test_properties_are_set_by_a_double_click(visitor: Visitor) -> None:
    desk = visitor.desk

    def put(name: str, text: str, fact: Callable[[], bool]) -> None:
        visitor.at(f"property-{name}").fill(text)
        visitor.at(f"property-{name}").press("Enter")
        visitor.until(fact)

    def double(x_mm: float, y_mm: float) -> None:
        visitor.page.mouse.dblclick(*visitor.on_page(x_mm, y_mm))

    expect(visitor.at("properties")).to_contain_text("Double-click a robot")
    for tool, place in (("lamp", (300, 300)), ("ball", (450, 150))):
        use(visitor, tool, place)
        wait_for_step(visitor)
    visitor.take("disc")
    visitor.pull((200, 400), (230, 400))
    visitor.page.mouse.up()
    visitor.until(lambda: len(desk.sim.arena.walls) == 1)
    visitor.take("hand")
    double(300, 300)
    expect(visitor.at("properties")).to_contain_text("Lamp")
    with desk.sim.lock:
        put("power_w", "2.5", lambda: True)
        visitor.at("property-power_w").fill("-1")  # what is typed while the world changes stays
    visitor.until(lambda: desk.sim.lamps[0, 2] == 2.5)
    visitor.at("property-power_w").press("Enter")
    expect(visitor.at("refused")).to_contain_text("power_w must be greater than 0, but it was -1")
    put("power_w", "4", lambda: desk.sim.lamps[0, 2] == 4)
    expect(visitor.at("refused")).to_have_text("")
    visitor.at("property-is_on").click()
    visitor.until(lambda: desk.sim.lamps[0, 3] == 0)
    click(visitor, 450, 150)
    expect(visitor.at("properties")).to_contain_text("Ball")
    put("radius_mm", "20", lambda: desk.sim.bodies()["radius_mm"].tolist() == [20])
    click(visitor, 200, 400)
    expect(visitor.at("property-disc_mm")).to_have_value("200, 400")
    visitor.picture("properties_of_a_wall")
    put("disc_mm", "220, 400", lambda: desk.sim.arena.walls == (Wall(disc_mm=(220, 400), radius_mm=30),))
    visitor.tab("robot")
    double(120, 120)
    expect(visitor.at("property-name")).to_be_focused()
    put("name", "Ada", lambda: desk.names() == ["Ada"])
    put("heading_deg", "90", lambda: desk.sim.pose(1)[2] == pytest.approx(np.pi / 2))
    visitor.picture("properties")
    visitor.page.keyboard.press("Escape")
    visitor.click("close-properties", "undo")
    visitor.until(lambda: desk.sim.pose(1)[2] == 0)
    visitor.save_as("mine")
    text = (desk.folder / "mine.kiks").read_text()
    assert "\n[[wall]]\ndisc_mm = [220.0, 400.0]\nradius_mm = 30.0\nbrightness = 255\n" in text
    assert "power_w = 4.0\nis_on = false\n" in text

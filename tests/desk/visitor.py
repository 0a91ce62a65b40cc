"""A page of a real desk, mostly in the test's own process, so that tests can read the state of the engine, too.

Nothing sleeps: `until` lets the page draw its next picture, again and again, until a fact is so.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import pytest
from tests.at_length import AT_LENGTH, at_length

from kiks.desk.server.rights import Rights
from kiks.model.arena import Arena
from kiks.model.arena_objects import Ball, Cylinder, Lamp, Pose
from kiks.model.project import Project, ProjectRobot
from kiks.ports.program_command import ProgramCommand
from kiks.run import Run

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

    from kiks.desk.server.show import Shown
    from kiks.sim.simulation import Simulation
else:
    # Tests name them as types alone, and their modules take seconds to import.
    Browser = Locator = Page = Shown = Simulation = Any

SCREENSHOTS = Path(__file__).parents[2] / "screenshots"
"""Where pictures of what tests have seen are left for a person."""

PICTURES_MAX = 3600
"""Most pictures of the screen that something is waited for, a minute or more: a guard, no measure."""

NEXT_PICTURE = "() => new Promise((done) => requestAnimationFrame(() => done(true)))"
FIRST_PICTURE = "() => window.kiksDesk?.stats().frames_drawn > 1 && kiksDesk.pose(0) && window.socket?.connected"

STILL = """() => {
    const moving = document.getAnimations().filter(
        (one) => one.playState === "running" && Number.isFinite(one.effect.getComputedTiming().endTime));
    for (const one of moving) one.finish();
    return moving.length === 0 && !document.querySelector("[class*='-enter-'], [class*='-leave-']");
}"""
"""Ends what moves or fades, and says whether all stood still already.

What blinks for ever, as the caret does, may go on. Vue marks what appears or goes with these classes, from a frame
before anything moves.
"""

OUT_OF_REACH = """() => {
    const roles = ["button", "tab", "slider", "checkbox", "switch", "radio"].map((role) => `[role=${role}]`);
    const far = [];
    for (const each of document.querySelectorAll(["button", "input", "a", ...roles])) {
        if (!each.checkVisibility({ visibilityProperty: true })) continue;
        const target = each.closest("label, .q-field, .q-slider") ?? each;
        const { left, right, width, height } = target.getBoundingClientRect();
        if (width < 24 || height < 24 || left < 0 || right > innerWidth)
            far.push(`${each.closest("[data-testid]")?.dataset.testid} ${width} x ${height} at ${left}`);
    }
    return far;
}"""
"""Controls that are smaller than a finger, or cut off at the edge of the screen."""

SERIOUS = """async (runOnly) => (await axe.run({ resultTypes: ["violations"], ...(runOnly && { runOnly }) })).violations
    .filter(({ impact }) => ["serious", "critical"].includes(impact))
    .flatMap(({ help, nodes }) => nodes.map(({ html }) => `${help}: ${html}`))"""
"""What axe-core finds that keeps people out."""

COLOURS = ["color-contrast", "link-in-text-block"]
"""The rules of axe-core that colours can break."""

PLACE = """([x_mm, y_mm, scene]) => import("kiks-desk").then(
    ({ pageFeed }) => pageFeed().frame?.scene === scene && kiksDesk.toClient(x_mm, y_mm))"""
"""Where a place of the arena is on the page, as soon as it shows a scene."""

INSIDE = {"robot": "proximity-0", "wire": "console", "arena": "save", "programs": "editor", "settings": "apply"}
"""Something in each tab."""

NewPage = Callable[..., Page]
"""What the fixture `new_page` of conftest.py is."""

Fact = TypeVar("Fact")

in_each_browser = pytest.mark.parametrize(
    "browser", ["chromium", pytest.param("firefox", marks=at_length)], indirect=True, scope="module"
)
"""Marks a test that `make test` does in Chromium, and `make test-all` in Firefox, too."""


def expect(what: Locator | Page) -> Any:
    """Return Playwright's `expect`, whose import takes long."""
    from playwright.sync_api import expect

    return expect(what)


def make_project() -> Project:
    """Return two robots, of which the second has stripes, a ball, a cylinder and a lamp in a room of 600 by 400 mm."""
    plain, starts = Arena.box(600, 400), (Pose(150, 200, 0.0), Pose(450, 300, 2.0))
    things = {"lamps": (Lamp(80, 340, 2.0),), "balls": (Ball(300, 100),), "cylinders": (Cylinder(450, 100),)}
    arena = Arena(plain.brightness, plain.mm_per_cell, "room", starts=starts, **things)
    striped = ProjectRobot(turrets=("gripper",), changes={"body": {"stripe_count": 8}})
    return Project(arena, robots=(ProjectRobot(turrets=("k213",)), striped), seed=3)


def open_desk(
    folder: Path,
    project: Project | None = None,
    rights: Rights = Rights.OWNER,
    commands: Sequence[ProgramCommand | None] = (),
) -> Shown:
    """Show a world that goes on by itself, on a desk that may run programs, unless `rights` say no."""
    from kiks.desk.server.desk import Desk
    from kiks.desk.server.show import Shown

    project = project or make_project()
    desk = Desk(Run(project, folder, commands), rights, folder=folder)
    shown = Shown(desk, port=0)
    desk.begin()
    shown.drive()
    return shown


def leave_picture(page: Page, name: str, **options: Any) -> None:
    """Leave a picture of a page for a person, in `make test-all`."""
    if AT_LENGTH:
        SCREENSHOTS.mkdir(exist_ok=True)
        page.screenshot(path=SCREENSHOTS / f"{name}.png", animations="disabled", **options)


def check_access(page: Page, where: str, rules: list[str] | None = None) -> None:
    """Let axe-core look for what keeps people out, by some of its rules or all. Nothing it finds may be serious."""
    from axe_playwright_python.base import AXE_SCRIPT

    page.wait_for_function(STILL)
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE_SCRIPT)
    assert not (found := page.evaluate(SERIOUS, rules)), f"{where}: {found}"


def check_reach(page: Page, where: str) -> None:
    """Check that fingers hit all controls, and that none is cut off."""
    assert not (far := page.evaluate(OUT_OF_REACH)), f"{where}: {far}"


def open_page(page: Page, url: str) -> None:
    """Go to a page of a desk, and wait until it has drawn the world."""
    page.goto(url)
    page.wait_for_function(FIRST_PICTURE)


def write(page: Page, text: str) -> None:
    """Put a text into the editor as if it were pasted."""
    page.locator(".cm-content").click()
    page.keyboard.press("Control+a")
    page.keyboard.insert_text(text)


class Guest:
    """A page of a desk that may be in another process."""

    def __init__(self, page: Page, url: str) -> None:
        self.page = page
        open_page(page, url)

    def until(self, fact: Callable[[], Fact]) -> Fact:
        for _ in range(PICTURES_MAX):
            if found := fact():
                return found
            self.page.evaluate(NEXT_PICTURE)
        raise AssertionError(f"it did not come until {self.state()}")

    def state(self) -> str:
        """Return what is seen when a fact has not come."""
        return str(self.at("clock").text_content())

    def at(self, name: str) -> Locator:
        return self.page.get_by_test_id(name)

    def shows(self, texts: dict[str, str]) -> None:
        """Wait until things have these texts in them."""
        for name, text in texts.items():
            expect(self.at(name)).to_contain_text(text)

    def click(self, *names: str, shows: dict[str, str] | None = None, told: str = "") -> None:
        """Click one thing after the other, and wait for texts in things and for a message if these are given."""
        for name in names:
            self.at(name).click()
        self.shows(shows or {})
        if told:
            self.told(told)

    def fill(self, texts: dict[str, str]) -> None:
        for name, text in texts.items():
            self.at(name).fill(text)

    def tab(self, name: str) -> None:
        self.at(f"tab-{name}").click()
        expect(self.at(INSIDE[name])).to_be_visible()

    def choose(self, name: str, text: str) -> None:
        """Choose an entry of a list, or of a button's menu."""
        self.at(name).click()
        self.page.locator(".q-menu .q-item").get_by_text(text, exact=True).click()
        expect(self.page.locator(".q-menu")).to_have_count(0)

    def told(self, text: str) -> None:
        """Wait for a message of the page, and close it if it has a button: it covers what is below it."""
        messages = self.page.locator(".q-notification").filter(has_text=text)
        expect(messages.first).to_be_visible()
        closable = messages.filter(has=self.page.locator("button"))
        closable.locator("button").evaluate_all("(buttons) => buttons.forEach((button) => button.click())")
        closable.first.wait_for(state="detached")

    def send(self, command: str) -> None:
        """Send a command to the robot of the tab of the wire."""
        self.at("console").fill(command)
        self.at("console").press("Enter")

    def seen(self, robot: int) -> tuple[float, float, float]:
        pose = self.answer("(index) => kiksDesk.pose(index)", robot - 1)
        return pose["x_mm"], pose["y_mm"], pose["heading_rad"]

    def take(self, tool: str) -> None:
        """Choose a tool, and wait until the arena has it."""
        self.at(f"tool-{tool}").click()
        self.page.locator(f"[data-testid=tool-{tool}].bg-accent").wait_for()

    def write(self, text: str) -> None:
        write(self.page, text)

    def picture(self, name: str) -> None:
        leave_picture(self.page, name)

    def answer(self, script: str, argument: Any = None) -> Any:
        return self.page.evaluate(script, argument)


class Visitor(Guest):
    """A desk of this process in an empty page."""

    def __init__(self, page: Page, shown: Shown) -> None:
        self.shown, self.desk = shown, shown.desk
        super().__init__(page, shown.url)

    @property
    def sim(self) -> Simulation:
        return self.desk.sim

    def save_as(self, name: str) -> Project:
        """Save the world from the tab of the arena, and return what is in the file."""
        self.at("save-name").fill(name)
        self.at("save").click()
        self.told(f"Saved as {name}.kiks")
        return Project.load(self.desk.folder / f"{name}.kiks")

    def state(self) -> str:
        states = [(handle.name, handle.state) for handle in self.desk.programs.handles]
        commands = [list(wire.pending) for wire in self.sim.wires]
        return f"{self.sim}, {self.shown._driver}, {self.desk.gate.is_paused=}, {states}, {commands}"

    def setpoints(self, robot: int = 1) -> list[int]:
        return self.sim.world.state.robots["speed_setpoint"][0, robot - 1].tolist()

    def pause(self) -> None:
        self.at("run").click()
        self.until(lambda: self.desk.gate.is_paused)

    def on_page(self, x_mm: float, y_mm: float) -> tuple[float, float]:
        """Return where a place of the arena is when the page shows all that the world has, so that a click hits it."""
        x, y = self.until(lambda: self.answer(PLACE, [x_mm, y_mm, self._scene()]))
        return x, y

    def _scene(self) -> int | None:
        """Return the number of the scene that describes the world; None until the desk has described it."""
        from kiks.export.frames import scene_key

        gateway = self.shown.gateway
        with self.sim.lock:
            return gateway._scene_number if gateway._seen == (self.desk.scene, *scene_key(self.sim)) else None

    def feed(self, expression: str) -> Any:
        """Return the value of an expression in JavaScript that may use the page's `feed`."""
        work = f"const feed = pageFeed(); return {expression};"
        return self.answer(f"import('kiks-desk').then(({{ pageFeed }}) => {{ {work} }})")

    def pull(self, start: tuple[float, float], end: tuple[float, float], button: Any = "left") -> None:
        """Press the mouse at a place, and bring it to another one without letting go."""
        self.page.mouse.move(*self.on_page(*start))
        self.page.mouse.down(button=button)
        self.page.mouse.move(*self.on_page(*end), steps=8)

    def let_go(self) -> None:
        """Let go, and wait until the page shows where everything is."""
        self.page.mouse.up()
        self.until(lambda: self.desk.shown.hands.are_empty)
        for robot in range(1, self.sim.robot_count + 1):
            self.until(lambda robot=robot: self.seen(robot) == pytest.approx(self.sim.pose(robot), abs=0.1))

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        self.pull(start, end)
        # On a busy computer the desk has not heard of the hand yet: then it is empty, too.
        self.until(lambda: not self.desk.shown.hands.are_empty)
        self.let_go()

    def stroke(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Draw with the tool in use."""
        self.pull(start, end)
        self.page.mouse.up()

    def drag_refused(self) -> None:
        """Try to drag robot 1, and wait for the message that the past stays as it was."""
        x_mm, y_mm, _ = self.sim.pose(1)
        self.pull((x_mm, y_mm), (x_mm + 40, y_mm))
        expect(self.at("arena-notice")).to_contain_text("which cannot be changed")
        self.page.mouse.up()

    def is_free(self, robot: int) -> bool:
        with self.sim.lock:
            x_mm, y_mm, _ = self.sim.pose(robot)
            return bool(self.sim.world.free_space.may_lie(robot - 1)(x_mm, y_mm))

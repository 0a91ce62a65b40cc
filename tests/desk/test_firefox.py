"""The desk and the page of a recording in Firefox, driven by its own Marionette: the commands of WebDriver over TCP.

The package for that, marionette_driver, brings twelve others, needs telnetlib, which Python 3.13 no longer has, and
leaves a folder behind for each Firefox that it starts.
"""

import base64
import json
import shutil
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.at_length import AT_LENGTH, at_length
from tests.desk.visitor import SCREENSHOTS, Shown
from tests.guard import GUARD_S, wait_until

from kiks import Arena, Khepera, Recording, Simulation
from kiks.export.page import save_page

pytestmark = [pytest.mark.slow, at_length]

FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")

CONTROL, ENTER, HOME = "\ue009", "\ue007", "\ue011"
"""Keys, as WebDriver numbers them."""

FAULTS = """
    return Services.console.getMessageArray()
        .filter((one) => one instanceof Ci.nsIScriptError && !(one.flags & Ci.nsIScriptError.warningFlag))
        .filter((one) => /^(http|file)/.test(one.sourceName)).map(String);
"""
"""What went wrong in pages, not in the browser itself."""

PROGRAM = """import serial; print(serial.Serial("/dev/ttyUSB0").write(b"D,3,3\\n"))"""


class Firefox:
    """A Firefox without a window, which keeps its settings in an empty folder."""

    def __init__(self, profile: Path) -> None:
        (profile / "user.js").write_text('user_pref("marionette.port", 0);')
        # `faults` asks the browser itself.
        options = ("--headless", "--marionette", "--remote-allow-system-access", "--no-remote", "--profile", profile)
        self._process = subprocess.Popen((str(FIREFOX), *options), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        port = profile / "MarionetteActivePort"
        wait_until(lambda: port.exists() and port.read_text())
        with socket.create_connection(("127.0.0.1", int(port.read_text()))) as connection:
            self._line = connection.makefile("rwb")
        self._receive()
        self.tell("WebDriver:NewSession")
        self.tell("WebDriver:SetTimeouts", implicit=1000 * GUARD_S)
        self.tell("WebDriver:SetWindowRect", width=1280, height=960)

    def tell(self, command: str, **parameters: Any) -> Any:
        """Send a command, and return its result."""
        data = json.dumps([0, 0, command, parameters]).encode()
        self._line.write(b"%d:%s" % (len(data), data))
        self._line.flush()
        _, _, error, result = self._receive()
        assert error is None, f"{command}: {error}"
        return result.get("value")

    def _receive(self) -> Any:
        size = b"".join(iter(lambda: self._line.read(1), b":"))
        return json.loads(self._line.read(int(size)))

    def close(self) -> None:
        self.tell("Marionette:Quit", flags=["eForceQuit"])
        self._line.close()
        self._process.wait(GUARD_S)

    def open(self, address: str) -> None:
        self.tell("WebDriver:Navigate", url=address)

    def find(self, selector: str) -> str:
        """Return the number of an element, when it is there."""
        (element,) = self.tell("WebDriver:FindElement", using="css selector", value=selector).values()
        return str(element)

    def click(self, selector: str) -> None:
        self.tell("WebDriver:ElementClick", id=self.find(selector))

    def type(self, selector: str, keys: str) -> None:
        self.tell("WebDriver:ElementSendKeys", id=self.find(selector), text=keys)

    def text(self, selector: str) -> str:
        return str(self.tell("WebDriver:GetElementText", id=self.find(selector)))

    def answer(self, expression: str) -> Any:
        """Return the value of an expression of the page."""
        return self.tell("WebDriver:ExecuteScript", script=f"return {expression}", args=[], sandbox=None)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag what is at a place of the arena to another place [mm]."""
        (x0, y0), (x1, y1) = (map(round, self.answer(f"kiksDesk.toClient({x}, {y})")) for x, y in (start, end))
        steps = [
            {"type": "pointerMove", "x": x0, "y": y0},
            {"type": "pointerDown", "button": 0},
            {"type": "pointerMove", "x": x1, "y": y1, "duration": 100},
            {"type": "pointerUp", "button": 0},
        ]
        self.tell("WebDriver:PerformActions", actions=[{"type": "pointer", "id": "mouse", "actions": steps}])

    def faults(self) -> list[str]:
        """Return the errors of pages, which are on the console of the browser."""
        self.tell("Marionette:SetContext", value="chrome")
        found = self.tell("WebDriver:ExecuteScript", script=FAULTS, args=[])
        self.tell("Marionette:SetContext", value="content")
        return found

    def picture(self, name: str) -> None:
        if AT_LENGTH:
            SCREENSHOTS.mkdir(exist_ok=True)
            picture = self.tell("WebDriver:TakeScreenshot", full=False)
            (SCREENSHOTS / f"firefox_{name}.png").write_bytes(base64.b64decode(picture))


def at(name: str) -> str:
    """Return the selector of an element that has a name for tests."""
    return f"[data-testid={name}]"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Firefox]:
    if FIREFOX is None:
        pytest.skip("these tests need Firefox, as firefox-esr or firefox")
    browser = Firefox(tmp_path_factory.mktemp("firefox"))
    yield browser
    browser.close()


@pytest.fixture
def firefox(browser: Firefox) -> Iterator[Firefox]:
    """Firefox; at the end, no page may have had an error."""
    yield browser
    browser.open("about:blank")
    assert browser.faults() == []


def test_the_desk_works(firefox: Firefox, shown: Shown) -> None:
    desk = shown.desk
    firefox.open(shown.url)
    wait_until(lambda: firefox.answer("window.kiksDesk?.stats().frames_drawn > 3 && kiksDesk.pose(0)"))
    firefox.click(at("tab-wire"))
    start_mm = desk.sim.pose(1)[0]
    firefox.type(at("console"), f"D,5,5{ENTER}")
    wait_until(lambda: firefox.answer("kiksDesk.pose(0).x_mm") > start_mm + 10)

    firefox.click(at("run"))
    wait_until(lambda: desk.is_paused)
    x_mm, y_mm, _ = desk.sim.pose(1)
    firefox.drag((x_mm, y_mm), (x_mm, 120))
    wait_until(lambda: desk.sim.pose(1)[1] == pytest.approx(120, abs=3))
    wait_until(lambda: firefox.answer("kiksDesk.pose(0).y_mm") == pytest.approx(desk.sim.pose(1)[1], abs=0.1))

    firefox.click(at("tab-robot"))
    firefox.click(at("proximity-0"))
    wait_until(lambda: "Why does it read" in firefox.text(at("explanation")))
    firefox.picture("explanation")

    firefox.click(at("tab-programs"))
    firefox.click(at("new-program"))
    firefox.type(".cm-content", f"{CONTROL}a")
    firefox.type(".cm-content", PROGRAM)
    wait_until(lambda: firefox.text(".cm-content") == PROGRAM)
    firefox.type(".cm-content", CONTROL + ENTER)
    wait_until(lambda: desk.programs.handles)
    firefox.click(at("run"))
    wait_until(lambda: "6" in firefox.text(at("output")))
    wait_until(lambda: desk.sim.world.state.robots["speed_setpoint"][0, 0].tolist() == [3, 3])
    assert (desk.folder / "mine.py").read_text().strip() == PROGRAM
    firefox.picture("program")

    now_s = desk.sim.time_s
    firefox.type(at("time-slider"), HOME)
    wait_until(lambda: desk.past is not None and desk.sim.time_s == 0)
    wait_until(lambda: firefox.text(at("bar-state")) == "Past")
    firefox.picture("past")
    firefox.click(at("back-to-now"))
    wait_until(lambda: desk.past is None and desk.sim.time_s >= now_s)

    firefox.click(f"{at('views')} button:last-child")
    # Without WebGL, the page says so in place of the 3-D view.
    wait_until(lambda: firefox.answer("kiksDesk.isSolid() || document.querySelector('.kiks-message') !== null"))
    firefox.picture("solid")


def test_the_page_of_a_recording_plays(firefox: Firefox, tmp_path: Path) -> None:
    sim = Simulation(Arena.box(500, 400), seed=3)
    with sim.record(tmp_path / "run.mcap"):
        Khepera(sim.port(1)).set_speed(6, 5)
        sim.run(3.0)
    save_page(Recording(tmp_path / "run.mcap"), tmp_path / "run.html")
    firefox.open((tmp_path / "run.html").as_uri())
    wait_until(lambda: firefox.answer("window.kiksPage?.stage.frames_drawn > 0"))
    start_mm = firefox.answer("kiksPage.feed.frame.pose(0).x_mm")
    firefox.click("#play")
    wait_until(lambda: firefox.answer("kiksPage.player.time_s > 1"))
    assert abs(firefox.answer("kiksPage.feed.frame.pose(0).x_mm") - start_mm) > 1
    firefox.picture("page")

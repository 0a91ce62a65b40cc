"""What tutorials and the first page of the site say, done on pages of an installed wheel from an empty folder on."""

import re
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from tests.at_length import at_length, cases
from tests.desk.test_desk_command import started, stop, url_of
from tests.desk.test_site import served
from tests.desk.visitor import FIRST_PICTURE, Guest, NewPage, expect, in_each_browser
from tests.documents import blocks
from tests.guard import GUARD_S
from tests.served import PROGRAMS, called
from tests.wheels import ROOT, build, install

from kiks import Champion, controllers
from kiks.model.package import shipped
from kiks.model.project import Project

pytestmark = [pytest.mark.slow, in_each_browser]


@pytest.fixture(scope="module")
def kiks(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The command of KiKS from a wheel."""
    folder = tmp_path_factory.mktemp("installed")
    return str(install(build(folder / "wheel"), folder / "venv") / "kiks")


@contextmanager
def desk_of(kiks: str, new_page: NewPage, folder: Path, *words: str) -> Iterator[Guest]:
    """Open the page of the desk that a command shows; at the end, press Ctrl-C."""
    with started(*words, folder=folder, command=[kiks]) as (process, output):
        yield (guest := Guest(new_page(), url_of(output)))
        guest.page.goto("about:blank")  # it would look for the desk that has ended
        stop(process)


def time_s(guest: Guest) -> float:
    return guest.answer("import('kiks-desk').then(({ pageFeed }) => pageFeed().frame.time_s)")


def press(guest: Guest, key: str, *, is_paused: bool) -> None:
    """Press a key, and wait until time stands still, or passes."""
    guest.page.keyboard.press(key)
    expect(guest.at("run")).to_have_attribute("aria-label", "Run" if is_paused else "Pause")
    # The label may come before the frame with the time at which the world has stopped.
    shown = "import('kiks-desk').then(({ pageFeed }) => pageFeed().frame.isPaused)"
    guest.until(lambda: guest.answer(shown) is is_paused)


def drag(guest: Guest, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Drag the mouse from a place of the arena to another one [mm]."""
    (x, y), (to_x, to_y) = (guest.answer("([x, y]) => kiksDesk.toClient(x, y)", [*place]) for place in (start, end))
    guest.page.mouse.move(x, y)
    guest.page.mouse.down()
    guest.page.mouse.move(to_x, to_y, steps=8)
    guest.page.mouse.up()


def test_the_desk_step_by_step(kiks: str, new_page: NewPage, tmp_path: Path) -> None:
    with desk_of(kiks, new_page, tmp_path, "demo", "avoid", "--desk") as guest:
        # 1. Watch.
        guest.tab("robot")
        place = guest.seen(1)
        guest.until(lambda: guest.seen(1) != place)
        # 2. Pause, and step.
        press(guest, "Space", is_paused=True)
        paused_s = time_s(guest)
        for key, by_s in ((".", 0.01), (",", 0.0)):
            guest.page.keyboard.press(key)
            guest.until(lambda by_s=by_s: time_s(guest) == pytest.approx(paused_s + by_s))
        guest.click("back-to-now")
        # 3. Drag the robot, and turn it by its rim.
        x_mm, y_mm, _ = guest.seen(1)
        drag(guest, (x_mm, y_mm), (250, 540))
        guest.until(lambda: guest.seen(1)[:2] == pytest.approx((250, 540), abs=2))
        *_, heading_rad = guest.seen(1)
        drag(guest, (250, 515), (275, 540))
        guest.until(lambda: abs(guest.seen(1)[2] - heading_rad) > 1)
        press(guest, "Space", is_paused=False)
        guest.until(lambda: guest.seen(1)[:2] != pytest.approx((250, 540), abs=5))
        # 4. Ask why.
        guest.click("proximity-2", shows={"explanation": "Why does it read"})
        # 5. Talk to the robot, while its program drives it.
        guest.tab("wire")
        for command, answer in (("N", r"← n(,\d+){8}"), ("D,0,0", r"← d\b")):
            guest.send(command)
            expect(guest.at("console-log")).to_contain_text(re.compile(answer))
        # 6. Go back, and go on from there.
        guest.click("back-long", shows={"bar-state": "Past"})
        past_s = time_s(guest)
        guest.click("go-on-from-here", "dialog-yes", shows={"bar-state": "Now"})
        x_mm, y_mm, _ = guest.seen(1)
        drag(guest, (x_mm, y_mm), (250, 200))
        guest.until(lambda: guest.seen(1)[:2] == pytest.approx((250, 200), abs=2))
        guest.click("run")
        guest.until(lambda: time_s(guest) > past_s + 0.2)
        # 7. Write a program.
        guest.tab("programs")
        expect(guest.at("name")).to_have_value("avoid.py")
        guest.choose("script", "example: first steps")
        expect(guest.at("editor")).to_contain_text("D,5,5")
        guest.write(shipped("examples/demos/first_steps.py").read_text().replace("D,5,5", "D,8,8"))
        guest.at("name").fill("my_program.py")
        guest.click("run-program", shows={"programs": "my_program.py on robot 1"})
        assert "D,8,8" in (tmp_path / "my_program.py").read_text()
        # 8. Draw a wall, and save.
        guest.tab("arena")
        guest.take("rectangle")
        drag(guest, (60, 560), (120, 600))
        expect(guest.at("undo")).to_be_enabled()
        guest.fill({"save-name": "mine"})
        guest.picture("tutorial")
        guest.click("save", told=f"Saved as mine.kiks in {tmp_path}")
    project = Project.load(tmp_path / "mine.kiks")
    assert (project.robots[0].program, len(project.arena.walls)) == ("my_program.py", 1)
    for words in (["mine.kiks", "my_program.py"], ["mine.kiks"]):
        ran = called(kiks, "run", *words, cwd=tmp_path)
        assert (ran.returncode, ran.stderr.count("robot 1:")) == (0, 1), ran.stderr


@at_length
def test_a_class_step_by_step(kiks: str, new_page: NewPage, tmp_path: Path) -> None:
    assert called(kiks, "examples", "examples", cwd=tmp_path).returncode == 0
    with desk_of(kiks, new_page, tmp_path, *CLASS) as guest:
        guest.shows({"exercise-text": "Somewhere in the room a lamp burns"})
        guest.tab("programs")
        guest.write((ROOT / "tests/exercises/solutions/lamp.py").read_text())
        guest.click("run-program", shows={"programs": "find_the_lamp.py on robot 1"})
        guest.until(lambda: time_s(guest) > 0.5)
        guest.click("tab-exercise", "try-all")
        expect(guest.at("tries-state")).to_contain_text(re.compile(r"(\d+) of \1 solved"))
        guest.picture("class")
        (submissions := tmp_path / "submissions").mkdir()
        with guest.page.expect_download() as download:
            guest.click("hand-in")
        assert download.value.suggested_filename == "find_the_lamp.zip"
        download.value.save_as(submissions / "ada.zip")
    graded = called(kiks, "grade", "--trusted", "examples/exercises/lamp", "submissions", cwd=tmp_path)
    assert graded.returncode == 0, graded.stderr
    assert "ada" in graded.stdout
    assert (tmp_path / "grades-lamp" / "report.html").exists()


def test_an_old_program_is_seen_again(kiks: str, new_page: NewPage, tmp_path: Path) -> None:
    drive = PROGRAMS / "drive.py"
    assert called(kiks, "run", "--record", "run.mcap", drive, "COM1", "20", "5", "3", cwd=tmp_path).returncode == 0
    with desk_of(kiks, new_page, tmp_path, "replay", "run.mcap") as guest:
        guest.until(lambda: time_s(guest) > 0.2)
        # It plays on from there, so one look may come too late.
        guest.until(lambda: guest.at("time-slider").press("Home") or time_s(guest) < 0.1)
        start = guest.seen(1)
        guest.at("time-slider").press("End")
        guest.until(lambda: guest.seen(1) != start)


SHOWN = blocks(ROOT / "docs/tutorials/first_program.md")[-2].code.replace("while sim.", "sim.show()\nwhile sim.")
"""The last program of the tutorial, with the line that shows it."""


def test_the_first_program_is_watched_from_a_terminal(kiks: str, new_page: NewPage, tmp_path: Path) -> None:
    (tmp_path / "clear.py").write_text(SHOWN)
    with started("clear.py", folder=tmp_path, command=[str(Path(kiks).with_name("python"))]) as (_, output):
        guest = Guest(new_page(), url_of(output))
        place = guest.seen(1)
        guest.until(lambda: guest.seen(1) != place)
        guest.page.goto("about:blank")


def test_the_first_program_is_watched_in_a_notebook(kiks: str, new_page: NewPage, tmp_path: Path) -> None:
    from jupyter_client.manager import KernelManager

    kernel = KernelManager()
    kernel.kernel_spec.argv[0] = str(Path(kiks).with_name("python"))
    kernel.start_kernel(cwd=str(tmp_path))
    cells = kernel.blocking_client()
    with ExitStack() as stack:
        stack.callback(kernel.shutdown_kernel, now=True)
        cells.start_channels()
        stack.callback(cells.stop_channels)
        cells.wait_for_ready(timeout=GUARD_S)
        cells.execute(SHOWN)
        while (message := cells.get_iopub_msg(timeout=GUARD_S))["msg_type"] != "display_data":
            assert message["msg_type"] != "error", message
        (tmp_path / "index.html").write_text(
            f'<link rel="icon" href="data:,">{message["content"]["data"]["text/html"]}'
        )
        page = new_page()
        page.goto(stack.enter_context(served(tmp_path)))
        frame = page.wait_for_selector("iframe").content_frame()
        frame.wait_for_function(FIRST_PICTURE)
        place = frame.evaluate("kiksDesk.pose(0).x_mm")
        frame.wait_for_function("(place) => kiksDesk.pose(0).x_mm !== place", arg=place)


CLASS = ("desk", "examples/exercises/lamp", "--no-browser", "--port", "0")


@pytest.mark.parametrize(
    ("words", "program", "then"),
    cases(
        [
            (("demo", "soccer", "--desk"), "player.py", ["referee.py", "sight.py", "whereabouts.py"]),
            (CLASS, "find_the_lamp.py", []),
            (("run", "--desk", "examples/programs/wander.py"), "wander.py", []),
            (("run", "--desk", "examples/exercises/square", "examples/programs/wander.py"), "wander.py", []),
            (("desk", "avoid", "--no-browser", "--port", "0"), "avoid.py", []),
            (("run", "--desk", "champion"), "drive.py", []),
        ],
    ),
)
def test_each_desk_shows_its_program_and_saves_all_that_a_run_needs(
    words: tuple[str, ...], program: str, then: list[str], kiks: str, new_page: NewPage, tmp_path: Path
) -> None:
    assert called(kiks, "examples", "examples", cwd=tmp_path).returncode == 0
    (tmp_path / "champion").mkdir()
    Champion(controllers.linear(), [0.5] * 18).save(tmp_path / "champion" / "champion.toml")
    with desk_of(kiks, new_page, tmp_path, *words) as guest:
        guest.tab("programs")
        expect(guest.at("name")).to_have_value(program)
        if words == CLASS:
            guest.click("run-program", shows={"attached": f"{program} starts with this world on robot 1"})
        guest.until(lambda: time_s(guest) > 0.1)
        guest.tab("arena")
        guest.fill({"save-name": "mine"})
        guest.click("save", told=f"Saved as mine.kiks in {tmp_path}")
    assert {program, *then} <= {path.name for path in tmp_path.iterdir()} or words[-1].startswith("examples/programs")
    ran = called(kiks, "run", "mine.kiks", "--seconds", "1", cwd=tmp_path)
    assert (ran.returncode, "robot 1:" in ran.stderr) == (0, True), ran.stderr

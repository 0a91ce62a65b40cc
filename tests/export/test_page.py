"""The page of a recording: it holds what was recorded, needs no network, and plays in a browser from a file."""

from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.at_length import at_length, cases, share
from tests.desk.visitor import (
    COLOURS,
    Browser,
    NewPage,
    Page,
    check_access,
    check_reach,
    in_each_browser,
    leave_picture,
)
from tests.recording.random_runs import record_random
from tests.recording.test_engine_inputs import taken

from kiks import Arena, Khepera, ParameterError, Recording, Simulation
from kiks.export import page_contents as contents
from kiks.export.bundle import bundle
from kiks.export.frames import pack_frame
from kiks.export.page import WEB, save_page
from kiks.export.page_run import PageRun
from kiks.recording.mcap_file import McapReader
from kiks.recording.recorder import RunRecorder
from kiks.recording.replay import Replay

Visit = Callable[..., Page]
Files = tuple[Path, Path]

END_S = share(60.0, 300.0)

EVIL = (
    "</script><script>document.title = 'evil'</script><img src=x onerror=\"document.title = 'evil'\">{{ 123457 * 2 }}"
)


def drive(sim: Simulation, seconds: float) -> None:
    """Let all robots avoid obstacles by a simple rule."""
    robots, end_ns = [Khepera(sim.port(number)) for number in range(1, sim.robot_count + 1)], sim.now_ns + seconds * 1e9
    while sim.now_ns < end_ns:
        for robot in robots:
            values = robot.proximity()
            robot.set_speed(8 - values[3] // 60, 8 - values[2] // 60)


@pytest.mark.parametrize("arena", cases(["office", "pillars"]))  # lit, and dark
def test_five_minutes_of_a_robot_are_small(arena: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sim = Simulation(Arena.load(arena), seed=1)
    robot = Khepera(sim.port(1))
    with sim.record(tmp_path / "run.mcap"):
        while sim.time_s < share(30.0, 300.0):
            robot.set_speed(*((4, -4) if max(robot.proximity()[1:5]) > 200 else (8, 8)))
    runs: set[Replay] = set()
    act = Replay.act
    monkeypatch.setattr(Replay, "act", lambda self: (self.sim.now_ns and runs.add(self), act(self)))
    page = page_of(tmp_path / "run.mcap", tmp_path)
    assert len(runs) == 1, "the run is made again once"
    assert page.stat().st_size < share(650_000, 800_000)


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Files:
    """A recording of one robot, which is not short, and its page."""
    file = recorded(tmp_path_factory.mktemp("plain") / "run.mcap", END_S)
    return file, page_of(file, file.parent)


def recorded(file: Path, seconds: float) -> Path:
    sim = Simulation(Arena.box(500, 400), seed=3)
    with sim.record(file):
        drive(sim, seconds)
    return file


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("short") / "short.mcap", 12)


@pytest.fixture(scope="module")
def rich(tmp_path_factory: pytest.TempPathFactory) -> Files:
    """A recording with turrets, balls, lamps, other walls, another robot, notes, and hostile texts; and its page."""
    file = tmp_path_factory.mktemp("rich") / "rich.mcap"
    sim = Simulation(Arena.from_array(np.zeros((400, 600), np.uint8), name=EVIL), seed=5, robots=2, thinking="fixed:3")
    sim.fit(1, "k213")
    sim.add_ball(500, 60)
    sim.add_lamp(60, 60)
    programs = {"1-drive.py": f"print('hello')\n# {EVIL}\n", f"2-{EVIL}.py": "", "3-notes.txt": EVIL}
    with RunRecorder(sim, file, programs=programs, about={"command": f"kiks run {EVIL}"}) as recorder:
        drive(sim, 3)
        recorder.mark(f"turn {EVIL}")
        recorder.say(1, f"here {EVIL}")
        drive(sim, 2)
        sim.add_ball(80, 340)
        drive(sim, 2)
        walls = np.zeros((400, 600), np.uint8)
        walls[-6:, 200:300] = 255
        sim.set_arena(Arena.from_array(walls, name=EVIL))
        drive(sim, 2)
        sim.add_robot()
        drive(sim, 3)
    return file, page_of(file, file.parent, title=EVIL, robot=2)


class Tags(HTMLParser):
    """Collects tags with their attributes, and all text outside scripts and styles."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(page.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        if self.tags and self.tags[-1][0] not in ("script", "style"):
            self.text += data


def page_of(file: Path, folder: Path, **options: Any) -> Path:
    save_page(Recording(file), folder / "page.html", **options)
    return folder / "page.html"


@at_length
def test_the_same_recording_gives_the_same_page(short: Path, tmp_path: Path) -> None:
    shares: list[float] = []
    first, second = (page_of(short, tmp_path, on_progress=shares.append).read_bytes() for _ in range(2))
    assert first == second
    half = shares[: len(shares) // 2]
    assert half == sorted(half)
    assert (half[-1], len(half)) == (1, 4)


def test_no_text_becomes_markup(rich: Files) -> None:
    found = Tags(rich[1])
    assert [tag for tag, _ in found.tags].count("script") == 5
    assert all(str(attrs["src"]).startswith("data:") for tag, attrs in found.tags if tag == "img")
    assert not [attrs for _, attrs in found.tags if any(name.startswith("on") for name in attrs)]
    # In the title, its heading, what ran, the arena, a program, its name, the notes, the command ...
    assert found.text.count(EVIL) >= 9
    assert "246914" not in found.text


@at_length
def test_long_texts_are_cut(tmp_path: Path) -> None:
    sim = Simulation(Arena.box(300, 300), seed=1)
    with RunRecorder(sim, tmp_path / "long.mcap", programs={"1-long.py": "x = 1\n" * 200_000}) as recorder:
        recorder.say(0, "word " * 100_000)
        Khepera(sim.port(1)).proximity()
    page = page_of(tmp_path / "long.mcap", tmp_path)
    assert page.stat().st_size < 3_000_000
    assert "The text is longer: the recording holds all of it." in Tags(page).text
    assert "word word …" in Tags(page).text


def test_programs_have_colours_up_to_a_limit_and_none_where_that_takes_minutes(monkeypatch: pytest.MonkeyPatch) -> None:
    texts = {"1-a.py": "if x: pass\n" * 2000, "2-b.py": "if y: pass\n" * 4000, "3-c.txt": "if z: pass\n"}
    first, second, third = (each["text"] for each in contents._programs(SimpleNamespace(programs=texts)))
    assert ["<span" in each for each in (first, second, third)] == [True, False, False]
    assert second.unescape().startswith("if y: pass\nif y")
    seen: list[str] = []
    monkeypatch.setattr(contents, "highlight", lambda code, *_: seen.append(code) or "")
    for text in (" \n" * 90_000, "x = 1\n" + "\r \x0c" * 60_000 + "y"):
        contents._programs(SimpleNamespace(programs={"1-a.py": text}))
        assert not any(line and line.isspace() for line in seen.pop().split("\n"))
    assert not seen


def test_the_numbers_are_those_of_the_run(rich: Files) -> None:
    recording, found = Recording(rich[0]), Tags(rich[1])
    sim = recording.world_at(recording.duration_s)
    for number in (1, 2):
        replies = recording.table("wire", number)
        told = f"{sim.travelled_mm(number) / 1000:.2f} m", f"{sim.contacts(number)}{(~replies['is_sent']).sum()}"
        assert all(each in found.text for each in told)
    assert "2 x Khepera" not in found.text
    for told in ("3 x Khepera", "1 ball, 1 lamp", "K213 linear vision on robot 1"):
        assert told in found.text


def test_there_is_a_scene_for_each_change(rich: Files) -> None:
    run = PageRun.of(Recording(rich[0]).log)
    counts = [(len(scene["robots"]), len(scene["bodies"]), scene["arena"]["picture"]) for scene in run.scenes]
    assert counts == [(2, 1, 0), (2, 2, 0), (2, 2, 1), (3, 2, 1)]
    assert run.replay.equal_count == run.replay.check_count > 10
    assert run.replay.state_hash == run.replay.sim.state_hash()


@at_length
def test_a_page_says_that_the_run_differs(short: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Another version of KiKS might make another run; here robots get no speeds."""
    apply = Replay._apply
    monkeypatch.setattr(Replay, "_apply", lambda self, it: None if it.data.startswith(b"D") else apply(self, it))
    run = PageRun.of(Recording(short).log)
    assert run.replay.equal_count < 10
    assert len(run.scenes) == 1
    assert "checkpoints differ" in Tags(page_of(short, tmp_path)).text


def test_what_a_killed_run_has_written_becomes_a_page_and_mistakes_get_an_error(short: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    last = McapReader(short).chunks[-1]
    cut.write_bytes(short.read_bytes()[: last.offset + last.length])
    found = Tags(page_of(cut, tmp_path))
    assert "was killed" in found.text
    assert f"{Recording(cut).duration_s:.3f} s of simulated time" in found.text
    with pytest.raises(ParameterError, match=r"robot must be .*from 1 to 1"):
        page_of(cut, tmp_path, robot=2)
    with pytest.raises(ParameterError, match="a page must"):
        save_page(Recording(cut), tmp_path / "none" / "page.html")


@pytest.fixture
def lonely(tmp_path: Path) -> Path:
    """A recording of a ball in a world without a robot."""
    sim = Simulation(Arena.box(300, 300), seed=1, robots=0)
    with sim.record(tmp_path / "lonely.mcap"):
        sim.move_body(sim.add_ball(100, 100), 100, 100, speed_mm_s=100.0)
        sim.run(2.0)
    return tmp_path / "lonely.mcap"


def test_a_bundle_takes_no_module_that_it_does_not_understand(tmp_path: Path) -> None:
    for text in ('import Vue from "vue";', "export default 5;", 'import * as all from "./other.js";'):
        (tmp_path / "entry.js").write_text(text)
        with pytest.raises(AssertionError, match=r"entry\.js has what no bundle can have"):
            bundle(tmp_path / "entry.js")
    assert '"solid_view.js"] =' not in bundle(WEB / "run_page.js")


@pytest.fixture
def visit(new_page: NewPage) -> Visit:
    """Open a page of a file, without a network; nothing but the file itself may be asked for."""

    def open_file(file: Path, width: int = 1280, height: int = 800, **options: Any) -> Page:
        page = new_page(width, height, offline=True, **options)
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        page.goto(file.as_uri())
        page.wait_for_function("() => window.kiksPage?.stage.frames_drawn > 0")
        assert {url.partition(":")[0] for url in asked if url != file.as_uri()} <= {"data", "blob"}
        return page

    return open_file


def shown_pose(page: Page, time_s: float, robot: int = 0) -> list[float]:
    page.evaluate("(time_s) => kiksPage.feed.show(time_s)", time_s)
    pose = page.evaluate("(robot) => kiksPage.feed.frame.pose(robot)", robot)
    return [pose["x_mm"], pose["y_mm"], pose["heading_rad"]]


@pytest.mark.slow
@in_each_browser
def test_the_player_shows_the_recording_plays_jumps_and_ends(plain: Files, visit: Visit) -> None:
    page, recording = visit(plain[1]), Recording(plain[0])
    poses = recording.table("poses")
    # Near and far, forwards and backwards, at frames and between them.
    for time_s in (0.0, 0.04, 0.1, 7.0, END_S - 10, END_S - 9.98, 12.34, 12.3, END_S - 0.01):
        row = poses[np.searchsorted(poses["time_s"], time_s - 1e-6)]
        x_mm, y_mm, heading_rad = shown_pose(page, time_s)
        assert (x_mm, y_mm) == pytest.approx((row["x_mm"], row["y_mm"]), abs=0.15)
        assert np.cos(heading_rad - row["heading_rad"]) > 0.999
    for time_s in (4.0, END_S - 20):
        shown_pose(page, time_s)
        readings = page.evaluate("[...kiksPage.feed.frame.robot(0).proximity]")
        assert readings == recording.world_at(time_s).look().proximity[0].tolist()

    # It plays, jumps and ends.
    shown_pose(page, 0.0)
    clock, play = page.locator("#clock"), page.locator("#play")
    assert clock.text_content() == "0:00.00"
    play.click()
    page.wait_for_function("() => kiksPage.player.time_s > 0.2")
    play.click()
    assert page.evaluate("kiksPage.player.isPlaying") is False
    page.locator("#slider").fill("43.4")
    page.wait_for_function("() => document.getElementById('clock').textContent === '0:43.40'")
    assert page.evaluate("kiksPage.feed.frame.time_s") == pytest.approx(43.4, abs=0.04)
    assert page.evaluate("kiksPage.stage.topView.trails.ways[0].length") > 100
    page.locator("h1").click()
    long, short = ("ArrowRight", 44.4), ("Shift+ArrowRight", 43.44)
    for key, time_s in (long, ("ArrowLeft", 43.4), short, ("Shift+ArrowLeft", 43.4)):
        page.keyboard.press(key)
        assert page.evaluate("kiksPage.player.time_s") == pytest.approx(time_s, abs=1e-6)
    page.locator("#speed").select_option("30")
    page.locator("#slider").fill(f"{END_S - 1}")
    page.locator("h1").click()
    page.keyboard.press("Space")
    page.wait_for_function("() => !kiksPage.player.isPlaying && kiksPage.player.time_s === kiksPage.feed.end_s")
    assert page.locator(".times").inner_text().replace(" ", "").split("/")[0] == clock.inner_text()
    page.keyboard.press("Space")
    page.wait_for_function("(end_s) => kiksPage.player.isPlaying && kiksPage.player.time_s < end_s - 10", arg=END_S)


AGAIN = """async (texts) => {
    const [{ unpackText }, { readInputs }, { EngineWorld }, { Comparison, hash }] =
        ["packed_text", "engine_inputs", "engine_world", "comparison"].map((name) => modules[`${name}.js`]);
    const { engine } = kiksPage.comparison.world, found = [];
    for (const text of texts) {
        const { head, rest } = await unpackText(text), inputs = readInputs(head, rest);
        const comparison = new Comparison(new EngineWorld(engine, inputs));
        await comparison.run();
        // Another world of the run goes to and fro, without what the first one remembers.
        const { world } = comparison, other = new EngineWorld(engine, inputs), end_ns = world.tick * 1e7;
        const hashes = [];
        for (const share of [0.9, 0.1, 0.95, 0.5, 0, 0.5, 1, 0.1, 0.02]) {
            const time_ns = Math.round(inputs.begin_ns + share * (end_ns - inputs.begin_ns));
            other.goTo(time_ns);
            world.onCheck = () => {};
            world.goTo(0);
            if (time_ns > inputs.begin_ns) world.advanceTo(Math.ceil(time_ns / 1e7));
            hashes.push((await hash(other.hashedBytes())) === (await hash(world.hashedBytes())));
        }
        found.push([comparison.compared, comparison.equal, comparison.firstDifference_s, hashes.every(Boolean)]);
    }
    return found;
}"""
"""Makes runs again with the engine of a page."""


@pytest.mark.slow
@in_each_browser
def test_the_engine_of_a_page_makes_any_run_again(short: Path, visit: Visit, tmp_path: Path) -> None:
    replays, texts = zip(
        *(taken(record_random(seed, tmp_path / f"{seed}.mcap")) for seed in range(share(6, 60))), strict=True
    )
    page = visit(page_of(short, tmp_path))
    found = page.evaluate(AGAIN, list(texts))
    assert found == [[replay.check_count, replay.check_count, None, True] for replay in replays]
    told = "Made again on this computer: equal to the recording, 12 of 12 s."
    page.wait_for_function("(told) => document.getElementById('made-again').textContent === told", arg=told)


@pytest.mark.slow
def test_frames_of_a_page_are_those_of_a_desk(rich: Files, visit: Visit) -> None:
    page, recording = visit(rich[1]), Recording(rich[0])
    log = recording.log
    times_ns = [log.begin_ns, *range(40_000_000, log.end_ns, 1_240_000_000), log.end_ns]
    for time_ns in (times_ns[4], *times_ns):
        place, packed = page.evaluate(
            """(time_s) => {
                const { feed } = kiksPage, index = feed.indexAt(time_s);
                return [feed.sceneFrom(index).scene, [...new Uint8Array(feed.buffer(index))]];
            }""",
            time_ns / 1e9,
        )
        sim = Replay(log, time_ns).sim
        assert bytes(packed) == pack_frame(sim, scene=place)


@pytest.mark.slow
def test_a_page_says_from_when_on_its_run_is_another_one(short: Path, visit: Visit, tmp_path: Path) -> None:
    compare = Replay._compare

    def forge(self: Replay, checkpoint: Any) -> None:
        compare(self, checkpoint._replace(data=b"0" * 16) if checkpoint.time_ns == 3_000_000_000 else checkpoint)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Replay, "_compare", forge)
        file = page_of(short, tmp_path)
    told = "Made again on this computer: it differs from the recording from 3 s on."
    visit(file).wait_for_function("(told) => document.getElementById('made-again').textContent === told", arg=told)


@at_length
def test_without_webassembly_the_rest_of_a_page_can_be_read(short: Path, tmp_path: Path, new_page: NewPage) -> None:
    page = new_page(1280, 800, offline=True)
    page.add_init_script("delete window.WebAssembly")
    page.goto(page_of(short, tmp_path).as_uri())
    page.get_by_text("This browser is too old for the player. Everything else on this page can be read.").wait_for()


@pytest.mark.slow
def test_axe_finds_nothing_serious(rich: Files, visit: Visit) -> None:
    page = visit(rich[1])
    for colours, rules in (("light", None), ("dark", COLOURS)):
        page.emulate_media(color_scheme=colours)
        check_access(page, colours, rules)
    page = visit(rich[1], 390, 844, has_touch=True, is_mobile=True)
    check_access(page, "phone")
    check_reach(page, "phone")


@at_length
@pytest.mark.slow
def test_a_page_shows_changes_robots_and_events(rich: Files, visit: Visit) -> None:
    page, recording = visit(rich[1], color_scheme="dark"), Recording(rich[0])
    title = page.title()
    assert "evil" not in title.split("'")[0]
    assert title == page.locator("h1").text_content()
    counts = "[kiksPage.feed.frame.robot_count, kiksPage.feed.frame.body_count, kiksPage.feed.scene.scene]"
    end_s = page.evaluate("kiksPage.feed.end_s")
    for time_s, count in ((end_s, [3, 2, 3]), (6.0, [2, 2, 1]), (1.0, [2, 1, 0]), (8.0, [2, 2, 2])):
        page.evaluate("(time_s) => kiksPage.player.seek(time_s)", time_s)
        page.wait_for_function("(time_s) => kiksPage.player._shown_s === time_s", arg=time_s)
        assert page.evaluate(counts) == count
    page.wait_for_function("() => kiksPage.stage._raster?.cells.some((cell) => cell === 255)")
    assert page.evaluate("kiksPage.feed.frame.lamp_count") == 1

    # The third robot is not there yet; the second one has no camera.
    page.locator("#robot").select_option(index=2)
    assert page.get_by_text("This robot is not there at this time.").is_visible()
    page.locator("#robot").select_option(index=0)
    page.locator(".kiks-camera").wait_for()
    page.locator("#robot").select_option(index=1)
    page.locator(".kiks-camera").wait_for(state="hidden")
    x, y = page.evaluate("kiksPage.stage.toClient(kiksPage.feed.frame.pose(0).x_mm, kiksPage.feed.frame.pose(0).y_mm)")
    page.mouse.click(x, y)
    assert page.locator("#robot").input_value() == "0"
    before = shown_pose(page, 8.0)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 80, y + 40, steps=4)
    page.mouse.up()
    assert shown_pose(page, 8.0) == before

    lines = page.locator("#list li.output button")
    lines.click()
    page.wait_for_function("() => document.querySelector('#list .now')?.parentElement.className === 'output'")
    events = recording.table("events")
    assert page.evaluate("kiksPage.player.time_s") == pytest.approx(events["time_s"][events["kind"] == "output"][0])
    page.locator("#kinds input[name=output]").uncheck()
    lines.wait_for(state="hidden")
    with page.expect_download() as saved:
        page.locator("button[data-save=program-1]").click()
    assert saved.value.suggested_filename == "drive.py"
    assert saved.value.path().read_text() == recording.programs["1-drive.py"]
    assert page.title() == title


@at_length
def test_narrow_pages_and_pages_without_time_or_robots_fit(tmp_path, rich: Files, lonely: Path, visit: Visit) -> None:
    none = recorded(tmp_path / "none.mcap", 0)
    for file in (page_of(none, tmp_path), rich[1]):
        page = visit(file, 380, 700)
        assert page.evaluate("document.documentElement.scrollWidth") <= 380
        page.locator("#play").click()
        page.evaluate("kiksPage.player.seek(kiksPage.feed.end_s)")
        page.wait_for_function(
            "() => document.getElementById('facts').textContent.includes(kiksPage.feed.frame.robot(0).x_mm.toFixed(1))"
            " && kiksPage.player._shown_s === kiksPage.feed.end_s"
        )
    page = visit(page_of(lonely, lonely.parent))
    assert "There was no robot in this run." in page.locator("#monitor").inner_text()
    assert page.locator("figure").get_attribute("class") == "paths"  # the only one
    assert page.get_by_text("The wire").count() == 0
    assert not any(page.locator(name).is_visible() for name in ("#robot", "#follow"))
    page.evaluate("kiksPage.player.seek(kiksPage.feed.end_s)")
    page.wait_for_function("() => kiksPage.player._shown_s === kiksPage.feed.end_s")
    leave_picture(page, "page_without_a_robot", full_page=True)


@at_length
def test_nothing_else_runs_in_a_page(short: Path, tmp_path: Path, browser: Browser) -> None:
    """Even if a text became markup, the page's policy would not let it run."""
    file = page_of(short, tmp_path)
    hostile = '<main><script>window.evil = 1</script><img src="data:," onerror="window.evil = 2">'
    file.write_text(file.read_text().replace("<main>", hostile))
    page = browser.new_page(offline=True)
    refused: list[str] = []
    page.on("console", lambda said: refused.append(said.text) if said.type == "error" else None)
    page.goto(file.as_uri())
    page.wait_for_function("() => window.kiksPage")
    assert page.evaluate("window.evil") is None
    assert sum("Content Security Policy" in text for text in refused) == 2
    page.close()

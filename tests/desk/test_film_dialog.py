"""The desk films the run that it shows, and gives the film to the browser."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.at_length import at_length
from tests.desk.visitor import Visitor, expect

from kiks.export.film import FPS

pytestmark = pytest.mark.slow


def picture_count(file: Path) -> int:
    import av

    with av.open(str(file)) as container:
        return sum(1 for _ in container.decode(video=0))


@pytest.fixture
def recorded(visitor: Visitor, tmp_path: Path) -> Iterator[Visitor]:
    """A paused world that is recorded."""
    visitor.pause()
    with visitor.sim.record(tmp_path / "run.mcap"):
        yield visitor


def open_dialog(visitor: Visitor, seconds: int = 0) -> None:
    """Let whole seconds pass in the paused world, and open the dialog."""
    end_ns = visitor.sim.now_ns + seconds * 1_000_000_000
    visitor.desk.gate.step(seconds)
    visitor.until(lambda: visitor.sim.now_ns == end_ns)
    visitor.tab("arena")
    visitor.at("film").click()
    expect(visitor.at("film-make")).to_be_visible()


def span(visitor: Visitor) -> tuple[float, float]:
    """Return from when to when the film goes [s]."""
    return tuple(float(visitor.at(f"film-{name}").input_value()) for name in ("start", "end"))


def make(visitor: Visitor, file: Path) -> str:
    """Make the film, and return under which name it is offered."""
    with visitor.page.expect_download() as download:
        visitor.at("film-make").click()
    download.value.save_as(file)
    return str(download.value.suggested_filename)


def test_a_part_of_the_run_is_filmed_and_downloaded(recorded: Visitor, tmp_path: Path) -> None:
    visitor, begin_s = recorded, recorded.sim.time_s
    open_dialog(visitor, 12)
    start_s, end_s = span(visitor)
    assert (start_s, end_s) == pytest.approx((end_s - 10.0, visitor.sim.time_s), abs=0.01)
    assert start_s > begin_s
    visitor.fill({"film-end": f"{start_s + 1:g}", "film-speed": "2"})
    visitor.choose("film-follow", "robot 2, in the middle")
    visitor.picture("film_dialog")
    assert make(visitor, tmp_path / "film.mp4") == "kiks-film.mp4"
    assert picture_count(tmp_path / "film.mp4") == pytest.approx(1 / 2 * FPS + 1, abs=1)
    expect(visitor.at("film-make")).to_be_enabled()


@at_length
def test_mistakes_are_told_and_a_closed_dialog_gives_the_film_up(recorded: Visitor) -> None:
    visitor = recorded
    open_dialog(visitor, 6)
    end_s = visitor.at("film-end").input_value()
    for name, value, words in (
        ("end", "0", "a film must end after it begins"),
        ("end", "", "To [s] must be a number of at least 0, but the field is empty"),
        ("start", "1e6", "start_s must be from"),
        ("speed", "0", "speed must be from 0.001 to 1000"),
        ("speed", "0.001", "A film must be at most 300 s long"),
    ):
        before = visitor.at(f"film-{name}").input_value()
        visitor.at(f"film-{name}").fill(value)
        visitor.click("film-make", told=words)
        visitor.at(f"film-{name}").fill(before)
    assert visitor.at("film-end").input_value() == end_s
    # A closed dialog gives the film up.
    visitor.fill({"film-start": f"{span(visitor)[1] - 5:g}", "film-speed": "0.02"})
    visitor.at("film-make").click()
    expect(visitor.at("film-make")).to_be_disabled()
    visitor.click("film-close", told="The dialog was closed; the film was discarded.")


@at_length
def test_the_past_is_filmed_without_a_recording_of_ones_own(visitor: Visitor, tmp_path: Path) -> None:
    visitor.pause()
    open_dialog(visitor, 5)
    visitor.click("film-close", "back-long")
    visitor.until(lambda: visitor.desk.past is not None)
    begin_s, now_s = visitor.desk.looking.span.begin_ns / 1e9, visitor.desk.present.sim.time_s
    visitor.at("film").click()
    expect(visitor.at("film-make")).to_be_visible()
    assert span(visitor) == (pytest.approx(begin_s, abs=0.01), pytest.approx(now_s, abs=0.01))
    visitor.at("film-start").fill(f"{now_s - 2:g}")
    make(visitor, tmp_path / "film.mp4")
    assert picture_count(tmp_path / "film.mp4") == pytest.approx(2 * FPS + 1, abs=1)

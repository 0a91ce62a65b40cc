"""The desk films the run that it shows, and gives the film to the browser."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest
from playwright.sync_api import expect
from tests.at_length import at_length
from tests.desk.visitor import Visitor

from kiks.export.film import FPS

pytestmark = pytest.mark.slow


def pictures(file: Path) -> list[np.ndarray]:
    with av.open(str(file)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def open_dialog(visitor: Visitor) -> None:
    visitor.tab("arena")
    visitor.at("film").click()


def pass_time(visitor: Visitor, seconds: int) -> None:
    """Let whole seconds pass in the paused world."""
    visitor.choose("step-size", "1 s")
    for _ in range(seconds):
        end_ns = visitor.sim.now_ns + 1_000_000_000
        visitor.at("step").click()
        visitor.until(lambda end_ns=end_ns: visitor.sim.now_ns == end_ns)


def test_a_part_of_the_run_is_filmed_and_downloaded(visitor: Visitor, tmp_path: Path) -> None:
    visitor.pause()
    with visitor.sim.record(tmp_path / "run.mcap"):
        begin_s = visitor.sim.time_s
        pass_time(visitor, 12)
        open_dialog(visitor)
        expect(visitor.at("film-make")).to_be_visible()
        start_s, end_s = (float(visitor.at(f"film-{name}").input_value()) for name in ("start", "end"))
        assert end_s == pytest.approx(visitor.sim.time_s, abs=0.01)
        assert start_s == pytest.approx(end_s - 10.0, abs=0.01)
        assert start_s > begin_s
        visitor.at("film-end").fill(f"{start_s + 1:g}")
        visitor.at("film-speed").fill("2")
        visitor.choose("film-follow", "robot 2, in the middle")
        visitor.picture("film_dialog")
        with visitor.page.expect_download() as download:
            visitor.at("film-make").click()
        download.value.save_as(tmp_path / download.value.suggested_filename)
        seen = pictures(tmp_path / "kiks-film.mp4")
        assert len(seen) == pytest.approx(1 / 2 * FPS + 1, abs=1)
        expect(visitor.at("film-make")).to_be_enabled()


@at_length
def test_mistakes_are_told(visitor: Visitor, tmp_path: Path) -> None:
    visitor.pause()
    with visitor.sim.record(tmp_path / "run.mcap"):
        pass_time(visitor, 2)
        open_dialog(visitor)
        expect(visitor.at("film-make")).to_be_visible()
        end_s = visitor.at("film-end").input_value()
        for name, value, words in (
            ("end", "0", "a film must end after it begins"),
            ("end", "", "A film needs a beginning, an end and a speed"),
            ("start", "1e6", "start_s must be from"),
            ("speed", "0", "speed must be from 0.001 to 1000"),
            ("speed", "0.001", "A film must be at most 300 s long"),
        ):
            before = visitor.at(f"film-{name}").input_value()
            visitor.at(f"film-{name}").fill(value)
            visitor.at("film-make").click()
            visitor.told(words)
            visitor.at(f"film-{name}").fill(before)
        assert visitor.at("film-end").input_value() == end_s


@at_length
def test_a_closed_dialog_gives_the_film_up(visitor: Visitor, tmp_path: Path) -> None:
    visitor.pause()
    with visitor.sim.record(tmp_path / "run.mcap"):
        pass_time(visitor, 6)
        open_dialog(visitor)
        visitor.at("film-start").fill(f"{float(visitor.at('film-end').input_value()) - 5:g}")
        visitor.at("film-speed").fill("0.02")
        visitor.at("film-make").click()
        expect(visitor.at("film-make")).to_be_disabled()
        visitor.at("film-close").click()
        visitor.told("The dialog was closed; the film was discarded.")


@at_length
def test_the_past_is_filmed_without_a_recording_of_ones_own(visitor: Visitor, tmp_path: Path) -> None:
    visitor.pause()
    pass_time(visitor, 5)
    visitor.at("back-long").click()
    visitor.until(lambda: visitor.desk.past is not None)
    begin_s, now_s = visitor.desk.looking.span.begin_ns / 1e9, visitor.desk.present.sim.time_s
    open_dialog(visitor)
    expect(visitor.at("film-make")).to_be_visible()
    start_s, end_s = (float(visitor.at(f"film-{name}").input_value()) for name in ("start", "end"))
    assert start_s == pytest.approx(begin_s, abs=0.01)
    assert end_s == pytest.approx(now_s, abs=0.01)
    visitor.at("film-start").fill(f"{end_s - 2:g}")
    with visitor.page.expect_download() as download:
        visitor.at("film-make").click()
    download.value.save_as(tmp_path / "film.mp4")
    assert len(pictures(tmp_path / "film.mp4")) == pytest.approx(2 * FPS + 1, abs=1)

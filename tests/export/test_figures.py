"""Figures of recordings show what was recorded."""

import io
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from kiks import Arena, Khepera, ParameterError, Recording, Simulation
from kiks.export.figures import NO_ROBOT, ROWS, draw_figure, draw_panels, save_figures
from kiks.export.findings import gather_findings
from kiks.recording.analysis import odometry
from kiks.recording.recorder import RunRecorder


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    file = tmp_path_factory.mktemp("recording") / "run.mcap"
    sim = Simulation(Arena.box(300, 260), seed=3, thinking="fixed:4")
    robot = Khepera(sim.port(1))
    with sim.record(file):
        while sim.time_s < 8.0:
            values = robot.proximity()
            robot.set_speed(9 - values[3] // 40, 9 - values[2] // 60)
    return Recording(file)


def test_odometry_follows_a_robot_that_touches_nothing() -> None:
    sim = Simulation(Arena.box(900, 900), seed=1)
    robot, body = Khepera(sim.port(1)), sim.spec.body
    sim.place(1, 450, 450, 0.3)
    pulses, poses = [robot.encoders()], [sim.pose(1)]
    for left, right in ((6, 9), (9, 4), (-5, 5), (3, 12)):
        robot.set_speed(left, right)
        for _ in range(20):
            sim.run(0.1)
            poses.append(sim.pose(1))
            pulses.append(tuple(sim.world.state.robots["pulse_count"][0, 0].tolist()))
    guess = odometry(np.array(pulses), np.array(poses[0]), body.pulse_mm, body.wheel_base_mm)
    # Counts are latched every 10 ms, and whole.
    np.testing.assert_allclose(guess[:, :2], np.array(poses)[:, :2], atol=4.0)
    assert abs(guess[-1, 2] - poses[-1][2]) < 0.05


def test_the_shares_of_time_are_those_of_the_line(recording: Recording) -> None:
    (shares,) = gather_findings(recording).shares
    assert shares.window_ns == recording.log.end_ns - recording.log.begin_ns
    characters = sum(len(data) for data in recording.table("wire")["data"].tolist())
    assert shares.link_ns == pytest.approx(characters * 11e9 / 9600, rel=0.01)
    # A program thinks after each reply that it has read.
    exchanges = len(recording.table("wire")) / 2
    assert shares.thinking_ns == pytest.approx(exchanges * 4e6, rel=0.03)


def test_a_run_is_plotted_while_it_is_recorded(tmp_path: Path) -> None:
    sim = Simulation(Arena.box(300, 260), seed=3)
    with pytest.raises(ParameterError, match="must be recorded while it is plotted"):
        sim.plot()
    with sim.record(tmp_path / "run.mcap"):
        Khepera(sim.port(1)).set_speed(5, 4)
        sim.run(1.5)
        lines = sim.plot().axes[0].lines
    x_mm, y_mm = lines[0].get_data()
    assert (x_mm[-1], y_mm[-1]) == pytest.approx(sim.pose(1)[:2], abs=0.5)  # within the last tick
    again = Recording(tmp_path / "run.mcap").plot().axes[0].lines[0]
    np.testing.assert_array_equal(again.get_xdata(), x_mm)


def test_panels_are_the_rows_of_the_figure(recording: Recording) -> None:
    panels = draw_panels(recording)
    assert list(panels) == list(ROWS)
    for name, legend in (("paths", "odometry"), ("readings", "7"), ("speeds", "asked for"), ("time", "thinking")):
        assert legend in panels[name].decode(), name
    assert panels == draw_panels(recording)
    with pytest.raises(ParameterError, match="robot must be a whole number from 1 to 1"):
        draw_panels(recording, robot=2)
    # A notebook shows them together.
    data, sizes = recording._repr_mimebundle_()  # type: ignore[attr-defined]
    with Image.open(io.BytesIO(b64decode(data["image/png"]))) as picture:
        assert picture.width > sizes["image/png"]["width"] > 400


def test_a_dollar_in_a_name_is_a_dollar(tmp_path: Path) -> None:
    sim = Simulation(Arena.box(300, 260), seed=3)
    with RunRecorder(sim, tmp_path / "run.mcap", programs={"1-cash$_$.py": ""}):
        sim.run(0.1)
    figure = Recording(tmp_path / "run.mcap").plot()
    assert figure.axes[0].get_title().startswith("cash$_$.py in box, seed 3")
    # It is drawn where the figure is shown, after all settings for drawing it.
    figure.savefig(tmp_path / "figure.png")
    save_figures([Recording(tmp_path / "run.mcap")], tmp_path / "figure.svg")


def test_a_run_without_a_robot_has_the_arena_and_says_so(recording: Recording, tmp_path: Path) -> None:
    sim = Simulation(Arena.box(300, 260), robots=0)
    with sim.record(tmp_path / "none.mcap"):
        sim.run(1.0)
    none = Recording(tmp_path / "none.mcap")
    assert list(draw_panels(none)) == ["paths"]
    figure = draw_figure([none, recording])
    said = [[text.get_text() for text in axes.texts if text.get_text()] for axes in figure.axes[: 2 * len(ROWS) : 2]]
    assert said == [[]] + [[NO_ROBOT]] * (len(ROWS) - 1)
    save_figures([none], tmp_path / "none.png")


def test_a_figure_has_a_column_for_each_recording(recording: Recording) -> None:
    figure = draw_figure([recording, recording])
    titles = [axes.get_title() for axes in figure.axes if axes.get_title()]
    assert titles == [f"run.mcap: {recording.title}"] * 2
    paths, places = figure.axes[0], figure.axes[2]
    figure.draw_without_rendering()
    assert paths.get_position().size == pytest.approx(places.get_position().size)
    np.testing.assert_array_equal(paths.lines[0].get_xdata(), recording.table("poses")["x_mm"])
    readings = figure.axes[4].lines
    assert len(readings) == 8
    np.testing.assert_array_equal(readings[2].get_ydata(), recording.table("readings")["counts"][:, 2])

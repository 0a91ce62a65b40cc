"""The accuracy card says what its page says, and holds what the sensors promise."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
import typer
from tests.at_length import AT_LENGTH, at_length
from tools.accuracy import accuracy
from tools.sensors import card as cards
from tools.sensors import models, train_networks
from tools.sensors.card import FOUND, HALVES, TOLD, Score, data_folder, half_distances_mm, load_tables, make_card, page
from typer.testing import CliRunner

from kiks import ParameterError, RobotSpec
from kiks.cli.fit import fit, parse_file
from kiks.fit.robot_fit import active_pairs, fit_robot
from kiks.fit.samples import RIG_OFFSET_DEG, Samples

pytestmark = pytest.mark.slow

PAGE = Path(__file__).parents[2] / "docs" / "explanation" / "accuracy.md"
NUMBER = re.compile(r"[+-]?\d+(?:\.\d+)?")
TOLERANCE = 1.0  # counts or mm: what rounding and another processor's last bits may change


@pytest.fixture(scope="module")
def card():
    """The card, in `make test` without what is learnt from one object about the other, which takes half of the time."""
    try:
        folder = data_folder()
    except ParameterError as error:
        pytest.skip(str(error))
    with pytest.MonkeyPatch.context() as patch:
        if not AT_LENGTH:
            nothing = dict.fromkeys(("wall", "cylinder"), Score.of(np.zeros(1)))
            patch.setattr(cards, "_unseen", lambda tables: dict.fromkeys((FOUND, TOLD), nothing))
        return make_card(load_tables(folder))


@at_length
def test_the_page_tells_the_truth(card):
    written, found = PAGE.read_text(encoding="utf-8"), page(card)
    advice = "run python tools/accuracy.py --page docs/explanation/accuracy.md"
    assert NUMBER.sub("#", written) == NUMBER.sub("#", found), advice
    for old, new in zip(NUMBER.findall(written), NUMBER.findall(found), strict=True):
        assert float(new) == pytest.approx(float(old), abs=TOLERANCE), advice


@at_length
def test_the_floor_and_the_competitors_stand_where_others_measured_them(card):
    floor, enki, thesis = card.score("floor"), card.score("enki", poses=TOLD), card.score("thesis")
    assert (floor.median, floor.mean) == pytest.approx((30, 34), abs=1)
    assert (enki.median, enki.mean) == pytest.approx((149, 209), abs=5)
    assert card.score("webots", poses=TOLD).median > 150
    assert card.score("fast").median > thesis.median
    assert thesis.median <= 39
    assert thesis.mean <= 46
    assert thesis.p95 <= 112
    measured_mm = {name: card.half_distances_mm(name, poses=TOLD) for name in card.tables}
    assert measured_mm["wall"].mean() == pytest.approx(24.0, abs=0.2)  # README of the samples
    assert measured_mm["cylinder"].mean() == pytest.approx(19.3, abs=0.2)


def test_the_default_is_true_to_the_real_robot(card):
    score = card.score("default")
    assert score.median <= 37
    assert score.mean <= 44
    assert score.p95 <= 110
    for poses in (FOUND, TOLD):
        default, thesis = card.score("default", poses=poses), card.score("thesis", poses=poses)
        assert default.median < thesis.median
        assert default.mean < thesis.mean
    for competitor in ("webots", "enki"):
        assert card.score(competitor).median >= 3.5 * score.median
        assert card.score(competitor).mean >= 3.5 * score.mean
    for name in card.tables:
        assert np.abs(card.half_distances_mm(name, "default") - card.half_distances_mm(name)).max() <= 1.0


@at_length
def test_the_robot_of_the_file_is_the_one_that_is_found(card):
    """The constants of the robot's file are a minimum of the fit, or as good as one."""
    learn = [table.at_angles(HALVES["even"]) for table in card.tables.values()]
    base = RobotSpec.load("khepera")
    found = fit_robot(learn, base)
    moved = [rig.moved(table) for rig, table in zip(found.rigs, learn, strict=True)]
    best, kept = (np.abs(np.subtract(*active_pairs(spec, moved))).mean() for spec in (found.spec, base))
    assert kept == pytest.approx(best, abs=1.5)
    assert np.subtract(found.spec.proximity.direction_deg, base.proximity.direction_deg) == pytest.approx(0, abs=3)


@at_length
def test_what_is_learnt_from_one_object_helps_with_the_other(card):
    for name in card.tables:
        for poses, largest in ((FOUND, 55), (TOLD, 75)):
            score = card.unseen[poses][name]
            assert score.median <= largest
            for competitor in ("webots", "enki"):
                assert score.median < 0.6 * card.score(competitor, [name], poses=poses).median


def test_every_figure_has_a_name_of_its_own(card):
    figures = {figure.name: figure for figure in card.figures()}
    assert len(figures) == len(list(card.figures()))
    assert figures["accuracy.default_median_counts"].value == round(card.score("default").median, 2)
    assert all(math.isfinite(figure.value) for figure in figures.values())


def run(command, *arguments):
    app = typer.Typer()
    app.command()(command)
    return CliRunner(env={"COLUMNS": "100"}).invoke(app, list(arguments))


@pytest.fixture
def made_card(card, monkeypatch):
    """Give the command the card that is made already: making one takes 10 s."""
    monkeypatch.setattr(cards, "make_card", lambda tables: card)


@at_length
@pytest.mark.usefixtures("made_card")
def test_the_command_prints_json_and_draws(tmp_path):
    result = run(accuracy, "--json", "--plots", str(tmp_path / "card"))
    lines = [json.loads(line) for line in result.stdout.splitlines()]
    values = {line["name"]: line["value"] for line in lines if line["unit"] == "counts"}
    for name in ("default_median", "default_mean", "thesis_median", "enki_median", "webots_median"):
        assert values[f"accuracy.{name}_counts"] > 0
    assert {file.name for file in (tmp_path / "card").iterdir()} >= {"errors-thesis.png", "curves-wall.png"}


@pytest.mark.usefixtures("made_card")
def test_the_command_prints_a_table(tmp_path):
    result = run(accuracy, "--page", str(tmp_path / "page.md"))
    assert "thesis networks" in result.stdout
    assert (tmp_path / "page.md").read_text().startswith("# How true")


def test_no_data_is_said(tmp_path, monkeypatch):
    with pytest.raises(ParameterError, match="must lie in the data folder"):
        data_folder(tmp_path)
    monkeypatch.setenv("KIKS_SHARED", str(tmp_path))
    with pytest.raises(ParameterError, match="KIKS_SHARED"):
        data_folder()
    folder = tmp_path / "data" / "khepera-samples"
    folder.mkdir(parents=True)
    (folder / "wall.npz").touch()
    assert data_folder() == folder


def made_up():
    gaps, angles = np.arange(5.0, 45.0, 6.0), np.tile(np.arange(0.0, 360.0, 20.0), (7, 1))
    wall = Samples("wall", math.inf, gaps, angles, np.zeros((*angles.shape, 8), np.int64))
    counts = np.rint(models.thesis(wall)).astype(np.int64)
    return Samples("wall", math.inf, gaps, angles, counts)


def test_fit_reads_files_and_writes_a_robot(tmp_path):
    samples = made_up()
    rows = ["8 18 7 5 6"]
    for distance, block in enumerate(samples.counts):
        rows += [f"TURN {distance}", *(" ".join(map(str, row)) for row in block)]
    (tmp_path / "wall.sam").write_text("\n".join(rows))
    result = run(fit, str(tmp_path / "wall.sam"), "--robot", str(tmp_path / "mine.toml"))
    assert result.exit_code == 0, result.output
    median, mean, maximum = (float(word) for word in re.findall(r"(?:median|mean|maximum) (\d+\.\d)", result.output))
    assert median < mean < maximum
    assert RobotSpec.load(tmp_path / "mine.toml").reflection != RobotSpec.load("khepera").reflection
    assert parse_file("wall.sam") == ("wall.sam", math.inf)
    for entry in ("a.sam=", "a.sam=x", "a.sam=0", "a.sam=nan"):
        with pytest.raises(ParameterError, match="must be a positive number of mm"):
            parse_file(entry)


def test_networks_are_trained_and_written(tmp_path, monkeypatch):
    monkeypatch.setattr(train_networks, "ITERATIONS", 2)
    samples = made_up()
    folder = tmp_path / "samples"
    folder.mkdir()
    for name in ("wall", "cylinder"):
        angles = samples.angle_deg[0] + RIG_OFFSET_DEG
        np.savez(folder / f"{name}.npz", values=samples.counts, gap_mm=samples.gap_mm, object_angle_deg_cw=angles)
    out = tmp_path / "mine.json"
    result = run(accuracy, "--data", str(folder), "--networks", str(out), "--starts", "1")
    assert result.exit_code == 0, result.output
    assert "13 tanh + 7 linear" in result.output
    assert models.thesis(samples, models.NetworkResponse.load(out)).shape == samples.counts.shape


def test_half_distances():
    gap_mm = np.array([5.0, 7.0, 9.0])
    counts = np.zeros((3, 20, 8))
    counts[:, 10:17, 0] = np.array([[1023.0], [1023.0], [0.0]])
    counts[:, :, 1] = 1023.0
    found = half_distances_mm(gap_mm, counts)
    assert found[:3].tolist() == [8.0, 9.0, 5.0]


def test_published_formulas():
    """One wall straight ahead of a sensor that looks at it: the formulas' own values."""
    wall = Samples("wall", math.inf, np.array([0.0]), np.array([[-45.0]]), np.zeros((1, 1, 8), np.int64))
    assert models.webots(wall)[0, 0, 1] == pytest.approx(1023 * (1 - (27.5 - 25.2 * math.cos(math.radians(1))) / 50))
    x = (27.5 - 13 * math.sqrt(2)) / 10
    assert models.enki(wall)[0, 0, 1] == pytest.approx(1200 * 6.19 / (x * x + 1.8 * x + 7))
    far = Samples("wall", math.inf, np.array([200.0]), np.array([[0.0]]), np.zeros((1, 1, 8), np.int64))
    for model in (models.default, models.thesis, models.fast, models.webots, models.enki):
        assert model(far).max() <= 20

"""The scripts of `examples/classics` run as they stand with small settings; the tables say numbers that can be true."""

import inspect
import re
import runpy
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.at_length import cases

import kiks
from kiks.model.arena import Pose

ROOT = Path(__file__).parents[2]
CLASSICS = ROOT / "examples" / "classics"
SCRIPTS = {path.stem: path for path in sorted(CLASSICS.glob("*.py")) if path.stem != "findings"}

SMALL: dict[str, Any] = {"seeds": "1-2", "generations": 2, "population": 6, "starts": 4, "seconds": 5.0}
"""Settings of a script in a test: those that it has."""


@pytest.fixture(autouse=True)
def _in_their_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(CLASSICS)


def of_squares(findings: dict[str, Any]) -> None:
    """Check that the square test finds track and wheels."""
    numbers = {what.split(" found")[0]: each.here for what, each in findings.items()}
    assert numbers["track"] == pytest.approx(54.0, abs=0.15)
    assert numbers["right wheel to left one"] == pytest.approx(1.004, abs=6e-4)
    assert numbers["farther centre after [mm]"] < 0.2 * numbers["farther centre before [mm]"]


def of_vehicles(findings: dict[str, Any]) -> None:
    """Check that vehicles do what Braitenberg says."""
    nearest_mm = {what[:2]: float(each.here.split()[0]) for what, each in findings.items() if "lamp" in what}
    assert nearest_mm["2b"] < 20 < nearest_mm["3a"] < 200 < min(nearest_mm["2a"], nearest_mm["3b"])
    assert findings["k-team: speed in free space [mm/s]"].here == pytest.approx(112, abs=8)


CHECKS = {"umbmark": of_squares, "braitenberg": of_vehicles}


@pytest.mark.parametrize("name", cases([*CHECKS, *sorted(SCRIPTS.keys() - CHECKS)]))
def test_a_script_makes_its_figure_and_its_table(name: str, tmp_path: Path) -> None:
    main, out = runpy.run_path(str(SCRIPTS[name]))["main"], tmp_path / "figure.svg"
    settings = {key: value for key, value in SMALL.items() if key in inspect.signature(main).parameters}
    findings = {each.what: each for each in main(out=out, **settings)}
    assert out.read_text(encoding="utf-8").startswith("<?xml")
    for each in findings.values():
        assert each.what
        assert each.text
        if not isinstance(each.here, str):
            assert np.isfinite(each.here).all(), each.what
    if name in CHECKS:
        CHECKS[name](findings)


def test_the_page_has_the_command_and_the_figure_of_each_script() -> None:
    page = (ROOT / "docs" / "howto" / "classics.md").read_text(encoding="utf-8")
    for name in SCRIPTS:
        assert f"python examples/classics/{name}.py" in page
        (figure,) = re.findall(rf"\(\.\./(images/classics/{name}\.(?:png|svg))\)", page)
        assert (ROOT / "docs" / figure).is_file()


def test_a_script_is_a_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["script", "--seeds", "2-1"])
    with pytest.raises(SystemExit, match="kiks: seeds must be numbers or rising ranges"):
        runpy.run_path(str(SCRIPTS["floreano_mondada_1994"]), run_name="__main__")


def test_a_table_has_a_row_for_each_finding() -> None:
    from findings import AMOUNT, Finding, table_of

    contacts = Finding("contacts", "", [0.0, 0.0, 1.2], within=AMOUNT)
    text = table_of([Finding("speed", "48", [40.0, 42.0, 44.0], 1), contacts, Finding("a word", "", "so")])
    assert [line.split("  ")[0] for line in text.splitlines()] == ["what", "speed", "contacts", "a word"]
    assert "42.0 (37.0 to 47.0, 3 seeds)" in text
    assert "0.40 (0.00 to 2.12, 3 seeds)" in text


MIDDLE = replace(kiks.Arena.box(2000, 2000), starts=(Pose(1000, 1000, 0.0),))
"""A room where a robot meets nothing for a while."""


def test_both_sides_earn_the_same_ahead_and_back() -> None:
    for shuttling in (False, True):
        task = kiks.tasks.floreano_mondada_1994(shuttling=shuttling, seconds=3, arenas=(MIDDLE,), starts="arena")
        candidates = np.zeros((3, task.parameter_count))
        candidates[:, :2] = [[0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]]  # the biases: ahead, back, on the spot
        ahead, back, turning = task.evaluate(candidates, np.array([1, 1, 1]), 1)[:, 0]
        assert ahead == pytest.approx(back, rel=0.05)
        assert ahead > 0.15
        assert turning < 0.4 * ahead


def test_shuttling_earns_only_where_speed_is_counted_without_its_sign() -> None:
    values = {}
    for shuttling in (False, True):
        task = kiks.tasks.floreano_mondada_1994(shuttling=shuttling, arenas=(MIDDLE,), starts="arena")
        back_and_forth = np.zeros((1, task.parameter_count))
        back_and_forth[0, :2] = 1e-3
        back_and_forth[0, [18, 21]] = -3.0  # each wheel turns against its own last speed
        values[shuttling] = float(task.evaluate(back_and_forth, np.array([1]), 1)[0, 0])
    assert values[True] > 0.5
    assert values[False] < 0.1


def test_the_predator_sees_the_prey_in_five_sectors() -> None:
    """With weights from one unit of vision to one wheel alone, that wheel turns where the prey is in its sector."""
    predator = kiks.tasks.floreano_nolfi_1997().controller
    white = [225.0 * (1 - 0.41 * ((k - 7.875) / 7.875) ** 2) for k in range(16)]
    for dark, unit in ((0, 0), (3, 0), (4, 1), (7, 2), (9, 2), (12, 3), (13, 4), (15, 4)):
        greys = [0.55 * grey if k == dark else 0.9 * grey for k, grey in enumerate(white)]
        turning = []
        for tried in range(5):
            parameters, wheels = np.zeros(30), np.zeros(2)
            parameters[2 * (8 + tried)] = 10.0
            predator(np.array([0.0] * 8 + greys), np.zeros(2), parameters, wheels)
            turning.append(wheels[0] > 9.9)
            assert abs(wheels[1]) < 1e-9
        assert turning == [tried == unit for tried in range(5)], dark


def test_a_pursuit_ends_with_the_contact() -> None:
    """A predator drives at a prey that stands: t is when they touch, and both fitnesses follow from it."""
    room = replace(kiks.Arena.box(470, 470), starts=(Pose(120, 235, 0.0), Pose(320, 235, 0.0)))
    task = kiks.tasks.floreano_nolfi_1997(arenas=(room,), starts="arena")
    pair = np.zeros((2, 50))
    pair[0, 26:30] = [10.0, 0.0, 0.0, 10.0]  # the outputs keep themselves: 80 mm/s ahead, once there is a half
    values = task.evaluate(pair, np.array([1, 1]), 1)
    chased, left = ({name: row[k] for k, name in enumerate(task.value_names)} for row in values)
    assert (left["prey_fitness"], left["predator_fitness"]) == (1.0, 0.0)
    assert chased["prey_lasted_steps"] == pytest.approx((200 - 57) / 80 / 0.1, abs=4)
    assert chased["prey_fitness"] == chased["prey_lasted_steps"] / 500
    assert chased["predator_fitness"] == pytest.approx(1.0 - chased["prey_fitness"])
    assert chased["predator_path_mm"] < 160

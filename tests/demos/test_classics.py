"""The scripts of `examples/classics` run as they stand with small settings; the tables say numbers that can be true."""

from __future__ import annotations

import inspect
import re
import runpy
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kiks
from kiks.errors import ParameterError
from kiks.learn.classics import Finding, seeds_in, table_of
from kiks.model.arena import Pose

ROOT = Path(__file__).parents[2]
SCRIPTS = {path.stem: path for path in sorted((ROOT / "examples" / "classics").glob("*.py"))}
PAGE = (ROOT / "docs" / "howto" / "classics.md").read_text(encoding="utf-8")

SMALL: dict[str, Any] = {"seeds": "1-2", "generations": 2, "population": 6}
"""Settings of a script in a test: those that it has."""


def found(name: str, out: Path, **changes: Any) -> dict[str, Finding]:
    """Return what a script finds with small settings, by what it is about."""
    main = runpy.run_path(str(SCRIPTS[name]))["main"]
    own = inspect.signature(main).parameters
    settings = {key: value for key, value in (SMALL | changes).items() if key in own}
    return {each.what: each for each in main(out=out, **settings)}


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_script_makes_its_figure_and_its_table(name: str, tmp_path: Path) -> None:
    findings = found(name, tmp_path / "figure.svg")
    assert (tmp_path / "figure.svg").read_text(encoding="utf-8").startswith("<?xml")
    for each in findings.values():
        assert each.what
        assert each.text
        if not isinstance(each.here, str):
            assert np.isfinite(each.here).all(), each.what


@pytest.mark.parametrize("name", SCRIPTS)
def test_the_page_has_its_command_and_its_figure(name: str) -> None:
    assert f"python examples/classics/{name}.py" in PAGE
    (figure,) = re.findall(rf"\(\.\./(images/classics/{name}\.(?:png|svg))\)", PAGE)
    assert (ROOT / "docs" / figure).is_file()


def test_a_script_is_a_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["script", "--seeds", "2-1"])
    with pytest.raises(SystemExit, match="kiks: seeds must be like 1-10"):
        runpy.run_path(str(SCRIPTS["floreano_mondada_1994"]), run_name="__main__")


# ---- what they share ----


def test_seeds_are_numbers_and_ranges() -> None:
    assert seeds_in("1-3, 7") == [1, 2, 3, 7]
    for wrong in ("", "3-1", "a", "1-", "-1", "0-5000"):
        with pytest.raises(ParameterError, match="seeds must be"):
            seeds_in(wrong)


def test_a_table_has_a_row_for_each_finding() -> None:
    text = table_of([Finding("speed", "48", [40.0, 42.0, 44.0], 1), Finding("a word", "", "so")])
    assert [line.split("  ")[0] for line in text.splitlines()] == ["what", "speed", "a word"]
    assert "42.0 (37.0 to 47.0, 3 seeds)" in text


# ---- Floreano and Mondada 1994 ----


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
        back_and_forth[0, 0] = 1e-3
        back_and_forth[0, 1] = 1e-3
        back_and_forth[0, 18] = back_and_forth[0, 21] = -3.0  # each wheel turns against its own last speed
        values[shuttling] = float(task.evaluate(back_and_forth, np.array([1]), 1)[0, 0])
    assert values[True] > 0.5
    assert values[False] < 0.1

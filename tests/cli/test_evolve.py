"""`kiks evolve`, and what champions do in `kiks run`, `kiks demo` and `kiks drive`."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from kiks.cli import app
from kiks.errors import KiksError

pytest.importorskip("cma")
pytest.importorskip("pyarrow")
pytest.importorskip("matplotlib")

TASK = """
import kiks
task = kiks.tasks.avoid(seconds=1.0, worlds=3)
"""


def kiks(*words: object) -> Result:
    result = CliRunner().invoke(app, [str(word) for word in words])
    if isinstance(result.exception, KiksError):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "quick.py").write_text(TASK)
    kiks("evolve", tmp_path / "quick.py", "--seed", 1, "--population", 8, "--generations", 3, "--out", tmp_path / "out")
    return tmp_path / "out"


@pytest.mark.slow
def test_a_run_leaves_its_files_and_goes_on(folder: Path) -> None:
    names = {path.name for path in folder.iterdir()}
    assert {"champion.toml", "log.parquet", "fitness.png", "generations", "evolution.json"} <= names
    task = folder.parent / "quick.py"
    said = kiks("evolve", task, "--seed", 1, "--population", 8, "--generations", 4, "--out", folder).output
    assert "Continuing after generation 3" in said
    assert re.search(r"\nExam: (not )?solved, \d+ of 20 starts \(got around", said)
    with pytest.raises(KiksError, match="must hold the same evolution, but its seed is 1, not 2"):
        kiks("evolve", task, "--seed", 2, "--population", 8, "--generations", 4, "--out", folder)


@pytest.mark.slow
def test_champions_run_and_are_shown(folder: Path, tmp_path: Path) -> None:
    champion = folder / "champion.toml"
    after = kiks("run", champion, "--seconds", 2, "--seed", 5).output
    assert "34 loops" in after
    assert after == kiks("run", "--seconds", 2, "--seed", 5, champion).output
    said = kiks("demo", champion, "--seconds", 2, "--picture", tmp_path / "shown.png").output
    assert "contacts" in said
    assert "the same on every computer" in said
    assert (tmp_path / "shown.png").exists()
    assert "17 loops" in kiks("drive", champion, "--port", "kiks://1", "--seconds", 1).output


@pytest.mark.slow
def test_the_tasks_are_listed() -> None:
    assert "touch nothing" in kiks("evolve", "--list").output


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("evolve", "avoyd"), "Did you mean 'avoid'"),
        (("demo", "folow"), "Did you mean 'follow'"),
        (("run", "nowhere.toml"), "Champion's file 'nowhere.toml' must exist"),
        (("drive", "nowhere.toml", "--port", "kiks://1"), "Champion's file 'nowhere.toml' must exist"),
    ],
)
def test_wrong_words_are_named(words: tuple[str, ...], said: str) -> None:
    with pytest.raises(KiksError, match=said):
        kiks(*words)

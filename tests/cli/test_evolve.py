"""`kiks evolve`, and what champions do in `kiks run`, `kiks demo` and `kiks drive`."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.at_length import at_length
from typer.testing import CliRunner, Result

from kiks import Recording
from kiks.cli import app
from kiks.errors import KiksError

pytestmark = pytest.mark.slow

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


def test_a_run_leaves_its_files_and_goes_on(folder: Path) -> None:
    names = {path.name for path in folder.iterdir()}
    assert {"champion.toml", "log.parquet", "fitness.png", "generations", "evolution.json"} <= names
    task = folder.parent / "quick.py"
    words = ("evolve", task, "--seed", 1, "--population", 8, "--generations", 4, "--out", folder)
    said = kiks(*words, "--record", folder / "run.mcap").output
    assert "Continuing after generation 3" in said
    recording = Recording(folder / "run.mcap")
    assert recording.duration_s == pytest.approx(180.0, abs=0.1)
    assert recording.programs == {"1-champion.toml": (folder / "champion.toml").read_text()}
    with pytest.raises(KiksError, match="--record must be left out with --seeds"):
        kiks(*words, "--seeds", 2, "--record", folder / "run.mcap")
    assert re.search(r"\nFinals: [23] candidates in [12] rounds\n", said)
    assert re.search(r"\nExam: (not )?solved, \d+ of 20 starts \(got around", said)
    assert re.search(r"\nWith ten imperfect robots: \d+ of 200 starts\n", said)
    again = kiks(*words).output
    assert "Finals" not in again
    assert again.splitlines()[-5:] == said.splitlines()[-6:-1]
    with pytest.raises(KiksError, match="must have the same seed, but they have 1 and 2"):
        kiks("evolve", task, "--seed", 2, "--population", 8, "--generations", 4, "--out", folder)


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


def test_the_tasks_are_listed() -> None:
    listed = kiks("evolve", "--list").output
    assert "touch nothing" in listed
    assert "predator and prey" in listed


@at_length
def test_two_sides_evolve_and_are_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from kiks.learn.ready_tasks import TASKS, pursuit

    monkeypatch.setitem(TASKS, "pursuit", lambda *given: pursuit(*given, seconds=2.0))
    folder = tmp_path / "out"
    words = ("evolve", "pursuit", "--seed", 1, "--population", 4, "--out", folder, "--generations")
    said = kiks(*words, 2).output
    assert re.search(r"\nGeneration 1: predator [01]\.\d\d   prey [01]\.\d\d   (the \w+ won|a tie)\n", said)
    assert re.search(r"\nBest against all generations: predator of generation [12] \(.*\), prey of generation", said)
    names = {path.name for path in folder.iterdir()}
    pictures = {"fitness.png", "tournament.png", "tournament.parquet", "result.json"}
    assert names == pictures | {"predator.toml", "prey.toml", "log.parquet", "generations", "evolution.json"}
    assert "Continuing after generation 2" in kiks(*words, 3).output
    shown = kiks("demo", folder, "--seconds", 3, "--picture", tmp_path / "shown.png").output
    assert re.search("predator and prey (have not touched|touched after)", shown)
    assert (tmp_path / "shown.png").exists()
    with pytest.raises(KiksError, match="--record must be left out with pursuit, which has two sides"):
        kiks("evolve", "pursuit", "--record", tmp_path / "run.mcap")
    with pytest.raises(KiksError, match=r"champion.toml' must exist"):
        kiks("demo", tmp_path)


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


@at_length
def test_champions_are_shown_in_their_world(folder: Path, tmp_path: Path) -> None:
    from kiks import Champion

    champion, picture = folder / "champion.toml", tmp_path / "shown.png"
    said = kiks("demo", champion, "--seconds", 1, "--picture", picture).output
    assert f"Seed {2**40}, state" in said
    assert "names no world" not in said
    text = champion.read_text()
    champion.write_text(text.replace('world = "champion_world.kiks"\n', ""))
    assert Champion.load(champion).world is None
    for command in (("demo", champion, "--picture", picture), ("run", champion)):
        assert "names no world, so it drives in the default box" in kiks(*command, "--seconds", 1).output
        assert "names no world" not in kiks(*command, "--seconds", 1, "--arena", "examples/arenas/maze.toml").output


@at_length
def test_a_folder_is_its_champion_or_one_of_a_generation(folder: Path, tmp_path: Path) -> None:
    picture, task = tmp_path / "shown.png", folder.parent / "quick.py"
    said = [
        kiks("demo", shown, "--seconds", 2, "--picture", picture).output.partition("Picture")[2]
        for shown in (folder, folder / "champion.toml")
    ]
    assert said[0] == said[1]
    words = ("demo", folder, "--generation", 2, "--picture", picture)
    once = kiks(*words, "--rank", 3, "--world", 1, "--task", task).output
    assert re.search(r"Candidate \d of generation 2: rank 3, fitness \d", once)
    assert "1.0 s" in once
    for more, message in (
        ((), "quick.py' is a Python file. Give it: --task FILE"),
        (("--task", task, "--rank", 9), "rank must be a whole number from 1 to 8"),
        (("--task", task, "--seed", 1), "--seed must be left out with --generation"),
    ):
        with pytest.raises(KiksError, match=message):
            kiks(*words, *more)
    with pytest.raises(KiksError, match="--rank must be left out without --generation"):
        kiks("demo", folder, "--rank", 2)
    with pytest.raises(KiksError, match="--generation must come with the folder of an evolution"):
        kiks("demo", "avoid", "--generation", 2)
    with pytest.raises(KiksError, match=r"champion.toml' must exist"):
        kiks("demo", tmp_path)


@at_length
def test_seeds_evolve_one_after_another_and_are_compared(folder: Path, tmp_path: Path) -> None:
    task, out = folder.parent / "quick.py", tmp_path / "two"
    words = ("evolve", task, "--population", 8, "--generations", 3, "--seed", 1, "--out", out)
    said = kiks(*words, "--seeds", 2).output
    assert {path.name for path in out.iterdir()} == {"seed-1", "seed-2", "seeds.png", "summary.json"}
    assert (out / "seed-1/champion.toml").read_bytes() == (folder / "champion.toml").read_bytes()
    assert re.search(r"\n 1 +-?\d\.\d{4} +\d +\d+ of 20 +\d+ of 200 +44 ", said)
    assert re.search(r"\n all +-?\d\.\d{4} +\d of 2 +44 ", said)
    again = kiks(*words, "--seeds", 3).output
    assert "Continuing after generation 3" in again
    assert (out / "seed-3/result.json").exists()
    compared = kiks("compare", out, folder, "--picture", tmp_path / "compared.png").output
    assert re.search(r"Fitness: U = [\d.]+, p = [\d.]+, A = \d\.\d\d \(\w+\)", compared)
    assert re.search(r"Exam: U = ", compared)
    assert (tmp_path / "compared.png").exists()


def test_folders_that_cannot_be_compared_are_errors(tmp_path: Path) -> None:
    with pytest.raises(KiksError, match="SECOND must be another folder than FIRST"):
        kiks("compare", tmp_path, tmp_path)
    with pytest.raises(KiksError, match="must be a folder of `kiks evolve`, but it holds no evolution"):
        kiks("compare", tmp_path, tmp_path / "other")

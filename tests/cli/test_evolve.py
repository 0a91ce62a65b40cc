"""`kiks evolve`, and what champions do in `kiks run`."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from tests import forked
from tests.at_length import at_length
from tests.cli.test_cli import kiks

from kiks import Recording
from kiks.errors import KiksError

pytestmark = pytest.mark.slow

TASK = """
import kiks
task = kiks.tasks.avoid(seconds=1.0, worlds=4)
"""


def ran(*words: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    return forked.run(*map(str, words), cwd=cwd)


@pytest.fixture(scope="module")
def evolved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("evolved")
    (place / "quick.py").write_text(TASK)
    words = ("--seed", 1, "--population", 8, "--generations", 3, "--out", place / "out")
    said = kiks("evolve", place / "quick.py", *words, "--quiet").output
    assert said.startswith("Champion of generation"), "no line of the progress"
    return place


@pytest.fixture
def folder(evolved: Path, tmp_path: Path) -> Path:
    """A copy of an evolution, for a test to change."""
    return Path(shutil.copytree(evolved, tmp_path / "evolved")) / "out"


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
    after = ran("run", champion, "--seconds", "2", "--seed", "5", "--robots", "2", "--export", "out.png", cwd=tmp_path)
    assert after.returncode == 0, after.stderr
    assert "kiks: robot 2: 0." in after.stderr
    assert "2.000 s simulated, seed 5" in after.stderr
    assert (tmp_path / "out.png").exists()
    before = ran("run", "--seconds", "2", "--seed", "5", "--robots", "2", champion, cwd=tmp_path)
    assert after.stderr == before.stderr


@pytest.fixture
def _short_pursuit(monkeypatch: pytest.MonkeyPatch) -> None:
    from kiks.learn.ready_tasks import TASKS, pursuit

    monkeypatch.setitem(TASKS, "pursuit", lambda *given: pursuit(*given, seconds=2.0))


@at_length
@pytest.mark.usefixtures("_short_pursuit")
def test_two_sides_evolve_and_are_shown(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    words = ("evolve", "pursuit", "--seed", 1, "--population", 4, "--out", folder, "--generations")
    said = kiks(*words, 2).output
    assert re.search(r"\nGeneration 1: predator [01]\.\d\d   prey [01]\.\d\d   (the \w+ won|a tie)\n", said)
    assert re.search(r"\nBest against all generations: predator of generation [12] \(.*\), prey of generation", said)
    names = {path.name for path in folder.iterdir()}
    pictures = {"fitness.png", "tournament.png", "tournament.parquet", "result.json"}
    assert names == pictures | {"predator.toml", "prey.toml", "log.parquet", "generations", "evolution.json"}
    assert "Continuing after generation 2" in kiks(*words, 3).output
    shown = ran("run", folder, "--seconds", "3", cwd=tmp_path)
    assert re.search(r"kiks: (the run has ended after 3 s|the supervisor has ended the run at)", shown.stderr)
    with pytest.raises(KiksError, match="--record must be left out with pursuit, which has two sides"):
        kiks("evolve", "pursuit", "--record", tmp_path / "run.mcap")


@at_length
@pytest.mark.usefixtures("_short_pursuit")
def test_two_sides_are_compared_by_how_they_do_against_strangers(tmp_path: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    words = ("evolve", "pursuit", "--generations", 2, "--plots", "svg", "--seeds", 2, "--out")
    said = kiks(*words, one, "--population", 4).output
    for side in ("predator", "prey"):
        assert f"\n{side}, against all champions of the other side of its own evolution:\n" in said
    assert {"fitness.svg", "tournament.svg"} <= {path.name for path in (one / "seed-1").iterdir()}
    assert (one / "seeds.svg").exists()
    kiks(*words, other, "--population", 6)
    compare = ("compare", one, other, "--picture", tmp_path / "compared.png")
    compared = kiks(*compare, "--json").stdout
    found = json.loads(compared[compared.index("{") :])
    assert list(found["differences"]) == ["predator", "prey"]
    assert [len(each) for each in found["meetings"]["prey"].values()] == [2, 2]
    told = "Compared: each champion against those of the other 3 evolutions, 8 times each."
    assert told in kiks(*compare).output


def test_a_log_for_tensorboard_needs_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("tensorboard", "tensorboard.summary"):
        monkeypatch.setitem(sys.modules, name, None)
    (tmp_path / "quick.py").write_text(TASK)
    with pytest.raises(KiksError, match=r"--tensorboard must have TensorBoard, .* pip install tensorboard\."):
        kiks("evolve", tmp_path / "quick.py", "--tensorboard", "--generations", 1, "--out", tmp_path / "out")


@at_length
def test_champions_are_shown_in_their_world(folder: Path, tmp_path: Path) -> None:
    from kiks import Champion

    champion = folder / "champion.toml"
    said = ran("run", champion, "--seconds", "1", cwd=tmp_path).stderr
    assert f"seed {2**40}, state" in said
    assert "names no world" not in said
    folder_said = ran("run", folder, "--seconds", "1", cwd=tmp_path).stderr
    assert folder_said == said
    text = champion.read_text()
    champion.write_text(text.replace('world = "champion_world.kiks"\n', ""))
    assert Champion.load(champion).world is None
    words = ("run", champion, "--seconds", "1")
    assert "names no world, so it drives in the default box" in ran(*words, cwd=tmp_path).stderr
    arena = Path("examples/arenas/maze.toml").absolute()
    assert "names no world" not in ran(*words, "--arena", arena, cwd=tmp_path).stderr


@at_length
def test_any_candidate_becomes_a_champion(folder: Path, tmp_path: Path) -> None:
    task, out = folder.parent / "quick.py", tmp_path / "third.toml"
    words = ("champion", folder, out, "--force", "--generation", 2)
    once = kiks(*words, "--rank", 3, "--world", 1, "--task", task).output
    assert re.search(r"Candidate \d of generation 2: rank 3, fitness \d", once)
    assert "1.000 s simulated" in ran("run", out, cwd=tmp_path).stderr
    elite = kiks("champion", folder, tmp_path / "elite.toml", "--at", "300,0.5").output
    assert "The elite nearest to 300,0.5: path_mm" in elite
    for more, message in (
        ((), "quick.py' is a Python file. Give it: --task FILE"),
        (("--task", task, "--rank", 9), "rank must be a whole number from 1 to 8"),
        (("--at", "1,2"), "either --at or --generation must be given"),
    ):
        with pytest.raises(KiksError, match=message):
            kiks(*words, *more)
    with pytest.raises(KiksError, match="--rank must be left out with --at"):
        kiks("champion", folder, out, "--force", "--at", "1,2", "--rank", 2)


@at_length
def test_seeds_evolve_one_after_another_and_are_compared(folder: Path, tmp_path: Path) -> None:
    task, out = folder.parent / "quick.py", tmp_path / "two"
    words = ("evolve", task, "--population", 8, "--generations", 3, "--seed", 1, "--out", out)
    said = kiks(*words, "--seeds", 2).output
    assert {path.name for path in out.iterdir()} == {"seed-1", "seed-2", "seeds.png", "summary.json"}
    assert (out / "seed-1/champion.toml").read_bytes() == (folder / "champion.toml").read_bytes()
    assert re.search(r"\n 1 +-?\d\.\d{4} +\d +\d+ of 20 +\d+ of 200 +44 ", said)
    assert re.search(r"\n all +-?\d\.\d{4} +\d of 2 +44 ", said)
    assert re.search(r"\nall: at 95 %, median \S+ to \S+ \(bootstrap\), exams passed \d+ to \d+ % \(Wilson\)\n", said)
    again = kiks(*words, "--seeds", 3).output
    assert "Continuing after generation 3" in again
    assert (out / "seed-3/result.json").exists()
    compared = kiks("compare", out, folder, out / "seed-2", "--picture", tmp_path / "compared.pdf").output
    assert re.search(
        r"\nFitness, p corrected for 3 pairs by Holm's method:\n  all Kruskal-Wallis .*: H = [\d.]+,", compared
    )
    assert re.search(r"\n  \S+two - \S+out   Mann-Whitney \(.*\): p = [\d.]+, A = \d\.\d\d \(\w+\)\n", compared)
    assert re.search(r"\nShare of the exam's starts solved, p corrected", compared)
    assert re.search(r"\nEvaluations until .*:\n  \S+ - \S+   log-rank \(normal approximation\): p = 1\n", compared)
    assert (tmp_path / "compared.pdf").read_bytes().startswith(b"%PDF")


def test_the_tasks_are_listed_and_folders_that_cannot_be_compared_are_errors(tmp_path: Path) -> None:
    listed = kiks("evolve", "--list").output
    assert "touch nothing" in listed
    assert "a predator and a prey" in listed
    for folders in ((tmp_path, tmp_path), (tmp_path,)):
        with pytest.raises(KiksError, match="FOLDERS must be two or more, all different, but they were"):
            kiks("compare", *folders)
    with pytest.raises(KiksError, match="must be a folder of `kiks evolve`, but it holds no evolution"):
        kiks("compare", tmp_path, tmp_path / "other")

"""What notebooks, terminals and plain Python show: of the desk, and of simulations, arenas and results of a batch."""

import io
import json
import subprocess
import sys
from base64 import b64decode
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.at_length import cases
from tests.guard import GUARD_S

import kiks
from kiks.batch.number_table import FIRST
from kiks.batch.rollouts import Rollouts
from kiks.learn.exam import ExamResult

pytestmark = pytest.mark.slow

NOTEBOOKS = Path(__file__).parents[1] / "examples" / "notebooks"

Run = Callable[[str], list[dict[str, Any]]]


@pytest.fixture(scope="module")
def run() -> Iterator[Run]:
    """Run cells in the kernel of a notebook; return what each shows, by types."""
    from jupyter_client.manager import start_new_kernel

    kernel, cells = start_new_kernel(startup_timeout=GUARD_S)

    def run(cell: str) -> list[dict[str, Any]]:
        shown: list[dict[str, Any]] = []

        def note(message: dict[str, Any]) -> None:
            content = message["content"]
            assert message["msg_type"] != "error", "\n".join(content["traceback"])
            if message["msg_type"] in ("display_data", "execute_result"):
                shown.append(content["data"])
            elif message["msg_type"] == "stream":
                shown.append({content["name"]: content["text"]})

        cells.execute_interactive(cell, timeout=GUARD_S, output_hook=note)
        return shown

    run("import kiks, numpy; from kiks.batch.rollouts import Rollouts; sim = kiks.Simulation(robots=2)")
    run("rollouts = Rollouts(numpy.ones((2, 1, 1)), numpy.ones(2, numpy.int64), ('path_mm',))")
    yield run
    cells.stop_channels()
    kernel.shutdown_kernel(now=True)


def test_a_notebook_shows_the_desk_once_below_the_cell_and_again_in_a_later_one(run: Run) -> None:
    for cell in ("sim.show()", "shown = sim.show()\nshown", "for _ in range(1):\n    sim.show()", "shown = sim.show()"):
        (seen,) = run(f"sim = kiks.Simulation(robots=2)\n{cell}")
        assert seen["text/html"].startswith('<iframe src="http://127.0.0.1:'), cell
        assert seen["text/plain"].startswith("<KiKS desk at http://127.0.0.1:")
    assert run("shown") == run("display(shown)") == [seen]
    assert run("shown.close()") == []
    (seen,) = run("sim = kiks.Simulation()\nsim.show(browser=False)")
    assert seen["stdout"].startswith("The desk: http://127.0.0.1:"), "a notebook that wants no page has the address"


@pytest.mark.parametrize(
    ("cell", "kind", "text"),
    [
        ("kiks.Simulation(robots=2)", "image/png", "<Simulation: 2 robots in 'default' at 0.000 s, seed 0>"),
        ("kiks.Arena.box(400, 300)", "image/png", "<Arena 'box': 400 x 300 mm>"),
        ("rollouts", "text/html", "<Rollouts: 2 worlds of 1 robot, path_mm>"),
        ("kiks.Simulation().explain(1, 2)", "text/html", "<Explanation: sensor 2 (left 10) of robot 1 reads 0>"),
        (
            "sim = kiks.Simulation()\nwith sim.record('FILE'):\n    sim.run(0.5)\nkiks.Recording('FILE').plot()",
            "image/png",
            "<Figure size",
        ),
    ],
)
def test_a_notebook_shows_a_picture_or_a_table(run: Run, cell: str, kind: str, text: str, tmp_path: Path) -> None:
    (seen,) = run(cell.replace("FILE", str(tmp_path / "run.mcap")))
    assert seen["text/plain"].startswith(text)
    assert text.startswith("<Figure") or seen["text/plain"] == text
    assert seen[kind].startswith(("<table>", "<p>Sensor 2")) or b64decode(seen[kind]).startswith(b"\x89PNG")


@pytest.mark.parametrize(
    "words", cases([["-c"], ["-m", "IPython", "--colors=NoColor", "-c"]]), ids=["Python", "IPython"]
)
def test_a_terminal_has_the_address_once(words: list[str]) -> None:
    script = "import kiks; sim = kiks.Simulation(); sim.show(browser=False)"
    said = subprocess.run([sys.executable, *words, script], capture_output=True, text=True, timeout=GUARD_S, check=True)
    (line,) = [line for line in said.stdout.splitlines() if "http" in line]
    assert line.startswith("The desk: http://127.0.0.1:")


@pytest.mark.parametrize("name", cases(["sensors", "evolution", "first_steps", "learning", "recording"]))
def test_a_notebook_of_the_examples_runs_and_shows_pictures(name: str, tmp_path: Path) -> None:
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(NOTEBOOKS / f"{name}.ipynb", 4)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    settings: dict[str, Any] = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(notebook, kernel_name="python3", timeout=int(GUARD_S), resources=settings).execute()
    pictures = [output for cell in cells for output in cell.outputs if "image/png" in output.get("data", {})]
    assert len(pictures) > 1


def test_outputs_of_notebooks_are_not_committed() -> None:
    """They are large, and the site makes them."""
    notebooks = {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in NOTEBOOKS.glob("*.ipynb")}
    assert notebooks.keys() == {"sensors", "evolution", "first_steps", "learning", "recording"}, "run in the test above"
    assert not any(cell.get("outputs") for notebook in notebooks.values() for cell in notebook["cells"])


def picture_of(thing: Any) -> tuple[bytes, dict[str, int]]:
    """Return the picture that a notebook gets, and at which size it shows it."""
    data, sizes = thing._repr_mimebundle_()
    return b64decode(data["image/png"]), sizes["image/png"]


def size_of(thing: Any) -> tuple[tuple[int, int], dict[str, int]]:
    """Return of a picture for notebooks how many pixels it has, and at which size it is shown."""
    from PIL import Image

    png, shown = picture_of(thing)
    return Image.open(io.BytesIO(png)).size, shown


def test_pictures_are_sharp_and_several_arenas_stand_side_by_side() -> None:
    arena = kiks.Arena.box(300, 200)
    for thing in (arena, kiks.Simulation(arena)):
        (width, height), shown = size_of(thing)
        assert (width, height // 2, shown["width"]) == (600, shown["height"], 300)
        assert height > 400  # with a caption
    arenas = [arena, kiks.Arena.box(200, 300)]
    assert size_of(kiks.Batch(arenas, 4)) == ((480 + 24 + 320, 480), {"width": 412, "height": 240})


def test_the_picture_of_an_arena_is_that_of_a_simulation_that_begins_there() -> None:
    from PIL import Image, ImageChops

    arena = kiks.Arena.load("pillars")
    assert len(arena.bodies) == 2
    first, second = (Image.open(io.BytesIO(picture_of(thing)[0])) for thing in (arena, kiks.Simulation(arena)))
    assert ImageChops.difference(first, second).getbbox()[1] > 1200 * arena.height_mm / arena.width_mm  # the caption


def test_looking_at_a_picture_changes_nothing() -> None:
    looked_at, alone = (kiks.Simulation(kiks.Arena.box(300, 200), seed=3) for _ in range(2))
    for sim in (looked_at, alone):
        sim.port(1).write(b"D,5,5\n")
        sim.run(0.123)
    picture_of(looked_at)
    for sim in (looked_at, alone):
        sim.run(0.5)
    assert looked_at.state_hash() == alone.state_hash()


def test_an_evolution_shows_what_it_has_found() -> None:
    evolution: Any = kiks.Evolution(kiks.tasks.avoid(seconds=1, worlds=4), "map-elites", seed=1, population=8)
    archive: Any = evolution.archive
    assert evolution._repr_mimebundle_() == archive._repr_mimebundle_() == ({}, {})
    evolution.run(generations=2)
    for thing in (evolution, archive):
        (width, height), _ = size_of(thing)
        assert width > height > 300
    champion: Any = evolution.champion
    assert "<tr><td>task</td><td>avoid</td></tr>" in champion._repr_mimebundle_()[0]["text/html"]
    assert size_of(evolution.task)[1]["height"] == 240


def test_results_say_what_they_are_and_that_of_an_exam_is_a_table_of_its_starts() -> None:
    result: Any = ExamResult(np.array([True, False]), np.array([[31.0], [2.5]]), ("path_mm",), "drives")
    assert repr(result) == "<Exam: not solved, 1 of 2 starts (drives)>"
    assert "<th>start</th><th>solved</th><th>path_mm</th>" in result._repr_mimebundle_()[0]["text/html"]
    arena = kiks.Arena.load("pillars")
    assert repr(arena) == "<Arena 'Pillars': 600 x 600 mm, 1 start, 1 ball, 1 cylinder>"
    batch = kiks.Batch(arena, 3)
    assert repr(batch) == "<Batch: 3 worlds of 1 robot in 1 arena>"
    controller, measures = kiks.controllers.linear(), [kiks.measures.path_mm, kiks.measures.contacts]
    came = batch.run(controller, np.zeros(controller.parameter_count), seconds=1, measures=measures)
    assert repr(came) == "<Rollouts: 3 worlds of 1 robot, path_mm, contacts>"


def rollouts(worlds: int, robots: int = 1) -> Rollouts:
    values = np.arange(worlds * robots * 2, dtype=np.float64).reshape(worlds, robots, 2) / (1.0, 7.0)
    return Rollouts(values, np.arange(worlds), ("contacts", "<path>"))


def test_a_long_table_shows_the_first_and_sums_up_all_and_a_short_one_shows_all_robots() -> None:
    shown = rollouts(1000)
    lines = str(shown).splitlines()
    assert lines[0].split() == ["world", "steps", "contacts", "<path>"]
    assert len(lines) == 1 + FIRST + 1 + 4
    assert lines[FIRST].split()[:3] == [str(FIRST - 1), "9", "18"]
    assert lines[FIRST + 1] == "... 990 more"
    assert lines[-4].split() == ["mean", "499.50", "999.00", "142.86"]
    assert lines[-1].split() == ["max", "999", "1998", "285.57"]
    html = shown._repr_mimebundle_()[0]["text/html"]  # type: ignore[attr-defined]
    assert html.count("<tr>") == len(lines)
    assert "&lt;path&gt;" in html
    assert "<path>" not in html
    lines = str(rollouts(2, robots=3)).splitlines()
    assert lines[0].split()[:2] == ["world", "robot"]
    assert [line.split()[:2] for line in lines[1:7]] == [[str(k // 3), str(k % 3)] for k in range(6)]
    assert lines[7].split()[0] == "mean"


def test_numbers_that_are_none_are_shown_so_and_without_measures_there_are_still_steps() -> None:
    values = np.array([[[np.nan, 1e12]], [[np.inf, -1e-9]]])
    lines = str(Rollouts(values, np.ones(2, np.int64), ("a", "b"))).splitlines()
    assert [line.split()[2] for line in lines[1:]] == ["nan", "inf", "nan", "nan", "nan", "nan"]
    assert lines[1].split()[3] == "1.000e+12"
    nothing = Rollouts(np.zeros((2, 1, 0)), np.array([3, 4]), ())
    assert repr(nothing) == "<Rollouts: 2 worlds of 1 robot, no measures>"
    assert [line.split() for line in str(nothing).splitlines()[:3]] == [["world", "steps"], ["0", "3"], ["1", "4"]]

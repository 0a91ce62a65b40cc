"""What IPython shows of KiKS: the desk below a cell, pictures of worlds, tables of results."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import IPython
import numpy as np
import pytest
from IPython.core.interactiveshell import InteractiveShell
from IPython.utils.capture import capture_output
from PIL import Image

import kiks


class Notebook(InteractiveShell):
    """A shell that says it is that of a notebook."""

    kernel = True


@pytest.fixture
def shell() -> Iterator[InteractiveShell]:
    InteractiveShell.clear_instance()
    yield InteractiveShell.instance(history_load_length=0)
    InteractiveShell.clear_instance()


@pytest.fixture
def notebook() -> Iterator[InteractiveShell]:
    InteractiveShell.clear_instance()
    shell = Notebook.instance(history_load_length=0)
    assert IPython.get_ipython() is shell
    yield shell
    Notebook.clear_instance()


def run(shell: InteractiveShell, cell: str) -> tuple[str, list[dict[str, Any]]]:
    """Run a cell; return what it printed, and all that it displayed."""
    with capture_output() as captured:
        assert shell.run_cell(cell, store_history=True).success
    return captured.stdout, [output.data for output in captured.outputs]


WORLD = "import kiks; sim = kiks.Simulation(kiks.Arena.box(300, 200))"


@pytest.mark.parametrize("cell", ["shown = sim.show(port=0)", "sim.show(port=0)"])
def test_desk_is_shown_once_below_the_cell(cell: str, notebook: InteractiveShell) -> None:
    run(notebook, WORLD)
    _, displayed = run(notebook, cell)
    assert sum("<iframe" in data.get("text/html", "") for data in displayed) == 1
    _, again = run(notebook, "shown" if cell.startswith("shown") else "_")
    assert sum("<iframe" in data.get("text/html", "") for data in again) == 1


@pytest.mark.parametrize("cell", ["shown = sim.show(port=0)", "sim.show(port=0)"])
def test_terminal_says_once_where_the_desk_is(cell: str, shell: InteractiveShell) -> None:
    run(shell, WORLD)
    said, displayed = run(shell, cell)
    assert said.count("http://") == 1
    assert not displayed


def test_plain_python_says_where_the_desk_is(capsys: pytest.CaptureFixture[str]) -> None:
    shown = kiks.Simulation(kiks.Arena.box(300, 200)).show(port=0, browser=False)
    assert capsys.readouterr().out == f"The desk: {shown.url}\n"
    shown.close()


def test_worlds_are_shown_as_pictures() -> None:
    arena = kiks.Arena.box(300, 200)
    sim = kiks.Simulation(arena, seed=3)
    pictures = [np.asarray(Image.open(io.BytesIO(each._repr_png_()))) for each in (arena, sim)]
    assert pictures[0].shape == pictures[1].shape == (400, 600, 3)
    # The robot stands in one of them alone.
    assert 0.02 < np.mean(pictures[0] != pictures[1]) < 0.2
    assert repr(sim) == "<KiKS simulation: 1 robots, 0.000 s, seed 3>"


def test_results_are_shown_as_a_table() -> None:
    @kiks.controller()
    def stay(sensors, memory, parameters, wheels):  # type: ignore[no-untyped-def]
        wheels[:] = 0

    batch = kiks.Batch(kiks.Arena.box(300, 200), worlds=12, seed=1)
    rollouts = batch.run(stay, seconds=1, measures=[kiks.measures.path_mm, kiks.measures.contacts])
    table = rollouts._repr_html_()
    assert table.startswith("<table><tr><th>world</th><th>robot</th><th>steps</th><th>path_mm</th><th>contacts</th>")
    assert table.count("<tr>") == 11
    assert table.endswith("<p>and 2 more of 12 worlds with 1 robots each</p>")
    assert repr(rollouts) == "<KiKS rollouts: 12 worlds, 1 robots each, measures: path_mm, contacts>"

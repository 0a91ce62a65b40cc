"""What a page is given to judge a recording by."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from kiks import Arena, Recording, Simulation
from kiks.cli.record import recorded
from kiks.export.page_contents import judged
from kiks.model.goal import Goal


def test_a_page_gets_the_goal_and_the_measures_of_the_engine(tmp_path: Path) -> None:
    sim, goal = Simulation(Arena.box(300, 300)), Goal("Far", solved="path_mm > 5")
    with recorded(sim, tmp_path / "run.mcap", goal=goal):
        sim.run(0.1)
    found = judged(Recording(tmp_path / "run.mcap"))
    assert found["goal"] == goal.as_lists()
    assert found["goal"]["terms"] == [["is_solved", [], "is_solved", 0], ["path_mm", [], "path_mm", 0]]
    assert {"path_mm", "light_mm", "avoidance"} <= {*found["measures"]["names"]}


@pytest.mark.parametrize(
    "about",
    [
        {},
        *(
            {"goal": text}
            for text in ("{", "[1]", '{"solved": "import"}', '{"x": 1}', '{"points": "1e999 * is_solved"}')
        ),
    ],
)
def test_a_recording_without_a_goal_has_none(about: dict[str, str]) -> None:
    assert judged(SimpleNamespace(about=about))["goal"] is None

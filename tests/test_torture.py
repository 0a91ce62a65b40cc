"""The torture campaigns: a few cases of each with fixed seeds; and they notice faults that are planted."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from tests.at_length import at_length
from tests.matlab.octave import needs_octave
from tests.stranger import needs_root

pytestmark = pytest.mark.slow

TOOL = Path(__file__).parents[1] / "tools" / "torture.py"


def torture(*words: str) -> tuple[int, dict[str, float], str]:
    """Return exit code, figures and table of a campaign."""
    done = subprocess.run([sys.executable, str(TOOL), "--json", *words], capture_output=True, text=True, check=False)
    figures: dict[str, Any] = json.loads(done.stdout) if done.stdout else {}
    return done.returncode, figures, done.stderr


def test_what_is_planted_is_found_with_its_cause_and_ends_no_other_case_and_can_be_played_alone() -> None:
    code, figures, table = torture("--only", "planted")
    assert code == 1
    for figure, count in {"deaths": 4, "hangs": 3, "files_lost": 3, "foreign_exceptions": 4 + 3 + 2}.items():
        assert figures[f"torture.{figure}"] == count, table
    for words in (
        "4 x foreign: ZeroDivisionError",
        "SIGABRT; first --only planted.dies",
        "3 x foreign: MemoryError",
        "message: secret, ParameterError",
        "campaigns/planted.py, _hangs: computes longer than 0.5 s",
    ):
        assert words in table
    tried = {name.rpartition(".")[2]: count for name, count in figures.items() if ".tried." in name}
    assert tried == {"raises": 12, "dies": 12, "eats": 12, "tells": 12, "loses": 12, "refuses": 12, "hangs": 3}, table
    code, _, table = torture("--only", "planted.raises", "--case", "1")
    assert code == 1
    assert "ZeroDivisionError: planted" in table


@pytest.mark.parametrize(
    "words",
    [
        "planted.refuses",
        "files --only calls --cases 3 --seed 12",
        *(
            pytest.param(words, marks=at_length)
            for words in (
                *("wire --cases 2 --seed 11", "compiled --cases 4 --seed 17", "names --cases 4 --seed 17"),
                *("files --only calls --cases 400 --seed 19", "messages --cases 3 --seed 12"),
                "faults.kill_writer --only faults.fill_disk --only faults.no_descriptors --cases 4 --seed 13",
                *(f"faults.kill_{scene} --cases 1 --seed 14" for scene in ("server", "desk")),
                *(f"crowd.{group} --cases 1 --seed 15" for group in ("serve", "session")),
            )
        ),
        pytest.param("users --cases 1 --seed 18", marks=[at_length, needs_root]),
        *(
            pytest.param(f"octave.{kind} --cases 1 --seed 16", marks=[at_length, needs_octave])
            for kind in ("joined_window", "start")
        ),
    ],
)
def test_a_few_cases_break_no_promise(words: str) -> None:
    code, _, table = torture("--only", *words.split())
    assert code == 0, table

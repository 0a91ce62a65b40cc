"""The blocks of the tutorials run one after the other in an empty folder, and print what the pages show."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from tests import forked
from tests.at_length import cases
from tests.matlab.octave import needs_octave

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]
TUTORIALS = ROOT / "docs" / "tutorials"
OCTAVE = ("timeout", "-s", "KILL", "120", "octave-cli", "--no-gui", "-q", "--eval")


def run_python(code: str, folder: Path) -> str:
    result = forked.run(code=code, cwd=folder, env={"MPLBACKEND": "agg"})
    assert result.returncode == 0, result.stderr
    return result.stdout


def run_commands(code: str, folder: Path) -> str:
    printed = ""
    for line in code.splitlines():
        words = shlex.split(line, comments=True)
        # The desk waits for a person.
        if words[0] == "kiks" and "desk" not in words and "--desk" not in words:
            result = forked.run(*words[1:], cwd=folder)
            assert result.returncode == 0, f"{line}: {result.stderr}"
            printed += result.stdout + result.stderr
    return printed


def run_octave(code: str, folder: Path) -> str:
    start = forked.run("matlab").stdout
    environment = {"PATH": f"{Path(sys.executable).parent}:/usr/bin:/bin", "HOME": str(Path.home())}
    result = subprocess.run([*OCTAVE, start + code], cwd=folder, env=environment, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return result.stdout


RUN: dict[str, Callable[[str, Path], str]] = {"python": run_python, "sh": run_commands, "octave": run_octave}


def check(page: str, folder: Path) -> None:
    """Run the blocks of a page; in what a page shows, ... stands for any text."""
    text, printed = (TUTORIALS / page).read_text(encoding="utf-8"), ""
    for language, code in re.findall(r"^```(\w+)\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL):
        if language in RUN:
            printed = RUN[language](code, folder)
            continue
        for line in code.splitlines():
            pattern = re.escape(line).replace(r"\.\.\.", ".*")
            assert re.search(f"^{pattern}$", printed, flags=re.MULTILINE), f"{page}: {line!r} is not in {printed!r}"


QUICK = ["first_program.md", "old_program.md", "figures.md", "learning.md"]
OTHERS = sorted({page.name for page in TUTORIALS.glob("*.md")} - {*QUICK, "octave.md"})


@pytest.mark.parametrize("page", cases([*QUICK, *OTHERS], len(QUICK)))
def test_tutorials_run_and_print_what_they_show(page: str, tmp_path: Path) -> None:
    check(page, tmp_path)


@needs_octave
def test_the_tutorial_of_octave_runs_and_prints_what_it_shows(tmp_path: Path) -> None:
    check("octave.md", tmp_path)

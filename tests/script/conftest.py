"""Programs, given as their text, that run in this process in simulated time."""

import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from kiks import Arena, Simulation
from kiks.script.runner import run_here

BOX = Arena.box(200, 200)


class Ran(NamedTuple):
    """How a program has ended, when, with which state of the world, and what it has printed."""

    code: int
    time_s: float
    state: str
    out: str
    err: str


Run = Callable[..., Ran]


def programs_of(text: str) -> dict[str, tuple[str, str]]:
    """Return programs by their names, which follow "===", each with what it must print, which follows ">"."""
    programs = {}
    for each in text.split("\n=== ")[1:]:
        name, *lines = each.rstrip("\n").splitlines()
        said = [line[2:] for line in lines if line[:1] == ">"]
        programs[name] = "\n".join(line for line in lines if line[:1] != ">"), "".join(f"{line}\n" for line in said)
    return programs


@pytest.fixture
def run(tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Run:
    """Return what runs the text of a program as `program.py` in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def run(text: str, *arguments: str, robots: int = 1, thinking: str = "none") -> Ran:
        program = tmp_path / "program.py"
        program.write_text(textwrap.dedent(text))
        sim = Simulation(BOX, robots=robots, seed=7, thinking=thinking)
        capfd.readouterr()
        code = run_here(sim, program, list(arguments), {})
        return Ran(code, sim.time_s, sim.state_hash(), *capfd.readouterr())

    return run

"""Supervisors: programs that act in a world from outside."""

import sys
from pathlib import Path

import pytest
from tests import forked

from kiks import ParameterError, Simulation
from kiks.sim.supervision import Supervision

TICKS = """
def supervise(sim):
    ball = sim.add_ball(100, 100)
    try:
        for number in range(3):
            yield 0.5
            sim.move_body(ball, 110 + 10 * number, 100)
    finally:
        print("moved", number + 1, "times at", sim.time_s)
"""

FAILED = r"able to begin, but referee\.py has failed"


def supervised(tmp_path: Path, text: str) -> tuple[Simulation, Supervision]:
    file = tmp_path / "referee.py"
    file.write_text(text)
    sim = Simulation()
    return sim, Supervision(sim, file)


def test_it_prepares_the_world_acts_at_its_times_and_returns(tmp_path, capsys: pytest.CaptureFixture[str]) -> None:
    sim, supervision = supervised(tmp_path, TICKS)
    ended = []
    supervision.end = lambda code, message: ended.append((code, message))
    assert sim.bodies()["x_mm"].tolist() == [100.0]
    sim.run(1.2)
    assert sim.bodies()["x_mm"].tolist() == [120.0]
    sim.run(1.0)
    assert ended == [(0, "the supervisor has ended the run at 1.500 s of simulated time.")]
    assert capsys.readouterr().out == "moved 3 times at 1.5\n"
    sim, supervision = supervised(tmp_path, TICKS)
    sim.run(0.7)
    supervision.close()  # wherever it waits
    assert capsys.readouterr().out == "moved 2 times at 0.7\n"
    sim.run(1.0)
    assert sim.bodies()["x_mm"].tolist() == [110.0]


def test_what_cannot_begin_as_a_supervisor_is_an_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for text, message in (
        ("x = 1", r"must define a function supervise\(sim\) that yields"),
        ("def supervise(sim):\n    return 1", r"must define a function supervise\(sim\) that yields"),
        ("def supervise(sim):\n    yield 0", "the time that a supervisor yields must be from 0.001"),
        ("def supervise(sim):\n    yield 'soon'", "the time that a supervisor yields must be a number"),
        ("def supervise(sim:\n", FAILED),
        ("import nothing_of_this_name\n", FAILED),
        ("def supervise(sim):\n    yield 1 / 0\n", FAILED),
    ):
        with pytest.raises(ParameterError, match=message):
            supervised(tmp_path, text)
        assert ("Traceback" in capsys.readouterr().err) == (message == FAILED)


def test_a_supervisor_that_fails_ends_the_run(tmp_path: Path) -> None:
    (tmp_path / "referee.py").write_text("def supervise(sim):\n    yield 0.5\n    print(1 / 0)\n")
    (tmp_path / "waits.py").write_text("import time\ntime.sleep(5)\n")
    (tmp_path / "game.kiks").write_text(
        'kiks = 1\nsupervisor = "referee.py"\n[[robot]]\nprogram = "waits.py"\n[walls]\nsize_mm = [400, 300]\n'
    )
    result = forked.run("run", "game.kiks", cwd=tmp_path)
    assert result.returncode == 1
    assert "kiks: the supervisor referee.py has failed: division by zero" in result.stderr
    assert 'referee.py", line 3' in result.stderr
    both = forked.run("run", "game.kiks", "waits.py", "waits.py", cwd=tmp_path)
    assert "kiks: the supervisor referee.py has failed: division by zero" in both.stderr
    assert "0.500 s simulated" in both.stderr
    (tmp_path / "referee.py").unlink()
    missing = forked.run("run", "game.kiks", cwd=tmp_path)
    assert missing.returncode == 2
    assert "a supervisor must be a Python file, but there is none at" in missing.stderr


def test_it_imports_the_modules_beside_it_and_no_others(tmp_path: Path) -> None:
    acts = "import rules\ndef supervise(sim):\n    while True:\n        yield 0.5\n        import late\n"
    acts += "        sim.set_score('gain', sim.score.get('gain', 0) + rules.GAIN + late.GAIN)\n"
    made = []
    for number in (1, 10):
        folder = tmp_path / str(number)
        folder.mkdir()
        for name, text in {"rules": "import late\nGAIN = 0", "late": f"GAIN = {number}", "referee": acts}.items():
            (folder / f"{name}.py").write_text(text)
        sim = Simulation()
        made.append((sim, Supervision(sim, folder / "referee.py")))
    before = sys.path[:]
    for sim, _ in made:
        sim.run(1.2)
    assert [sim.score["gain"] for sim, _ in made] == [2, 20]
    assert (sys.path, {"rules", "late"} & {*sys.modules}) == (before, set())

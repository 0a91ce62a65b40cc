"""`--record` of the commands, `kiks replay --check` and `kiks export`: runs of foreign programs are made again."""

import csv
import signal
import subprocess
from pathlib import Path

import pytest
import serial
from tests import forked
from tests.at_length import at_length, cases
from tests.cli.test_cli import KIKS, state_of
from tests.served import GUARD_S

from kiks import Recording

AGAIN = "The same run again"

ROUND = """
import serial, sys, time
port = serial.Serial(sys.argv[1], timeout=1)
for step in range(40):
    port.write(b"N\\n")
    values = [int(word) for word in port.readline().split(b",")[1:]]
    port.write(b"D,%d,%d\\n" % (6 - values[3] // 80, 6 - values[2] // 80))
    port.readline()
    if step % 10 == 0:
        print("step", step, end="")
        print(file=sys.stdout)
    time.sleep(0.03)
"""


@pytest.mark.slow
@pytest.mark.parametrize("robots", cases([1, 2]))
def test_programs_are_recorded_with_their_texts(robots: int, tmp_path: Path) -> None:
    (tmp_path / "round.py").write_text(ROUND)
    words = [word for _ in range(robots) for word in ("round.py", "COM1")]
    alone = forked.run("run", "--robots", str(robots), *words, cwd=tmp_path)
    result = forked.run("run", "--robots", str(robots), "--record", "run.mcap", *words, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert state_of(result.stderr) == state_of(alone.stderr)
    recording = Recording(tmp_path / "run.mcap")
    assert list(recording.programs.values()) == [ROUND] * robots
    assert recording.about["command"].startswith("kiks run --robots")
    assert len(recording.table("readings", robots)) == 40
    lines = [row for row in recording.table("events") if row["kind"] == "output"]
    for robot in range(1, robots + 1):
        assert [row["text"] for row in lines if row["robot"] == robot] == ["step 0", "step 10", "step 20", "step 30"]
    assert "step 30" in result.stdout
    if robots == 1:
        # After the readings of its steps.
        steps_s = recording.table("readings")["time_s"][::10]
        assert [float(row["time_s"]) for row in lines] == pytest.approx(steps_s, abs=0.06)
    assert AGAIN in forked.run("replay", "--check", "run.mcap", cwd=tmp_path).stdout
    for file in ("readings.csv", "readings.parquet"):
        told = forked.run("export", "run.mcap", file, "--table", "readings", "--robot", "1", cwd=tmp_path)
        size_kb = (tmp_path / file).stat().st_size / 1000
        assert told.stdout == f"Table: {file}, {size_kb:.0f} kB\n", told.stderr
    told = forked.run("export", "run.mcap", "run.html", "--title", "Exercise 3", "--robot", str(robots), cwd=tmp_path)
    assert told.stdout.startswith("Page: run.html"), told.stderr
    page = (tmp_path / "run.html").read_text()
    assert "<h1>Exercise 3</h1>" in page
    assert "kiks run --robots" in page
    with (tmp_path / "readings.csv").open(newline="") as table:
        rows = list(csv.DictReader(table))
    assert [int(row["counts_7"]) for row in rows] == recording.table("readings", 1)["counts"][:, 7].tolist()


@at_length
def test_a_match_with_a_referee_is_made_again(tmp_path: Path) -> None:
    result = forked.run("demo", "soccer", "--seconds", "20", "--record", "match.mcap", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert AGAIN in forked.run("replay", "match.mcap", "--check", cwd=tmp_path).stdout


@at_length
def test_what_a_killed_server_has_recorded_is_made_again(tmp_path: Path) -> None:
    """A foreign client in real time; the server has no chance to end the file."""
    link, command = tmp_path / "robot", [*KIKS, "serve", "--link", "robot", "--record", "run.mcap", "--tcp", "0"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True) as process:
        while "repeatable" not in (line := process.stdout.readline()).lower():
            assert line
        with serial.Serial(str(link), timeout=GUARD_S) as port:
            for step in range(60):
                port.write(b"D,%d,5\nN\n" % (step % 9))
                assert port.readline() + port.readline()
        process.send_signal(signal.SIGKILL)
    result = forked.run("replay", "run.mcap", "--check", cwd=tmp_path)
    assert AGAIN in result.stdout
    assert "was killed, or goes on" in result.stderr
    sent = Recording(tmp_path / "run.mcap").table("wire")
    assert len(sent[sent["is_sent"]]) > 10

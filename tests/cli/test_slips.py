"""What a newcomer mistypes, and the one line that it gets: `slips.txt`."""

import gc
import logging
import re
import traceback
from pathlib import Path

import pytest
from typer.testing import CliRunner

import kiks
from kiks.cli import app
from kiks.errors import KiksError

TABLE = Path(__file__).with_name("slips.txt")
SLIPS = [line.split("  =>  ") for line in TABLE.read_text().splitlines() if line and not line.startswith("#")]
SUMMARY = re.compile(r"kiks: (robot \d+: .* driven|[0-9.]+ s simulated|nothing was sent)")


def of_command_line(typed: str) -> str:
    """Return what the command says, as `kiks` prints it."""
    import shlex

    result = CliRunner().invoke(app, shlex.split(typed)[1:], prog_name="kiks")
    return str(result.exception) if isinstance(result.exception, KiksError) else result.output.strip()


def of_python(typed: str) -> str:
    """Return the line that ends the traceback, without the kind of the error."""
    try:
        exec(typed.removeprefix(">>> "), {"kiks": kiks})
    except Exception as error:
        return traceback.format_exception_only(error)[-1].partition(": ")[2].strip()
    return "nothing"


def of_file(typed: str) -> str:
    """Return what is said of a file with such content."""
    name, _, content = typed.partition(" | ")
    Path(name).write_text(content.replace("; ", "\n"))
    return of_command_line(f"kiks desk --no-browser {name}" if name.endswith(".kiks") else f"kiks arena info {name}")


def of_wire(typed: str, caplog: pytest.LogCaptureFixture) -> str:
    """Return what is said beside the robot's answer."""
    port = kiks.Simulation(seed=1).port(1)
    port.timeout = 1
    for _ in range(2):  # the hint comes once
        port.write(typed.removeprefix("wire | ").encode().decode("unicode_escape").encode("latin-1"))
        assert port.readline() in (b"", b"Command not found\r\n", b"z,Protocol error\r\n")
    return "\n".join(record.getMessage() for record in caplog.records)


def of_program(typed: str) -> str:
    """Return what `kiks run` says of a program, without the summary of the run."""
    Path("program.py").write_text(typed.removeprefix("program | ").replace("; ", "\n"))
    said = CliRunner().invoke(app, ["run", "program.py"], prog_name="kiks").stderr.splitlines()
    gc.unfreeze()
    return "\n".join(line.removeprefix("kiks: ") for line in said if not SUMMARY.match(line))


def said_of(typed: str, caplog: pytest.LogCaptureFixture) -> str:
    if typed.startswith("wire"):
        return of_wire(typed, caplog)
    kinds = {"kiks ": of_command_line, ">>> ": of_python, "program": of_program}
    return next((said for kind, said in kinds.items() if typed.startswith(kind)), of_file)(typed)


@pytest.mark.parametrize(("typed", "expected"), [slip for slip in SLIPS if len(slip) == 2])
def test_a_slip_gets_one_line_that_leads(
    typed: str, expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("programs").mkdir()
    for name in ("wander.py", "programs/avoid.py", "run.mcap"):
        Path(name).touch()
    Path("room.toml").write_text("size_mm = [300, 300]\n")
    Path("lost.kiks").write_text("kiks = 1\n[walls]\nsize_mm = [300, 300]\n[[robot]]\nprogram = 'wandr.py'\n")
    caplog.set_level(logging.INFO, "kiks")
    said = said_of(typed, caplog).replace(str(tmp_path), "HERE")
    assert re.fullmatch(".*".join(map(re.escape, expected.split("..."))), said), said

"""The commands, as a person calls them."""

import json
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest
import typer
from tests import forked
from tests.at_length import at_length, cases
from typer.testing import CliRunner, Result

from kiks.cli import app
from kiks.errors import KiksError, ParameterError
from kiks.model.program_kinds import A_PROGRAM
from kiks.model.shipped import demonstrations
from kiks.version import PYTHONS

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
ARENA = str(ROOT / "examples" / "arenas" / "office.toml")
WANDER = str(ROOT / "tests" / "programs" / "wander.py")

KIKS = [sys.executable, "-m", "kiks"]
"""The command in a process of its own, from its very start."""


def kiks(*words: object) -> Result:
    """Run the command in this process; an error of KiKS is raised."""
    result = CliRunner().invoke(app, [str(word) for word in words], prog_name="kiks")
    if isinstance(result.exception, KiksError):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result


def state_of(text: str) -> str:
    found = re.search(r"state ([0-9a-f]{16})", text)
    assert found, text
    return found[1]


def named(group: typer.Typer | None) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield the commands of a group with their functions."""
    for command in group.registered_commands if group else ():
        if command.callback is not None:
            yield command.name or command.callback.__name__, command.callback


GROUPS = {"": app} | {f"{each.name} ": each.typer_instance for each in app.registered_groups}


def test_every_command_that_people_call_has_help_with_an_example() -> None:
    names = {f"{prefix}{name}" for prefix, group in GROUPS.items() for name, _ in named(group)}
    assert {"run", "demo", "evolve", "doctor", "arena maze", "arena new", "arena info"} <= names
    people = sorted(names - {"session"})  # which the toolbox of Octave calls
    assert [name for name in people if not re.search(f"Example: .*kiks {name}", kiks(*name.split(), "-h").stdout)] == []


def test_the_command_alone_says_what_to_try_and_demonstrations_are_listed() -> None:
    assert re.findall("^  (kiks .*?)  ", kiks().stdout, flags=re.MULTILINE) == [
        "kiks demo avoid --desk",
        "kiks run my_program.py",
        "kiks examples first",
    ]
    assert kiks("-h").stdout == kiks("--help").stdout
    listed = kiks("demo").stdout
    assert listed == kiks("demo", "--list").stdout
    assert re.findall(r"^  (\w+) +\S", listed, flags=re.MULTILINE) == [*demonstrations()]
    assert all(len(line) > 25 for line in listed.splitlines() if line.startswith("  "))


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("kiks ex", ["examples", "export", "exercise"]),
        ("kiks demo ", [*demonstrations()]),
        ("kiks demo av", ["avoid"]),
        ("kiks demo avoid --des", ["--desk"]),
        ("kiks run av", []),  # a file of the user, which the shell finds
        ("kiks run --arena ma", ["maze"]),
        ("kiks arena info pi", ["pillars", "pitch"]),
        ("kiks run --export README.md --arena of", ["office"]),
    ],
)
def test_a_shell_completes_commands_options_and_names(line: str, expected: list[str]) -> None:
    words = {"_KIKS_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(line.count(" "))}
    said = CliRunner().invoke(app, prog_name="kiks", env=words)
    assert said.output.split() == expected


def test_examples_are_copied_into_a_new_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert "Try: kiks run first/demos/avoid.py" in kiks("examples", "first").stdout
    assert (tmp_path / "first" / "programs" / "wander.py").is_file()
    assert not [*tmp_path.rglob("__pycache__")]
    with pytest.raises(ParameterError, match=r"^OUT must be a new folder, but 'first' exists\. Choose another name\.$"):
        kiks("examples", "first")


def test_arenas_are_listed_and_known_by_name() -> None:
    names = [line.split()[0] for line in kiks("arena", "list").stdout.splitlines()]
    assert names == ["default", "maze", "office", "pillars", "pitch", "track"]
    assert kiks("arena", "info", "office").stdout == kiks("arena", "info", ARENA).stdout
    result = forked.run("arena", "info", "offise")
    message = (
        "An arena must be a file or one of default, maze, office, pillars, pitch, track, but there is no 'offise'."
    )
    assert (result.returncode, result.stderr) == (2, f"kiks: {message} Did you mean 'office'?\n")


@pytest.mark.parametrize(
    ("words", "known"),
    [
        ("arena list --json", lambda found: found[2]["name"] == "office" and found[2]["lamps"] == 2),
        (f"arena info --json {ARENA}", lambda found: found["starts"][0]["khepera_fits"] is True),
        ("demo --json", lambda found: found[0]["about"].startswith("Avoid")),
        ("evolve --json --list", lambda found: "avoid" in {each["name"] for each in found}),
        ("doctor --json", lambda found: found["libraries"]["numpy"] and found["speed"] > 10),
    ],
)
def test_scripts_get_json_alone(words: str, known: Callable[[Any], bool]) -> None:
    assert known(json.loads(kiks(*words.split()).stdout))


def test_scripts_get_json_of_runs() -> None:
    one, two = (json.loads(forked.run("run", "--json", *[WANDER] * count).stdout) for count in (1, 2))
    assert (one["robots"][0]["contacts"], len(one["state"])) == (0, 16)
    assert (len(two["robots"]), two["not_repeatable"]) == (2, None)


def test_the_doctor_says_what_is_there_and_how_fast_it_is() -> None:
    said = kiks("doctor").stdout
    assert re.search(r"^KiKS \S+ in .*\nPython 3\.", said)
    assert re.search("found +extra learn +for evolution", said)
    assert re.search(r"A program drives \d{2,} times as fast as the robot: \d+ % of the reference", said)


@pytest.mark.parametrize("words", [("--help",), ("arena", "info", ARENA), ("schema", "project")])
def test_a_full_disk_behind_the_output_is_one_line(words: tuple[str, ...]) -> None:
    with Path("/dev/full").open("w") as full:
        command = [*forked.kiks_command(), *words]
        result = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert result.returncode == 2
    assert result.stderr.splitlines()[-1] == (
        "kiks: Cannot go on: No space left on device. Is there room for the output?"
    )
    assert "Traceback" not in result.stderr


NEEDS_NO_ENGINE = "heavy = {'numba', 'scipy', 'numpy', 'pydantic', 'PIL', 'rich', 'nicegui'} & set(sys.modules)\n"
NEEDS_NO_ENGINE += "assert not heavy, heavy"


def test_help_and_version_and_the_process_of_a_program_need_no_engine() -> None:
    """A program's world is in another process: it starts five times as fast and takes a quarter of the memory."""
    helps = "sys.argv = ['kiks', '--help']\nimport kiks.cli\ntry: kiks.cli.main()\nexcept SystemExit: pass"
    for start in (helps, "import kiks.script.child_main"):
        script = f"import sys\n{start}\n{NEEDS_NO_ENGINE}"
        subprocess.run([sys.executable, "-c", script], stdout=subprocess.DEVNULL, check=True)
    assert re.fullmatch(r"KiKS \d+\.\d+.*\n", kiks("--version").stdout)


@pytest.mark.parametrize("behaviour", cases(["follow", "avoid"]))
def test_a_demo_is_the_same_in_two_processes(behaviour: str, tmp_path: Path) -> None:
    arguments = ("demo", behaviour, "--seconds", "30", "--arena", ARENA, "--seed", "4")
    first = forked.run(*arguments, "--export", "run.png", cwd=tmp_path)
    assert first.returncode == 0, first.stderr
    assert (tmp_path / "run.png").stat().st_size > 5000
    second = subprocess.run([*KIKS, *arguments], capture_output=True, text=True, cwd=tmp_path, check=True)
    assert state_of(first.stderr) == state_of(second.stderr)
    assert (tmp_path / f"kiks-{behaviour}.png").exists()


def test_a_cold_start_says_at_once_that_it_compiles(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    with subprocess.Popen([*KIKS, "warmup"], stderr=subprocess.PIPE, text=True, env=environment) as process:
        assert "Compiling the engine" in process.stderr.readline()
        assert process.poll() is None
        process.kill()


@at_length
def test_a_warm_start_compiles_nothing() -> None:
    kiks("warmup")
    again = subprocess.run([*KIKS, "warmup"], capture_output=True, text=True, check=True)
    assert "The engine is ready" in again.stdout
    assert "Compiling" not in again.stderr


def test_a_program_runs_unchanged_in_simulated_time_and_is_told_if_it_uses_no_robot(tmp_path: Path) -> None:
    result = forked.run("run", "--seed", "3", WANDER)
    assert result.returncode == 0, result.stderr
    version, counters = result.stdout.splitlines()
    assert version == "b,5.02,5.01"
    advice = "kiks: nothing was sent to a robot, and no time has passed."
    assert advice not in result.stderr
    (tmp_path / "own.py").write_text("import kiks\nkiks.Khepera(kiks.Simulation().port(1)).proximity()\n")
    assert advice in forked.run("run", "own.py", cwd=tmp_path).stderr
    assert re.fullmatch(r"h,-?\d+,-?\d+", counters)
    assert re.search(r"kiks: 2[01]\.\d{3} s simulated, seed 3, state", result.stderr)
    words = ("run", "--seed", "3", "--map", "/dev/ttyUSB0=1", WANDER)
    again = subprocess.run([*KIKS, *words], capture_output=True, text=True, check=True)
    assert (again.stdout, state_of(again.stderr)) == (result.stdout, state_of(result.stderr))
    other = forked.run("run", "--seed", "3", "--thinking", "fixed:20", WANDER)
    assert state_of(other.stderr) != state_of(result.stderr)


def test_turrets_and_kinds_of_robots_from_the_command_line(tmp_path: Path) -> None:
    program = tmp_path / "ask.py"
    program.write_text(
        "import serial\n"
        "for name in 'ab':\n"
        "    port = serial.Serial(name, timeout=1)\n"
        "    port.write(b'B\\nT,1,B\\nT,4,B\\n')\n"
        "    print(*(port.readline().decode().strip() for _ in range(3)))\n"
    )
    options = ("--robot", "khepera", "--robot", "khepera_ii", "--turret", "radio", "--turret", "gripper=2")
    result = forked.run("run", *options, str(program))
    first, second = "b,5.02,5.01 z,Turret order not supported t,4,b,1,0", "b,6.01,6.01 t,1,b,1,0 t,4,b,1,0"
    assert result.stdout == f"{first}\n{second}\n", result.stderr


def test_an_option_behind_a_program_is_the_program_s_and_that_is_said(tmp_path: Path) -> None:
    (tmp_path / "words.py").write_text("import sys\nprint(sys.argv[1:])\n")
    result = forked.run("run", "words.py", "--export", "x.html", cwd=tmp_path)
    assert result.stdout == "['--export', 'x.html']\n"
    assert "kiks: --export goes to words.py, as all words behind a program." in result.stderr
    assert "goes to" not in forked.run("run", "--", "words.py", "--export", "x.html", cwd=tmp_path).stderr
    assert "goes to" not in forked.run("run", "words.py", "--gain", "3", cwd=tmp_path).stderr
    assert not (tmp_path / "x.html").exists()


def test_a_programs_exit_code_and_errors_are_its_own(tmp_path: Path) -> None:
    assert forked.run("run", WANDER, "7").returncode == 7
    program = tmp_path / "wrong.py"
    program.write_text("import serial\nserial.Serial('COM1', timeout=1)\nprint(1 / 0)\n")
    result = subprocess.run([*KIKS, "run", str(program)], capture_output=True, text=True, check=False)
    assert result.returncode == 1
    assert "ZeroDivisionError" in result.stderr
    assert "runpy" not in result.stderr
    assert f'File "{program}", line 3' in result.stderr
    program.write_text("import serial\nserial.Serial('COM1')\nserial.Serial('COM2')\n")
    assert "is one more than there are" in forked.run("run", str(program)).stderr
    assert forked.run("run", "--robots", "2", str(program)).returncode == 0
    program.write_text("import serial\nserial.Serial('COM1').read(1)\n")
    assert "the read would never end" in forked.run("run", str(program)).stderr


def test_live_thinking_is_recorded_and_replayed(tmp_path: Path) -> None:
    times = tmp_path / "times.txt"
    live = forked.run("run", "--thinking", "live", "--save-thinking", str(times), WANDER)
    assert "not repeatable" in live.stderr
    replays = [forked.run("run", "--thinking", f"replay:{times}", WANDER) for _ in range(2)]
    assert replays[0].stdout == replays[1].stdout == live.stdout
    assert state_of(replays[0].stderr) == state_of(replays[1].stderr)


def test_a_mistake_ends_in_one_line_and_exit_code_2(tmp_path: Path) -> None:
    result = forked.run("run", "nowhere.py", cwd=tmp_path)  # more of them stand in slips.txt
    message = f"PROGRAM must be {A_PROGRAM}, but there is no file 'nowhere.py'. Give its path before its own arguments."
    assert (result.returncode, result.stderr) == (2, f"kiks: {message}\n")


NO_RESULTS = """
    run.program desk.folder champion.folder compare.folders info.file replay.file export.files serve.link
    session.listen examples.out check.exercise check.solution grade.exercise grade.submissions grade.students grade.out
    tournament.players tournament.out room.exercise room.students room.folder
"""
"""Paths that are read, and those that are written when a command begins."""

RESULTS = {
    ("run", "save_thinking"): f"run --save-thinking PLACE {WANDER}",
    ("run", "export"): f"run --export PLACE {WANDER}",
    ("run", "record"): f"run --record PLACE {WANDER}",
    ("champion", "out"): "champion runs PLACE --at 1,2",
    **{(name, "record"): f"{name} --record PLACE" for name in ("serve", "desk", "host", "evolve")},
    ("export", "out"): "export run.mcap PLACE",
    ("fit", "robot"): "fit wall.sam --robot PLACE",
    ("calibrate", "out"): "calibrate --port kiks://1 --out PLACE",
    ("monitor", "csv"): "monitor --port kiks://1 --csv PLACE",
    ("compare", "picture"): "compare one two --picture PLACE",
    ("evolve", "out"): "evolve --out PLACE",
    **{("sweep", name): f"sweep --{name} PLACE {WANDER}" for name in ("out", "picture")},
    **{(name, "out"): f"arena {name} PLACE" for name in ("maze", "room")},
    ("new", "out"): "arena new --width-mm 200 --height-mm 200 PLACE",
}
"""Paths that are written, and how a command is asked to."""


def test_every_path_is_known_as_a_result_or_not() -> None:
    paths = {
        (callback.__name__, name)
        for group in GROUPS.values()
        for _, callback in named(group)
        for name, kind in get_type_hints(callback).items()
        if Path in (kind, *get_args(kind))
    }
    assert paths == {tuple(pair.split(".")) for pair in NO_RESULTS.split()} | set(RESULTS)


@pytest.mark.parametrize("line", RESULTS.values())
def test_a_result_s_place_is_checked_before_the_run(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def begin() -> None:
        raise AssertionError("the run has begun")

    for name in ("run", "calibrate", "monitor", "evolve", "engine_start"):
        for word in ("ready_engine", "ready_batch"):
            monkeypatch.setattr(sys.modules[f"kiks.cli.{name}"], word, begin, raising=False)
    for place in ("/proc/none/x.png", "/dev/null/x.png"):
        with pytest.raises(ParameterError, match=r"must go to a (file|folder) that can be written"):
            kiks(*line.replace("PLACE", place).split())


@pytest.mark.parametrize("version", ["3.10", "3.16"])
def test_a_python_that_is_not_known_gets_one_line(version: str) -> None:
    changed = f"import sys; sys.version_info = (*map(int, {version!r}.split('.')), 0, 'final', 0); import kiks"
    done = subprocess.run([sys.executable, "-c", changed], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == (f"kiks: Python must be 3.11 to 3.15, but this is {version}. Install KiKS for another one.\n")


def test_the_package_names_the_same_pythons_as_kiks() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    (_, oldest), (_, newest) = PYTHONS
    assert project["requires-python"] == f">=3.{oldest},<3.{newest + 1}"
    tried = [each.rpartition(" ")[2] for each in project["classifiers"] if " :: Python :: 3." in each]
    readme = (ROOT / "README.md").read_text()
    assert f"CPython {', '.join(tried[:-1])} or {tried[-1]}" in readme

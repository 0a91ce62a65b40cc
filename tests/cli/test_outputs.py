"""No command writes over what it reads or over a file of another kind, and none ignores an option."""

import re
import sys
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import typer
from tests.cli.test_cli import RESULTS, WANDER

from kiks.cli import app
from kiks.cli.outputs import _RESULTS, _alone
from kiks.errors import ParameterError
from kiks.model.arena import Arena
from kiks.model.arena_file import save_arena
from kiks.model.replaceable import MADE_BY

MCAP = b"\x89MCAP0\r\n\x01" + bytes(8)
LIKE = {
    "thinking times": b"12345\n678\n",
    "recording": MCAP + b"\x04\0\0\0kiks\x0a\0\0\0kiks 3.0.0",
    ".mcap": MCAP + b"\0\0\0\0\x0a\0\0\0kiks 3.0.0",
    ".csv": b"time_s,robot,x_mm\n",
    ".html": b'<!DOCTYPE html>\n<html>\n<meta name="generator" content="KiKS 3.0.0">',
}
"""How files begin that KiKS has written, of the kinds without a mark."""

PRECIOUS = {
    "": b"12345\n678 not a number\n",
    ".mcap": LIKE["recording"],
    ".csv": b"time_s,proximity_0_counts\n",
    ".html": b"<!DOCTYPE html>\n<p>KiKS</p>",
    ".pdf": b"%PDF-1.4 a thesis",
    ".png": b"\x89PNG a drawing",
    ".svg": b"<svg ",
}
"""How files begin that end as those of KiKS, and that nothing can make again."""


@cache
def group() -> Any:
    return typer.main.get_command(app)


def told(*words: object) -> dict[str, Any]:
    """Return what a command would begin with."""
    command = group()
    names = list(map(str, words))
    while hasattr(command, "commands"):
        command = command.commands[names.pop(0)]
    found: dict[str, Any] = command.make_context(command.name, names).params
    return found


def outputs() -> Iterator[tuple[tuple[str, str], str, str]]:
    """Yield all outputs of all commands, with each of their endings, and the kind of such a file."""
    commands = {**group().commands, **group().commands["arena"].commands}
    del commands["demo"]  # another name of run
    for name, command in commands.items():
        for param, (endings, _, _, kind, is_new) in getattr(command, "_outputs", ()):
            for ending in () if is_new else endings or ("",):
                yield (name, str(param.name)), ending, kind or ending


OUTPUTS = list(outputs())


def words_for(output: tuple[str, str], path: Path) -> list[str]:
    return RESULTS[output].replace("PLACE", str(path)).split()


def test_all_outputs_are_known() -> None:
    unchecked = {("monitor", "csv"), ("evolve", "out"), ("sweep", "out")}  # a new file; folders
    assert {output for output, _, _ in OUTPUTS} == set(RESULTS) - unchecked


@pytest.mark.parametrize(("output", "ending", "kind"), OUTPUTS)
def test_only_what_kiks_has_written_of_its_kind_is_replaced_without_force(
    output: tuple[str, str], ending: str, kind: str, tmp_path: Path
) -> None:
    path = tmp_path / f"place{ending}"
    words = words_for(output, path)
    assert told(*words)[output[1]] == path
    path.write_bytes(b"")  # nothing is lost with it
    told(*words)
    if ending != ".toml":
        path.write_bytes(LIKE.get(kind) or bytes(200_000) + MADE_BY.encode())
        told(*words)
    precious = LIKE[".mcap"] if kind == "recording" else PRECIOUS.get(ending, b"precious")
    path.write_bytes(precious)
    with pytest.raises(ParameterError, match=r"must be new.*exists\. Choose another name or add --force"):
        told(*words)
    names = 1 + (words[0] == "arena")
    assert told(*words[:names], "--force", *words[names:])[output[1]] == path
    assert path.read_bytes() == precious


@pytest.mark.parametrize("output", sorted({output for output, ending, _ in OUTPUTS if ending}))
def test_an_output_has_one_of_its_endings_and_is_no_folder(output: tuple[str, str], tmp_path: Path) -> None:
    (tmp_path / "folder.html").mkdir()
    for name, why in (("student.py", "must end in "), ("other", "must end in "), ("folder.html", "it is a folder")):
        with pytest.raises(ParameterError, match=why):
            told(*words_for(output, tmp_path / name))


SAME: dict[str, Callable[[Path, Path], object]] = {
    "itself": lambda path, file: path,
    "another spelling": lambda path, file: path.parent / "folder" / ".." / path.name,
    "a link": lambda path, file: file.symlink_to(path),
    "a hard link": lambda path, file: file.hardlink_to(path),
}


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("export INPUT PLACE", "page.html"),
        ("export --kind figures other.mcap INPUT PLACE", "plot.png"),
        ("run --record PLACE program.py INPUT", "run.mcap"),
        (f"run --thinking replay:INPUT --export PLACE {WANDER}", "thoughts.csv"),
        ("fit INPUT=12.5 --robot PLACE", "post.toml"),
        ("serve --arena INPUT --record PLACE", "arena.mcap"),
        ("calibrate --port kiks://1 --base INPUT --out PLACE", "robot.toml"),
        ("evolve INPUT --record PLACE", "task.mcap"),
    ],
)
def test_no_output_is_an_input(line: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    given = tmp_path / name
    given.touch()
    for number, how in enumerate(SAME.values()):
        file = tmp_path / f"link{number}{given.suffix}"
        command = line.replace("INPUT", str(given)).replace("PLACE", str(how(given, file) or file)).split()
        for force in ((), ("--force",)):
            with pytest.raises(ParameterError, match="must be a file that the command does not need besides"):
                told(command[0], *force, *command[1:])


@pytest.mark.parametrize("how", ["a link", "a hard link"])
def test_two_outputs_are_two_files(how: str, tmp_path: Path) -> None:
    (tmp_path / "run.csv").touch()
    SAME[how](tmp_path / "run.csv", tmp_path / "run.mcap")
    with pytest.raises(ParameterError, match="must be a file that the command does not need besides"):
        told("run", "--export", tmp_path / "run.csv", "--record", tmp_path / "run.mcap", WANDER)


def test_an_arena_is_replaced_with_force(tmp_path: Path) -> None:
    for words in ((), ("--force",)):
        app(["arena", "maze", str(tmp_path / "maze.toml"), *words], standalone_mode=False)
    with pytest.raises(ParameterError, match="must be new, but"):
        told("arena", "maze", tmp_path / "maze.toml")


def test_what_an_arena_or_a_project_names_is_an_input(tmp_path: Path) -> None:
    for name, text in (("maze.toml", 'picture = "maze.png"\n'), ("task.kiks", "program = 'sub/maze.png'\n")):
        (tmp_path / name).write_text(text)
        for place in ("maze.png", "sub/maze.png"):
            (tmp_path / place).parent.mkdir(exist_ok=True)
            with pytest.raises(ParameterError, match=re.escape(name)):
                told("run", "--arena", tmp_path / name, "--export", tmp_path / place, WANDER)
        told("run", "--arena", tmp_path / name, "--export", tmp_path / "amaze.png", WANDER)


def test_the_place_of_an_output_that_is_left_out_is_checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for words, name in (
        (("compare", "one", "two"), "kiks-compare.png"),
        (("demo", "follow"), "kiks-follow.png"),
        (("arena", "maze", "x.toml"), "x.png"),
    ):
        told(*words)
        Path(name).write_text("precious")
        with pytest.raises(ParameterError, match=f"must be new.*{name}' exists"):
            told(*words)
    told("demo", "follow", "--desk")  # there a person takes pictures


@pytest.mark.parametrize(
    ("line", "option"),
    [
        (f"run --seed 1 --seed 2 {WANDER}", "--seed"),
        ("run exercise.kiks --seed 1 --export a.csv --seed 1", "--seed"),
        ("demo --export a.png --export b.png avoid", "--export"),
        ("export run.mcap run.html --title A --title B", "--title"),
        ("serve --pty --no-pty", "--pty"),
        ("arena maze maze.toml --rows 4 --rows 5", "--rows"),
    ],
)
def test_an_option_that_has_one_value_is_given_once(line: str, option: str) -> None:
    with pytest.raises(ParameterError, match=f"{option} must be given once, but it was given 2 times"):
        told(*line.split())


def test_only_results_for_a_script_reach_the_output(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """What a command has printed may wait in a buffer, as it does where the output is a pipe."""
    with open(1, "w", closefd=False) as buffered:
        monkeypatch.setattr(sys, "stdout", buffered)
        print("earlier")
        with _alone(SimpleNamespace(meta={_RESULTS: {"path_mm": 5}})):
            print("meanwhile")
        monkeypatch.undo()
    assert capfd.readouterr() == ('earlier\n{\n  "path_mm": 5\n}\n', "meanwhile\n")


def test_some_options_have_several_values() -> None:
    assert told("run", "--robot", "khepera", "--robot", "khepera_ii", WANDER)["robot"] == ["khepera", "khepera_ii"]


DESK = "must be left out with --desk, where a person ends the run, but it was 5.0"
IDLE = {
    f"run --desk --seconds 5 {WANDER}": f"--seconds {DESK}",
    f"run --desk --max-wall 5 {WANDER}": f"--max-wall {DESK}",
    f"run --no-wait {WANDER}": "--no-wait must be left out without --desk",
    f"run --when-silent drop {WANDER}": "--when-silent must be left out with one program",
    f"run --patience 2 {WANDER}": "--patience must be left out with one program",
    f"run --save-thinking times {WANDER}": "--save-thinking must be left out with --thinking none",
    f"run --robots 1 {WANDER} {WANDER}": "--robots must be at least 2",
    f"run --map never-opened=4 {WANDER}": "robot must be the number of an existing robot, but it was 4",
    f"run {WANDER} exercise.kiks": "a project must come first, but 'exercise.kiks' stands among the programs",
    f"desk {WANDER} exercise.kiks": "a project must come first, but 'exercise.kiks' stands among the programs",
    "demo avoid --no-wait": "--no-wait must be left out without --desk",
    "champion . c.toml --at 1,2 --world 1": "--world must be left out with --at",
    "evolve --list --seed 0": "--seed must be left out with --list",
    "replay run.mcap --check --start 1": "--start must be left out with --check",
    "replay run.mcap --check --speed 1": "--speed must be left out with --check",
    "export run.mcap run.mp4 --time 1": "--time must be left out of a film, but it was 1.0",
    "export run.mcap run.png --fps 1": "--fps must be left out of a picture, but it was 1",
    "export run.mcap run.csv --plain": "--plain must be left out of a table",
    "export run.mcap run.png --kind page": "a page must end in .html",
    "export run.mcap run.png --kind pages": "Did you mean 'page'?",
    "serve --programs 1": "--programs must be left out with --thinking live",
    "serve --patience 1": "--patience must be left out with --thinking live",
    "serve --when-silent drop": "--when-silent must be left out with --thinking live",
    "serve --thinking none --speed 2": "--speed must be left out with --thinking none",
    "serve --thinking none --by-character": "--by-character must be left out with --thinking none",
    "serve --no-pty --link x": "--link must be left out with --no-pty",
}
"""Options that would have no effect, or be taken for something else, and what is told of them."""


@pytest.mark.parametrize("line", IDLE)
def test_no_option_is_ignored(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("exercise.kiks", "champion.toml"):
        Path(name).touch()
    save_arena(Arena.box(300, 300), "box.toml")
    with pytest.raises(ParameterError, match=re.escape(IDLE[line])):
        app(line.split(), standalone_mode=False)

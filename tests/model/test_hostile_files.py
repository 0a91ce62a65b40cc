"""Damaged and hostile files: one line, short, with little of the file in it, and never another exception."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import kiks
from kiks.clock.thinking import parse_thinking, save_thinking
from kiks.errors import SHOWN_MAX, KiksError
from kiks.learn.evolution_log import Folder, Identity
from kiks.learn.results import Baselines, ExamScore, Result, load_result
from kiks.model.project import Project
from kiks.model.thesis_networks import NetworkResponse

LINEAR = kiks.controllers.linear()
DIGEST, AXES = {"fitness": "0123456789abcdef"}, (kiks.Axis("contacts", 0, 1),)
IDENTITY = Identity("avoid", "cma", 3, 8, "linear", DIGEST, kiks.__version__, "", {"": 18}, ("contacts",), AXES)
TASK = 'task = 1\nbase = "avoid"\nname = "mine"\nseconds = 2.5\nworlds = 6\nbaud = 9600\n[controller]\nkind = "gru"\n'


def champion(path: Path) -> None:
    world = Project(kiks.Arena.box(300, 300))
    kiks.Champion(LINEAR, (0.5,) * 18, task="avoid", fitness=1.0, measures={"contacts": 2.0}, world=world).save(path)


def identity(path: Path) -> None:
    path.unlink(missing_ok=True)
    Folder(path.parent).check_identity(IDENTITY)


def result(path: Path) -> None:
    curve = {"generations": 0, "evaluations": (8,), "champion_fitness": (0.5,)}
    costs = {"fitness": 0.5, "generation": 1, "seconds": 2.0, "population": 8, "seed": 3}
    names = dict.fromkeys(("task", "algorithm", "controller", "kiks"), "name")
    Result(
        result=1,
        **names,
        task_digest={"fitness": "0123"},
        **costs,
        **curve,
        baselines=Baselines(0.0, 0.1),
        exam=ExamScore(1, 20, 2, 200, "Exam"),
    ).save(path.parent)


KINDS: dict[str, tuple[Callable[[Path], object], Callable[[Path], object]]] = {
    "champion.toml": (champion, kiks.Champion.load),
    "task.toml": (lambda path: path.write_text(TASK), lambda path: kiks.tasks.load(str(path))),
    "evolution.json": (identity, lambda path: Folder(path.parent).check_identity(IDENTITY)),
    "result.json": (result, lambda path: load_result(path.parent)),
    "networks.json": (lambda path: NetworkResponse.load().save(path), NetworkResponse.load),
    "times.txt": (lambda path: save_thinking([12_345] * 20, path), lambda path: parse_thinking(f"replay:{path}")),
}
VALUES = (
    *("nan", "inf", "-inf", "1" * 400, "1e400", "9" * 5000, "-1", "0", "true", '"' + "s" * 3000 + '"', '"\\u0000"'),
    *("[]", "{}", "[" * 5000, "[" * 50 + "]" * 50, "[[1]]", "1979-05-27", "'", '"', "\0", "x" * 5000),
    *("a" + ".a" * 5000 + " = 1", '{"a": ' * 3000, '"\ud800"'),
)


def mutations(data: bytes, seed: int, count: int) -> Iterator[bytes]:
    """Yield a file cut short, with other values, lines twice or left out, and other bytes."""
    draw = random.Random(seed)
    tokens = [word for word in data.decode().replace("=", " = ").split() if len(word) < 40]
    for _ in range(count):
        place, kind = draw.randrange(len(data) + 1), draw.randrange(5)
        if kind == 0:
            yield data[:place]
        elif kind == 1:
            value = draw.choice(VALUES).encode(errors="surrogatepass")
            yield data.replace(draw.choice(tokens).encode(), value, draw.choice((1, -1)))
        elif kind == 2:
            yield data[:place] + bytes(draw.randrange(256) for _ in range(draw.randrange(1, 9))) + data[place + 1 :]
        else:
            lines = data.splitlines(keepends=True)
            line = draw.choice(lines) if kind == 3 else draw.choice(VALUES).encode(errors="surrogatepass") + b"\n"
            lines.insert(draw.randrange(len(lines) + 1), line)
            del lines[draw.randrange(len(lines))]
            yield b"".join(lines)


def longest_shared(message: str, content: str) -> int:
    """Return how many characters of the content a message repeats in a row."""
    longest = 0
    for start in range(len(message)):
        while message[start : start + longest + 1] in content and start + longest < len(message):
            longest += 1
    return longest


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_a_damaged_file_ends_in_one_short_line(name: str, tmp_path: Path) -> None:
    write, read = KINDS[name]
    path = tmp_path / name
    write(path)
    read(path)
    data, refused = path.read_bytes(), 0
    for number, mutated in enumerate(mutations(data, 7, 300)):
        path.write_bytes(mutated)
        try:
            read(path)
        except KiksError as error:
            refused += 1
            message = str(error).replace(str(path), "").replace(str(tmp_path), "")
            assert len(message) <= 500, (number, message)
            assert "\n" not in message, (number, message)
            assert longest_shared(message, mutated.decode("utf-8", "replace")) <= SHOWN_MAX, (number, message)
    assert refused > 100


@pytest.mark.parametrize("name", KINDS)
def test_what_is_no_file_of_ours_is_refused(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    wrong: tuple[Any, ...] = ([], 3, "x", None, {}, [[]] * 9, {"a" * 5000: 1}, {"champion": 1}, {"task": []})
    for content in (
        b"\0" * 1000,
        b"\xff\xfe",
        b"\xef\xbb\xbf",
        b"a = 1",
        *(json.dumps(each).encode() for each in wrong),
    ):
        path.write_bytes(content)
        if content == b"3" and name == "times.txt":
            continue
        with pytest.raises(KiksError):
            KINDS[name][1](path)
    path.unlink()
    path.mkdir()
    with pytest.raises(KiksError, match="must be a file, but it is a folder"):
        KINDS[name][1](path)

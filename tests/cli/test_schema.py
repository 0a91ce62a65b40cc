"""`kiks schema`: whole JSON schemas that accept our own files and refuse broken ones."""

import json
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from tests.cli.test_cli import kiks

from kiks.model.arena import Arena
from kiks.model.project import Project, ProjectRobot
from kiks.model.robot import RobotSpec, robot_toml

ROOT = Path(__file__).parents[2]
TASK = {"task": 1, "base": "avoid", "worlds": 4, "controller": {"kind": "mlp", "hidden": [4]}, "arenas": ["a.toml"]}
ROBOT = tomllib.loads(robot_toml(RobotSpec.load("khepera")))
PROJECT = tomllib.loads(
    Project(Arena.box(300, 200), robots=(ProjectRobot(turrets=("gripper",), brightness=90),), seed=7, thinking="none")
    .to_bytes()
    .decode()
)
ARENA = {"size_mm": [300, 200], "start": [{"at_mm": [100, 100]}], "ball": [{"at_mm": [200, 100], "brightness": 9}]}
GOOD = {"robot": ROBOT, "arena": ARENA, "project": PROJECT, "task": TASK}


@cache
def schema_of(kind: str) -> Any:
    return json.loads(kiks("schema", kind).output)


def accepts(kind: str, content: object) -> bool:
    return bool(jsonschema.Draft202012Validator(schema_of(kind)).is_valid(content))


@pytest.mark.parametrize("kind", GOOD)
def test_a_schema_is_whole_and_accepts_good_files_but_no_broken_key(kind: str) -> None:
    schema = schema_of(kind)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["title"] == f"KiKS {kind} file"
    for each in (schema, *schema.get("$defs", {}).values()):
        if each["type"] == "object":
            assert each["description"]
            assert each["additionalProperties"] is False
    assert '"null"' not in json.dumps(schema)
    good = GOOD[kind]
    assert accepts(kind, good)
    assert not accepts(kind, good | {"unknown": 1})
    for key in good:
        assert not accepts(kind, good | {key: None}), key
        assert not accepts(kind, good | {key: {"unknown": []}}), key
    for key in schema.get("required", []):
        assert not accepts(kind, {name: value for name, value in good.items() if name != key}), key


def test_our_files_are_accepted() -> None:
    robots = sorted((ROOT / "src/kiks/model/robots").glob("*.toml"))
    arenas = sorted((ROOT / "examples/arenas").glob("*.toml"))
    assert robots
    assert arenas
    for kind, files in (("robot", robots), ("arena", arenas), ("task", [ROOT / "examples/office_task.toml"])):
        for path in files:
            assert accepts(kind, tomllib.loads(path.read_text(encoding="utf-8"))), path


def test_a_robot_that_is_like_another_names_what_differs_alone() -> None:
    small = {"like": "khepera", "name": "small", "body": {"diameter_mm": 40.0}}
    assert accepts("robot", small)
    for change in ({"like": "r2d2"}, {"body": {"diameter_mm": 5}}, {"body": {"unknown": 1}}):
        assert not accepts("robot", small | change)
    for key in ("like", "name"):
        assert not accepts("robot", {name: value for name, value in small.items() if name != key})


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("robot", {"body": ROBOT["body"] | {"diameter_mm": 5}}),
        ("robot", {"proximity": ROBOT["proximity"] | {"response": "magic"}}),
        ("robot", {"proximity": ROBOT["proximity"] | {"gain": [1.0] * 7}}),
        ("arena", {"ball": [{"radius_mm": 3}]}),
        ("project", {"seed": -1}),
        ("task", {"task": 2}),
        ("task", {"base": "avoyd"}),
        ("task", {"name": "../out"}),
        ("task", {"controller": {"kind": "mlp", "hidden": [10**9]}}),
        ("task", {"controller": {"kind": "gru", "hidden": [3]}}),
        ("task", {"controller": {"function": "x.exe"}}),
    ],
)
def test_values_out_of_range_are_refused(kind: str, change: dict[str, Any]) -> None:
    assert not accepts(kind, GOOD[kind] | change)

"""`kiks schema`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import typer

from kiks.model.robot_kinds import ROBOT_NAMES

if TYPE_CHECKING:
    from pydantic.json_schema import JsonSchemaValue


FileKind = Literal["robot", "arena", "project", "task"]
"""Files that users write."""


def schema(
    kind: Annotated[FileKind, typer.Argument(help=f"The kind of file: {', '.join(get_args(FileKind))}.")],
) -> None:
    """Print the JSON schema of a kind of file, for an editor.

    With it, the editor completes and checks your files.

    Example: kiks schema robot > robot.schema.json
    """
    typer.echo(json.dumps(schema_of(kind), indent=2))


def schema_of(kind: FileKind) -> JsonSchemaValue:
    """Return the JSON schema, 2020-12, of a kind of file: that of the model which checks it when it is read."""
    from pydantic.json_schema import GenerateJsonSchema

    from kiks.learn.tasks import TaskFile
    from kiks.model.arena_file import ArenaFile
    from kiks.model.data_file import adapter
    from kiks.model.project import ProjectFile
    from kiks.model.robot import RobotSpec

    class Generator(GenerateJsonSchema):
        """TOML has no null: a key that may be None is one that may be left out."""

        def nullable_schema(self, schema: Any) -> JsonSchemaValue:
            return self.generate_inner(schema["schema"])

        def default_schema(self, schema: Any) -> JsonSchemaValue:
            made = super().default_schema(schema)
            return {key: value for key, value in made.items() if key != "default" or value is not None}

        def field_title_should_be_set(self, schema: Any) -> bool:
            return False

    models = {"robot": RobotSpec, "arena": ArenaFile, "project": ProjectFile, "task": TaskFile}
    made = adapter(models[kind]).json_schema(schema_generator=Generator)
    if kind == "robot":
        _allow_like(made)
    return {"$schema": Generator.schema_dialect} | made | {"title": f"KiKS {kind} file"}


def _allow_like(made: JsonSchemaValue) -> None:
    """Let a robot file be `like` a robot of ours: then its sections name only what differs."""
    sections: dict[str, Any] = made["$defs"]
    needed = {
        name: sections[each["$ref"].rpartition("/")[2]] for name, each in made["properties"].items() if "$ref" in each
    }
    made["then"] = {
        "required": made["required"],
        "properties": {name: {"required": each.pop("required")} for name, each in needed.items() if "required" in each},
    }
    made["if"] = {"not": {"required": ["like"]}}
    made["required"] = ["name"]
    text = "A robot of ours, whose values this one has where it names none."
    made["properties"] = {"like": {"enum": list(ROBOT_NAMES), "description": text}} | made["properties"]

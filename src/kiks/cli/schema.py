"""`kiks schema`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import typer

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
        made = _with_like(made)
    return {"$schema": Generator.schema_dialect} | made | {"title": f"KiKS {kind} file"}


def _with_like(made: JsonSchemaValue) -> JsonSchemaValue:
    """Return the schema of robots' files: one that is `like` a robot of ours need not name what that one has."""
    from kiks.model.robot import robot_names

    sections = {name: each["$ref"].rpartition("/")[2] for name, each in made["properties"].items() if "$ref" in each}
    rules = {name: made["$defs"][section] for name, section in sections.items()}
    needed = {name: {"required": rule.pop("required")} for name, rule in rules.items() if "required" in rule}
    like = {"enum": robot_names(), "description": "The robot of ours whose values it has where it names none."}
    made["properties"]["like"] = like
    return made | {"if": {"required": ["like"]}, "else": {"required": made.pop("required"), "properties": needed}}

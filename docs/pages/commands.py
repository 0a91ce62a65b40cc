"""Makes the page `reference/commands.md` from what the commands say in their help."""

from __future__ import annotations

from collections.abc import Iterator

import typer.main
from typer.core import TyperGroup

from kiks.cli import app

INTRODUCTION = """# Commands

Each command explains itself with `--help`, from which this page is made. A command that fails says why in one line and
ends with status 1, or with 2 if it does not understand its arguments. `kiks --version` prints the version.

For scripts, a command with results has `--json`: it prints them alone on the standard output, and all else, such as
what a program prints, on the error output. `kiks run --json` tells the time, the seed, the state, and of each robot how
far it drove and how often it touched something.
"""


def prose(text: str) -> str:
    """Return a paragraph of help as Markdown."""
    return " ".join(text.split()).replace("<", r"\<").replace("*", r"\*").replace("__", r"\_\_")


def cell(text: str) -> str:
    """Return text as it stands in a cell of a table."""
    return prose(text).replace("|", r"\|")


def section(name: str, command: typer.main.TyperCommand, level: str) -> Iterator[str]:
    """Yield the lines about a command: what it does, its usage, arguments and options, and an example."""
    context = command.context_class(command, info_name=name)
    yield f"{level} {name}"
    yield ""
    usage = " ".join([name, *command.collect_usage_pieces(context)]).strip()
    examples = []
    for paragraph in (command.help or "").split("\n\n"):
        text = " ".join(paragraph.split())
        if text.startswith("Example: "):
            examples += text.removeprefix("Example: ").split(" Example: ")
        else:
            yield prose(text)
            yield ""
    yield f"```text\n{usage}\n```\n"
    records = [record for each in command.get_params(context) if (record := each.get_help_record(context))]
    if rows := [f"| `{names}` | {cell(meaning)} |" for names, meaning in records if "--help" not in names]:
        yield "\n".join(("| argument or option | meaning |", "|---|---|", *rows, ""))
    if examples:
        yield "```sh\n{}\n```\n".format("\n".join(examples))


def page() -> str:
    """Return the page."""
    group = typer.main.get_command(app)
    lines = [INTRODUCTION]
    for name, command in group.commands.items():
        if isinstance(command, TyperGroup):
            lines += [f"## kiks {name}", "", command.help or "", ""]
            for inner, each in command.commands.items():
                lines += section(f"kiks {name} {inner}", each, "###")
        elif not command.hidden:
            lines += section(f"kiks {name}", command, "##")
    return "\n".join(lines)

"""Documents tell the truth: their programs run, their commands exist, their links lead somewhere."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
import typer.main
from tests import forked
from tests.at_length import cases

import kiks
from kiks.cli import app

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]
MADE = {ROOT / line for line in (ROOT / ".gitignore").read_text().splitlines() if line.startswith("docs/")}
"""Pages, and folders of pages, that `make docs` makes."""

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
PAGES += [page for page in sorted((ROOT / "docs").rglob("*.md")) if not MADE & {page, *page.parents}]


COMMANDS = {command.name or command.callback.__name__ for command in app.registered_commands if command.callback} | {
    group.name for group in app.registered_groups
}


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)


PROGRAM = re.compile(r"^```python\n(.*?)^```(?:\n\n```text\n(.*?)^```)?", flags=re.MULTILINE | re.DOTALL)
"""A program, and what it prints if the page shows that."""

# tests/test_tutorials.py runs the tutorials.
PROGRAMS = [
    (page.name, *found)
    for page in PAGES
    if page.parent.name != "tutorials"
    for found in PROGRAM.findall(page.read_text(encoding="utf-8"))
]
OF_README = sum(page == PAGES[0].name for page, _, _ in PROGRAMS)


@pytest.mark.parametrize(
    ("page", "code", "shown"), cases(PROGRAMS, OF_README), ids=lambda value: value[:20].replace("\n", " ")
)
def test_programs_run(page: str, code: str, shown: str) -> None:
    result = forked.run(code=code, cwd=ROOT)
    assert result.returncode == 0, f"{page}: {result.stderr}"
    assert not shown or result.stdout == shown


def test_the_first_program_keeps_clear_of_the_walls() -> None:
    code = blocks(ROOT / "README.md", "python")[0]
    result = forked.run(code=code, cwd=ROOT)
    found = re.fullmatch(r"(\d+) mm, (\d+) contacts, state [0-9a-f]{16}\n", result.stdout)
    assert found
    assert int(found[1]) > 1000


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text(encoding="utf-8")):
        if "://" not in target:
            there = (page.parent / target).resolve()
            assert there.exists() or MADE & {there, *there.parents}, f"{page.name} points to {target}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_tables_have_a_head_and_equal_rows(page: Path) -> None:
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    for table in re.findall(r"(?:^\|.*\n)+", text, flags=re.MULTILINE):
        head, rule, *rows = table.splitlines()
        assert re.fullmatch(r"(\|:?-+:?)+\|", rule), f"{page.name}: the table that begins {head!r} has no head"
        for row in (head, *rows):
            count = len(re.findall(r"(?<!\\)\|", row))
            assert count == rule.count("|"), f"{page.name}: {row!r} has {count - 1} columns"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_to_sections_lead_somewhere(page: Path) -> None:
    for target, section in re.findall(r"\]\(([^)#\s]*)#([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if "://" not in target:
            there = (page.parent / target if target else page).read_text(encoding="utf-8")
            heads = re.findall(r"^#+ (.*)", there, flags=re.MULTILINE)
            names = {re.sub(r"[^\w -]", "", head.lower()).replace(" ", "-") for head in heads}
            assert section in names, f"{page.name} points to {target}#{section}"


def check_options(words: list[str]) -> None:
    """Fail unless a command has the options it is called with; what stands after a program is the program's."""
    command: Any = typer.main.get_command(app)
    while hasattr(command, "commands") and words and words[0] in command.commands:
        command = command.commands[words.pop(0)]
    known = {option for each in command.params for option in (*each.opts, *each.secondary_opts)} | {"--help", "-h"}
    is_open = command.name not in ("run", "demo")
    for word in words:
        if not is_open and word.endswith(".py"):
            return
        if word.startswith("-") and not word.startswith("---"):
            assert word.partition("=")[0] in known, f"kiks {command.name} {word}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_and_targets_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))
    assert set(re.findall(r"\bmake ([a-z-]+)\b", "".join(blocks(page, "sh")))) <= targets
    for command in re.findall(r"^kiks ([a-z]+)", "".join(blocks(page, "sh")), flags=re.MULTILINE):
        assert command in COMMANDS, f"{page.name}: kiks {command}"
    for line in re.findall(r"^kiks .*", "".join(blocks(page, "sh")), flags=re.MULTILINE):
        check_options(shlex.split(line, comments=True)[1:])
    # Paths that a page names in code must exist.
    for path in re.findall(r"\b(?:examples|docs|benchmarks|tests|src)/[\w./-]+\.\w+", text):
        assert (ROOT / path).exists(), f"{page.name} names {path}"


def test_the_python_reference_has_every_public_name() -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs/reference").glob("*.md"))
    found = set(re.findall(r"^\.\. auto(?:class|function|data|module):: ([\w.]+)$", text, flags=re.MULTILINE))
    names = set(kiks.__all__) - {"__version__", "controllers", "measures", "tasks"}
    assert names | set(dir(kiks.measures)) | {"kiks.controllers", "kiks.measures", "kiks.tasks"} <= found

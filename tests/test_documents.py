"""Documents tell the truth: their programs run, their commands exist, their links lead somewhere."""

from __future__ import annotations

import ast
import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import pytest
import typer.main
from tests import forked
from tests.at_length import cases
from tests.documents import ROOT, Reader, blocks
from tests.matlab.octave import OCTAVE

import kiks
from kiks.cli import app

pytestmark = pytest.mark.slow

MADE = {ROOT / line for line in (ROOT / ".gitignore").read_text().splitlines() if line.startswith("docs/")}
"""Pages, and folders of pages, that `make docs` makes."""

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
PAGES += [page for page in sorted((ROOT / "docs").rglob("*.md")) if not MADE & {page, *page.parents}]

COMMANDS = {command.name or command.callback.__name__ for command in app.registered_commands if command.callback} | {
    group.name for group in app.registered_groups
}


def name(page: Path) -> str:
    """Return the name of a page among those of `docs`."""
    return page.relative_to(ROOT / "docs").as_posix() if page.is_relative_to(ROOT / "docs") else page.name


AT_LENGTH = (
    *("README.md", "index.md", "howto/evolution.md", "howto/recording.md"),
    *("tutorials/class.md", "tutorials/evolution.md"),
)
"""Pages that `make test` leaves out. README is read from a wheel there (tests/test_packages.py)."""

READ = [page for page in PAGES if page.name != "protocol.md"]
"""What is not a page whose blocks the firmware has made (docs/pages/protocol.py)."""

WITH_BLOCKS = sorted((page for page in READ if blocks(page)), key=lambda page: name(page) in AT_LENGTH)


@pytest.mark.parametrize("page", cases(WITH_BLOCKS, len(WITH_BLOCKS) - len(AT_LENGTH)), ids=name)
def test_pages_do_what_they_show(page: Path, tmp_path: Path) -> None:
    text = page.read_text(encoding="utf-8")
    if OCTAVE is None and re.search(r"^octave|^```(octave|matlab)", text, flags=re.MULTILINE):
        pytest.skip("octave-cli is not here: apt-get install octave")
    # Some pages tell how to get the examples; the others are read beside them.
    if "kiks examples examples\n" not in text:
        shutil.copytree(ROOT / "examples", tmp_path / "examples")
    Reader(tmp_path, is_short=page.parent.name != "tutorials").read(page)


@pytest.mark.parametrize("page", READ, ids=name)
def test_each_block_runs_or_says_why_not(page: Path) -> None:
    for block in blocks(page):
        assert block.reason or hasattr(Reader, f"do_{block.language}"), (
            f"{page.name}: a block of {block.language!r} wants a reader in tests/documents.py, or the line "
            f"<!-- not run: REASON --> before it:\n{block.code}"
        )
    reasons = re.findall("^ *<!-- not run", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert len(reasons) == sum(block.reason is not None for block in blocks(page)), "a reason without its block"


def test_the_first_program_keeps_clear_of_the_walls() -> None:
    code = next(block.code for block in blocks(ROOT / "README.md") if block.language == "python")
    result = forked.run(code=code, cwd=ROOT)
    found = re.fullmatch(r"(\d+) mm, (\d+) contacts, state [0-9a-f]{16}\n", result.stdout)
    assert found
    assert int(found[1]) > 1000


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text(encoding="utf-8")):
        if "://" not in target:
            there = (page.parent / target).resolve()
            assert there.exists() or MADE & {there, *there.parents}, f"{page.name} points to {target}"


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_tables_have_a_head_and_equal_rows(page: Path) -> None:
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    for table in re.findall(r"(?:^\|.*\n)+", text, flags=re.MULTILINE):
        head, rule, *rows = table.splitlines()
        assert re.fullmatch(r"(\|:?-+:?)+\|", rule), f"{page.name}: the table that begins {head!r} has no head"
        for row in (head, *rows):
            count = len(re.findall(r"(?<!\\)\|", row))
            assert count == rule.count("|"), f"{page.name}: {row!r} has {count - 1} columns"


@pytest.mark.parametrize("page", PAGES, ids=name)
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


def check_commands(text: str) -> None:
    """Fail unless the commands of all lines exist, with their options."""
    for line in re.findall(r"^(?: *Example: )?(kiks [a-z].*)", text, flags=re.MULTILINE):
        words = shlex.split(line, comments=True)[1:]
        assert words[0] in COMMANDS, line
        check_options(words)


def test_commands_in_docstrings_exist() -> None:
    for folder in (ROOT / "examples", ROOT / "src" / "kiks" / "cli"):
        for path in folder.rglob("*.py"):
            for each in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(each, ast.Module | ast.FunctionDef):
                    check_commands(ast.get_docstring(each) or "")


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_commands_and_targets_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    shell = "".join(block.code for block in blocks(page) if block.language == "sh")
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))
    assert set(re.findall(r"\bmake ([a-z-]+)\b", shell)) <= targets
    check_commands(shell)
    # Paths that a page names in code must exist.
    for path in re.findall(r"\b(?:examples|docs|benchmarks|tests|src)/[\w./-]+\.\w+", text):
        assert (ROOT / path).exists(), f"{page.name} names {path}"


def test_what_is_installed_names_pages_by_titles_that_exist() -> None:
    # There is no `docs` beside it. The site makes links of the titles in docstrings (docs/conf.py).
    titles = {re.findall("^# (.+)", page.read_text(encoding="utf-8"), flags=re.MULTILINE)[0] for page in PAGES}
    for folder in ("src", "matlab", "examples"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in (".py", ".m", ".toml", ".kiks", ".md", ".js", ".html", ".c", ".java"):
                text = path.read_text(encoding="utf-8")
                assert "docs/" not in text, path
                assert set(re.findall(r'\bpage "([A-Z][^"{]+)"', text)) <= titles, path


def test_the_python_reference_has_every_public_name() -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs/reference").glob("*.md"))
    found = set(re.findall(r"^\.\. auto(?:class|function|data|module):: ([\w.]+)$", text, flags=re.MULTILINE))
    names = set(kiks.__all__) - {"__version__", "controllers", "measures", "tasks"}
    assert names | set(dir(kiks.measures)) | {"kiks.controllers", "kiks.measures", "kiks.tasks"} <= found

"""Documents tell the truth: their programs run, their commands exist, their links lead somewhere."""

import ast
import functools
import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests import forked
from tests.at_length import cases
from tests.documents import ROOT, Reader, blocks
from tests.matlab.octave import OCTAVE

import kiks

pytestmark = pytest.mark.slow

MADE = {ROOT / line for line in (ROOT / ".gitignore").read_text().splitlines() if line.startswith("docs/")}
"""Pages, and folders of pages, that `make docs` makes."""

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
PAGES += [page for page in sorted((ROOT / "docs").rglob("*.md")) if not MADE & {page, *page.parents}]


@functools.cache
def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def name(page: Path) -> str:
    """Return the name of a page among those of `docs`."""
    return page.relative_to(ROOT / "docs").as_posix() if page.is_relative_to(ROOT / "docs") else page.name


AT_LENGTH = {
    *("index.md", "howto/classics.md", "howto/evolution.md", "howto/matches.md", "howto/recording.md"),
    *("howto/soccer.md", "howto/sweep.md", "howto/tournaments.md"),
    *("tutorials/class.md", "tutorials/evolution.md", "tutorials/figures.md"),
}
"""Pages that take ten seconds and more: `make test` leaves them out."""

READ = [page for page in PAGES if page.name != "protocol.md"]
"""What is not a page whose blocks the firmware has made (docs/pages/protocol.py)."""

WITH_BLOCKS = sorted((page for page in READ if blocks(page)), key=lambda page: name(page) in AT_LENGTH)


@pytest.mark.parametrize("page", cases(WITH_BLOCKS, len(WITH_BLOCKS) - len(AT_LENGTH)), ids=name)
def test_pages_do_what_they_show(page: Path, tmp_path: Path) -> None:
    text = text_of(page)
    if OCTAVE is None and re.search(r"^octave|^```(octave|matlab)", text, flags=re.MULTILINE):
        pytest.skip("octave-cli is not here: apt-get install octave")
    # Some pages tell how to get the examples; the others are read beside them.
    if re.search(r"^kiks examples examples\b", text, flags=re.MULTILINE) is None:
        shutil.copytree(ROOT / "examples", tmp_path / "examples")
    Reader(tmp_path, is_short=page.parent.name != "tutorials").read(page)


def test_each_block_runs_or_says_why_not() -> None:
    wrong = []
    for page in READ:
        for block in blocks(page):
            if not (block.reason or hasattr(Reader, f"do_{block.language}")):
                wrong.append(
                    f"{page.name}: a block of {block.language!r} wants a reader in tests/documents.py, or the line "
                    f"<!-- not run: REASON --> before it:\n{block.code}"
                )
        reasons = re.findall("^ *<!-- not run", text_of(page), flags=re.MULTILINE)
        if len(reasons) != sum(block.reason is not None for block in blocks(page)):
            wrong.append(f"{page.name}: a reason without its block")
    assert not wrong, "\n".join(wrong)


def test_the_first_program_keeps_clear_of_the_walls() -> None:
    code = next(block.code for block in blocks(ROOT / "README.md") if block.language == "python")
    found = re.fullmatch(r"(\d+) mm, \d+ contacts, state [0-9a-f]{16}\n", forked.run(code=code, cwd=ROOT).stdout)
    assert found
    assert int(found[1]) > 1000


def test_links_lead_somewhere() -> None:
    wrong = []
    for page in PAGES:
        for target, section in re.findall(r"\]\(([^)#\s]*)#?([^)\s]*)[^)]*\)", text_of(page)):
            there = (page.parent / target).resolve() if target else page
            if "://" in target:
                continue
            if not there.exists():
                if section or not MADE & {there, *there.parents}:
                    wrong.append(f"{page.name} points to {target}")
            elif section:
                heads = re.findall(r"^#+ (.*)", text_of(there), flags=re.MULTILINE)
                if section not in {re.sub(r"[^\w -]", "", head.lower()).replace(" ", "-") for head in heads}:
                    wrong.append(f"{page.name} points to {target}#{section}")
    assert not wrong, "\n".join(wrong)


def test_tables_have_a_head_and_equal_rows() -> None:
    wrong = []
    for page in PAGES:
        text = re.sub(r"^```.*?^```", "", text_of(page), flags=re.MULTILINE | re.DOTALL)
        for table in re.findall(r"(?:^\|.*\n)+", text, flags=re.MULTILINE):
            head, rule, *rows = table.splitlines()
            if not re.fullmatch(r"(\|:?-+:?)+\|", rule):
                wrong.append(f"{page.name}: the table that begins {head!r} has no head")
            for row in (head, *rows):
                count = len(re.findall(r"(?<!\\)\|", row))
                if count != rule.count("|"):
                    wrong.append(f"{page.name}: {row!r} has {count - 1} columns")
    assert not wrong, "\n".join(wrong)


def wrong_options(words: list[str]) -> Iterator[str]:
    """Yield each option that a command does not have; what stands after a program is the program's."""
    import typer.main

    from kiks.cli import app

    command: Any = typer.main.get_command(app)
    while hasattr(command, "commands") and words and words[0] in command.commands:
        command = command.commands[words.pop(0)]
    known = {option for each in command.params for option in (*each.opts, *each.secondary_opts)} | {"--help", "-h"}
    is_open = command.name not in ("run", "demo")
    for word in words:
        if not is_open and word.endswith(".py"):
            return
        if word.startswith("-") and not word.startswith("---") and word.partition("=")[0] not in known:
            yield f"kiks {command.name} {word}"


@functools.cache
def commands() -> set[str | None]:
    from kiks.cli import app

    named = {command.name or command.callback.__name__ for command in app.registered_commands if command.callback}
    return named | {group.name for group in app.registered_groups}


def wrong_commands(text: str) -> Iterator[str]:
    """Yield each line whose command does not exist, and each option that it does not have."""
    for line in re.findall(r"^(?: *Example: )?(kiks [a-z].*)", text, flags=re.MULTILINE):
        words = shlex.split(line, comments=True)[1:]
        if words[0] in commands():
            yield from wrong_options(words)
        else:
            yield line


def test_commands_in_docstrings_exist() -> None:
    wrong = []
    for folder in (ROOT / "examples", ROOT / "src" / "kiks" / "cli"):
        for path in folder.rglob("*.py"):
            for each in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(each, ast.Module | ast.FunctionDef):
                    wrong += [f"{path}: {line}" for line in wrong_commands(ast.get_docstring(each) or "")]
    assert not wrong, "\n".join(wrong)


def test_commands_targets_and_paths_exist() -> None:
    wrong = []
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))
    for page in PAGES:
        shell = "".join(block.code for block in blocks(page) if block.language == "sh")
        used = set(re.findall(r"\bmake ([a-z-]+)\b", shell))
        paths = re.findall(r"\b(?:examples|docs|benchmarks|tests|src)/[\w./-]+\.\w+", text_of(page))
        missing = [*(used - targets), *wrong_commands(shell), *(path for path in paths if not (ROOT / path).exists())]
        wrong += [f"{page.name} names {each}" for each in missing]
    assert not wrong, "\n".join(wrong)


def test_what_is_installed_names_pages_by_titles_that_exist() -> None:
    # There is no `docs` beside it. The site makes links of the titles in docstrings (docs/conf.py).
    titles = {re.findall("^# (.+)", text_of(page), flags=re.MULTILINE)[0] for page in PAGES}
    wrong = []
    for folder in ("src", "matlab", "examples"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in (".py", ".m", ".toml", ".kiks", ".md", ".js", ".html", ".c", ".java"):
                text = path.read_text(encoding="utf-8")
                missing = set(re.findall(r'\bpage "([A-Z][^"{]+)"', text)) - titles
                missing |= {"docs/"} if "docs/" in text else set()
                wrong += [f"{path} names {each}" for each in missing]
    assert not wrong, "\n".join(wrong)


def test_the_python_reference_has_every_public_name() -> None:
    text = "".join(text_of(page) for page in (ROOT / "docs/reference").glob("*.md"))
    found = set(re.findall(r"^\.\. auto(?:class|function|data|module):: ([\w.]+)$", text, flags=re.MULTILINE))
    names = set(kiks.__all__) - {"__version__", "controllers", "measures", "tasks"}
    assert names | set(dir(kiks.measures)) | {"kiks.controllers", "kiks.measures", "kiks.tasks"} <= found

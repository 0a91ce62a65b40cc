"""How large and how plain the sources are: `python tools/house_figures.py` prints figures and where each comes from.

Lines of code are those without blank lines, comments and docstrings. A comment counts on its own line or after code.
"""

from __future__ import annotations

import ast
import functools
import io
import re
import sys
import tokenize
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCES = ROOT / "src" / "kiks"
DESIGN = ROOT / "docs" / "explanation" / "design.md"

LONG_FUNCTION = 60
"""Lines of code above which a function is listed."""

MANY_ARGUMENTS = 9
"""Arguments above which a call of a constructor from another folder is listed; records of settings are left out."""

COMMENTED = ("engine", "ports", "script", "sim")

NAME = re.compile(r"e-?puck", re.IGNORECASE)
"""What names the e-puck."""

DOCUMENT = re.compile(r"\bepuck[\w-]*\.md\b")
"""Names a document that figures are taken from, which is called after the robot."""

OF_THE_ROBOT = ("firmware/epuck/", "model/robots/epuck")
"""How the places of its own files begin."""

_NO_CODE = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)
_RECORDS = {"dataclass", "NamedTuple", "TypedDict"}


@functools.cache
def tree_of(file: Path) -> ast.Module:
    """Return the syntax tree of a file."""
    return ast.parse(file.read_text(encoding="utf-8"))


@functools.cache
def lines_of(file: Path) -> tuple[frozenset[int], int]:
    """Return the numbers of a file's lines of code, and how many of its lines have a comment."""
    code: set[int] = set()
    comment_count = 0
    for token in tokenize.generate_tokens(io.StringIO(file.read_text(encoding="utf-8")).readline):
        comment_count += token.type == tokenize.COMMENT
        if token.type not in _NO_CODE:
            code.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(tree_of(file)):
        body = getattr(node, "body", None)
        for statement in body if isinstance(body, list) else ():
            value = statement.value if isinstance(statement, ast.Expr) else None
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                code.difference_update(range(statement.lineno, (statement.end_lineno or 0) + 1))
    return frozenset(code), comment_count


def folder_of(file: Path) -> str:
    """Return the folder of a source file, or a dot."""
    return file.relative_to(SOURCES).parts[0] if file.parent != SOURCES else "."


def files() -> list[Path]:
    """Return all source files."""
    return sorted(SOURCES.rglob("*.py"))


def nodes(kind: type[ast.AST] | tuple[type[ast.AST], ...]) -> Iterator[tuple[Path, ast.AST]]:
    """Yield all nodes of a kind, with their files."""
    for file in files():
        for node in ast.walk(tree_of(file)):
            if isinstance(node, kind):
                yield file, node


def print_lines() -> None:
    """Print lines of code, physical lines and comments, by folder."""
    code, physical, comments = Counter[str](), Counter[str](), Counter[str]()
    for file in files():
        numbers, comment_count = lines_of(file)
        code[folder_of(file)] += len(numbers)
        comments[folder_of(file)] += comment_count
        physical[folder_of(file)] += len(file.read_text(encoding="utf-8").splitlines())
    print(f"{'folder':12} {'code':>7} {'physical':>9} {'comments in 100':>16}")
    for folder, count in code.most_common():
        print(f"{folder:12} {count:7} {physical[folder]:9} {100 * comments[folder] / count:16.1f}")
    print(f"{'all':12} {code.total():7} {physical.total():9} {100 * comments.total() / code.total():16.1f}")
    share = 100 * sum(comments[each] for each in COMMENTED) / sum(code[each] for each in COMMENTED)
    print(f"comments in 100 lines of code of {', '.join(COMMENTED)}: {share:.1f}")


def print_long_functions() -> None:
    """Print the functions that have many lines of code."""
    found = []
    for file, node in nodes((ast.FunctionDef, ast.AsyncFunctionDef)):
        count = sum(node.lineno <= line <= (node.end_lineno or 0) for line in lines_of(file)[0])
        if count > LONG_FUNCTION:
            found.append((count, f"{file.relative_to(SOURCES)}:{node.lineno} {node.name}"))
    show(
        f"functions above {LONG_FUNCTION} lines of code",
        [f"{count} {place}" for count, place in sorted(found, reverse=True)],
    )


def classes() -> dict[str, list[tuple[Path, ast.ClassDef]]]:
    """Return all classes outside of functions, by their names."""
    found = defaultdict(list)
    for file in files():
        for node in tree_of(file).body:
            if isinstance(node, ast.ClassDef):
                found[node.name].append((file, node))
    return found


def print_names() -> None:
    """Print names of classes that mean two things, and functions that are named after what they return."""
    twice = {name: places for name, places in classes().items() if len(places) > 1}
    show(
        "names of classes that stand twice",
        [
            f"{name}: {', '.join(str(file.relative_to(SOURCES)) for file, _ in places)}"
            for name, places in twice.items()
        ],
    )
    of = [node.name for _, node in nodes((ast.FunctionDef, ast.AsyncFunctionDef)) if node.name.endswith("_of")]
    print(f"\nfunctions named ..._of: {len(of)}")


def print_constructors() -> None:
    """Print calls from other folders that give a constructor many arguments."""
    plain = {
        name: {folder_of(file) for file, _ in places}
        for name, places in classes().items()
        if not any(
            _RECORDS & set(ast.unparse(part).replace("(", ".").split("."))
            for _, node in places
            for part in (*node.bases, *node.decorator_list)
        )
    }
    found = []
    for file, node in nodes(ast.Call):
        name = ast.unparse(node.func).rpartition(".")[2]
        count = len(node.args) + len(node.keywords)
        if count > MANY_ARGUMENTS and name in plain and folder_of(file) not in plain[name]:
            found.append(f"{file.relative_to(SOURCES)}:{node.lineno} {name} takes {count}")
    show(f"constructors that another folder gives more than {MANY_ARGUMENTS} arguments", found)


def print_runs() -> None:
    """Print where programs are put into a world."""
    found = [
        f"{file.relative_to(SOURCES)}:{node.lineno}"
        for file, node in nodes(ast.Call)
        if ast.unparse(node.func) == "Programs"
    ]
    show("places that assemble a run", found)


def lines_that_name_it() -> tuple[list[str], list[str]]:
    """Return the lines that name the e-puck outside of its own files, and those that only cite a document so called."""
    naming: list[str] = []
    citing: list[str] = []
    for file in sorted(path for path in SOURCES.rglob("*") if path.is_file() and "__pycache__" not in path.parts):
        place = file.relative_to(SOURCES).as_posix()
        if not place.startswith(OF_THE_ROBOT):
            for number, line in enumerate(file.read_text(encoding="utf-8", errors="ignore").splitlines(), 1):
                if NAME.search(line):
                    rows = naming if NAME.search(DOCUMENT.sub("", line)) else citing
                    rows.append(f"{place}:{number} {line.strip()}")
    return naming, citing


def print_lines_that_name_it() -> None:
    """Print both."""
    naming, citing = lines_that_name_it()
    show("lines outside of its own files that name the e-puck", naming)
    print(f"lines that only cite a document of that name: {len(citing)}")


def print_glossary() -> None:
    """Print how many rows the glossary of the design page has."""
    text = DESIGN.read_text(encoding="utf-8").partition("## 4. Glossary\n")[2].partition("\n## 5.")[0]
    print(f"\nrows of the glossary: {sum(line.startswith('| ') for line in text.splitlines()) - 1}")


def show(title: str, rows: list[str]) -> None:
    """Print a count and its rows."""
    print(f"\n{title}: {len(rows)}")
    for row in rows:
        print(f"  {row}")


if __name__ == "__main__":
    for part in (
        *(print_lines, print_long_functions, print_names, print_constructors, print_runs, print_glossary),
        print_lines_that_name_it,
    ):
        part()
    sys.exit()

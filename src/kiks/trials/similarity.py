"""Which programs are alike, whatever their names, comments and layout are.

Method: a program becomes a sequence of tokens in which its own names, its numbers and its texts are the same each.
Runs of some tokens are hashed, and of each window of hashes the least is kept (winnowing: Schleimer, Wilkerson and
Aiken 2003). What the exercise's template has does not count. Two programs are as alike as their sets of hashes are.
"""

from __future__ import annotations

import ast
import io
import keyword
import tokenize
import warnings
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

RUN = 6
"""Tokens of which a hash is made."""

WINDOW = 4
"""Hashes of which one is kept."""

LEAST = 12
"""Fewest hashes of a program that can be nearly identical to another: short programs are alike by chance."""

ALIKE = 0.8
"""Share from which two programs are pointed out."""

CHARACTERS_MAX = 200_000
"""Most characters of a program that are compared."""

_LAYOUT = {tokenize.COMMENT, tokenize.NL, tokenize.ENCODING, tokenize.ENDMARKER}


@dataclass(frozen=True)
class Likeness:
    """Two programs that are alike.

    Attributes:
        first: Name of one.
        second: Name of the other.
        share: From `ALIKE` to 1; 1 if they differ in names, comments, layout, numbers and texts alone.
    """

    first: str
    second: str
    share: float


def alike(programs: Mapping[str, str], template: str = "") -> list[Likeness]:
    r"""Return pairs of programs that are alike, the most alike first.

    Args:
        programs: Their texts, by name.
        template: What all were given: its tokens do not count.

    Example:
        >>> one = "for step in range(9):\n    robot.go(step * 2, 3)\n    wait(step)\n" * 4
        >>> alike({"ann": one, "bob": one.replace("step", "i") + "# mine", "eve": "print('hello')"})
        [Likeness(first='ann', second='bob', share=1.0)]
    """
    given = _prints(_tokens(template))
    streams = {name: _tokens(text) for name, text in programs.items()}
    prints = {name: _prints(stream) - given for name, stream in streams.items()}
    found = []
    for first, second in combinations(programs, 2):
        if prints[first] and streams[first] == streams[second]:
            found.append(Likeness(first, second, 1.0))
        elif min(len(prints[first]), len(prints[second])) >= LEAST:
            shared = len(prints[first] & prints[second])
            share = 2 * shared / (len(prints[first]) + len(prints[second]))
            if share >= ALIKE:
                found.append(Likeness(first, second, min(share, 0.999)))
    return sorted(found, key=lambda each: -each.share)


def _tokens(text: str) -> list[str]:
    """Return the tokens of a program; those up to the first that Python cannot read."""
    text = text[:CHARACTERS_MAX]
    own = _own_names(text)
    tokens: list[str] = []
    try:
        for kind, word, *_ in tokenize.generate_tokens(io.StringIO(text).readline):
            if kind in _LAYOUT:
                continue
            if kind == tokenize.NEWLINE and tokens[-2:] in (["STRING"], ["NEWLINE", "STRING"], ["INDENT", "STRING"]):
                tokens.pop()  # a docstring is a comment
                continue
            if kind == tokenize.NAME:
                is_own = word in own if own is not None else not keyword.iskeyword(word)
                tokens.append("name" if is_own else word)
            elif kind in (tokenize.NUMBER, tokenize.STRING):
                tokens.append(tokenize.tok_name[kind])
            else:
                tokens.append(word if kind == tokenize.OP else tokenize.tok_name[kind])
    except (tokenize.TokenError, SyntaxError):
        pass
    return tokens


def _own_names(text: str) -> set[str] | None:
    """Return the names that a program gives; None if it is no Python."""
    try:
        with warnings.catch_warnings(action="ignore"):
            tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.arg):
            names.add(node.arg)
        elif isinstance(node, ast.alias) and node.asname:
            names.add(node.asname)
    return names


def _prints(tokens: Sequence[str]) -> set[int]:
    """Return the hashes that are kept of a sequence."""
    hashes = [
        zlib.crc32("\0".join(tokens[at : at + RUN]).encode("utf-8", "replace")) for at in range(len(tokens) - RUN + 1)
    ]
    return {min(hashes[at : at + WINDOW]) for at in range(max(len(hashes) - WINDOW + 1, bool(hashes)))}

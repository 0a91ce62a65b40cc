"""Puts together what two people have made of a program, such as one who was without a network, and one who was not."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import SequenceMatcher
from typing import NamedTuple

LINES_MAX = 2000
"""Most lines of a program that are compared one by one: the time grows with their square."""

ALSO = "# also written: "
"""Begin of the lines of the other version where both have changed the same."""


class _Change(NamedTuple):
    """Lines of the earlier text, from `begin` to before `end`, that became others in one of the versions."""

    begin: int
    end: int
    version: int
    lines: list[str]


def merged(before: str, one: str, other: str) -> str:
    r"""Return a program with the changes of two versions; nothing of either is lost.

    Args:
        before: What both began with.
        one: A version; where both have changed the same lines, its lines count.
        other: The other version, whose lines then become comments.

    Example:
        >>> merged("a\nb\nc", "A\nb\nc", "a\nb\nC")
        'A\nb\nC'
        >>> merged("a\nb", "one\nb", "other\nb")
        'one\n# also written: other\nb'
    """
    if other in (before, one):
        return one
    lines = before.split("\n")
    sides = _changes(lines, one, 0), _changes(lines, other, 1)
    ours, others = ([line.removeprefix(ALSO) for each in side for line in each.lines] for side in sides)
    # Two pages may have kept the same text: what was put together before stays as it is.
    for new, there, version in ((ours, others, other), (others, ours, one)):
        left = iter(there)
        if new and all(line in left for line in new):
            return version
    changes = sorted([*sides[0], *sides[1]])
    made: list[str] = []
    done = 0
    while changes:
        group = [changes.pop(0)]
        begin, end = group[0].begin, group[0].end
        while changes and (changes[0].begin < end or changes[0].begin == begin):
            end = max(end, changes[0].end)
            group.append(changes.pop(0))
        made += lines[done:begin]
        done = end
        first, second = (_changed(lines, begin, end, (c for c in group if c.version == version)) for version in (0, 1))
        versions = {each.version for each in group}
        made += second if versions == {1} else first
        if len(versions) == 2 and first != second:
            made += [ALSO + line for line in second]
    return "\n".join(made + lines[done:])


def _changes(lines: list[str], text: str, version: int) -> list[_Change]:
    new = text.split("\n")
    if max(len(lines), len(new)) > LINES_MAX:
        return [] if new == lines else [_Change(0, len(lines), version, new)]
    found = SequenceMatcher(None, lines, new, autojunk=False).get_opcodes()
    return [_Change(i1, i2, version, new[j1:j2]) for what, i1, i2, j1, j2 in found if what != "equal"]


def _changed(lines: list[str], begin: int, end: int, changes: Iterable[_Change]) -> list[str]:
    """Return the lines from `begin` to before `end` as one version has them."""
    made = []
    for change in changes:
        made += lines[begin : change.begin] + change.lines
        begin = change.end
    return made + lines[begin:end]

"""A table: the one way in which results with columns are printed, on a terminal, into a file, and as CSV."""

from __future__ import annotations

import csv
import io
import shutil
import sys
from collections.abc import Iterable, Sequence

from kiks.errors import printable

GAP, CUT = "  ", "..."
"""What stands between two columns, and at the end of a text that was cut."""


class Table:
    """Names of columns, and rows.

    No name and no number is ever cut: where a line is too long for a terminal, heads are folded and a text in the last
    column is cut, and if that does not help the terminal breaks the line.

    Args:
        heads: The names of the columns; none for a list without a head.
        rows: The cells, of each row as many. What would steer a terminal is not printed.
        left_count: How many columns stand left; the others, numbers, stand right.
        ends_in_text: Whether the last column is a text, which stands left and may be cut on a terminal.

    Example:
        >>> print(Table(("player", "points", "rating"), [("ann", 9.5, 1500), ("robert", 12, 1700)]))
        player  points  rating
        ann        9.5    1500
        robert      12    1700
    """

    def __init__(
        self,
        heads: Sequence[str],
        rows: Iterable[Iterable[object]],
        *,
        left_count: int = 1,
        ends_in_text: bool = False,
    ) -> None:
        self.heads, self.rows = list(heads), [list(row) for row in rows]
        self._left_count, self._ends_in_text = left_count, ends_in_text

    def __str__(self) -> str:
        return self._within(None)

    def for_output(self) -> str:
        """Return it as the standard output gets it: in a file or a pipe, a line is as long as it is."""
        return self._within(shutil.get_terminal_size().columns if sys.stdout.isatty() else None)

    def csv(self) -> str:
        r"""Return it as CSV that no spreadsheet takes for formulas.

        Example:
            >>> Table(("name", "points"), [("=1+1", -2.5)]).csv()
            "name,points\n'=1+1,-2.5\n"
        """
        text = io.StringIO()
        rows: list[list[object]] = [[*self.heads], *self.rows]
        csv.writer(text, lineterminator="\n").writerows([_safe(cell) for cell in row] for row in rows)
        return text.getvalue()

    def _within(self, width_max: int | None) -> str:
        from rich.cells import cell_len

        texts = [[printable(str(cell), "?") for cell in row] for row in self.rows]
        used = [k for k in range(len(self.heads or texts[0])) if not texts or any(row[k] for row in texts)]
        columns = [[row[k] for row in texts] for k in used]
        heads = [[self.heads[k]] for k in used] if self.heads else [[] for _ in used]
        gaps = len(GAP) * (len(used) - 1)

        def widths() -> list[int]:
            return [max(map(cell_len, (*head, *column))) for head, column in zip(heads, columns, strict=True)]

        if width_max is not None and sum(widths()) + gaps > width_max:
            heads = [" ".join(head).split() for head in heads]
            if self._ends_in_text and used[-1] == len(self.heads or texts[0]) - 1:
                room = max(width_max - sum(widths()[:-1]) - gaps, *map(len, heads[-1]), len(CUT))
                columns[-1] = [_cut(text, room) for text in columns[-1]]
        depth = max(map(len, heads))
        padded = []
        for k, head, column, width in zip(used, heads, columns, widths(), strict=True):
            is_left = k < self._left_count or (self._ends_in_text and k == len(texts[0]) - 1)
            blanks = [""] * (depth - len(head))
            padded.append([_padded(text, width, is_left=is_left) for text in (*blanks, *head, *column)])
        return "\n".join(GAP.join(line).rstrip() for line in zip(*padded, strict=True))


def _cut(text: str, room: int) -> str:
    """Return a text that takes at most so much room on a terminal, and shows where it was cut."""
    from rich.cells import cell_len, set_cell_size

    return text if cell_len(text) <= room else set_cell_size(text, room - len(CUT)) + CUT


def _padded(text: str, width: int, *, is_left: bool) -> str:
    from rich.cells import cell_len

    blanks = " " * (width - cell_len(text))
    return text + blanks if is_left else blanks + text


def _safe(cell: object) -> object:
    """Return a cell of a CSV: of a text a line, with an apostrophe where a spreadsheet would take it for a formula.

    What another person has written may be a formula that sends what is in the table elsewhere.

    Example:
        >>> _safe("=1+1"), _safe("ann"), _safe(-2.5)
        ("'=1+1", 'ann', -2.5)
    """
    if not isinstance(cell, str):
        return cell
    cell = printable(cell)
    return f"'{cell}" if cell.lstrip()[:1] in ("=", "+", "-", "@", "|", "%") else cell

"""A table: the one way in which results with columns are printed, on a terminal, into a file, as CSV, and in a page."""

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

    Where a line is too long for a terminal, heads are folded and a text in the last column is cut; no name and no
    number is ever cut. Columns without a cell are left out for people, and stay in a CSV.

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
        r"""Return it as CSV that no spreadsheet takes for formulas; of None the cell is empty.

        Example:
            >>> Table(("name", "points"), [("=1+1", -2.5)]).csv()
            "name,points\n'=1+1,-2.5\n"
        """
        text = io.StringIO()
        rows: list[list[object]] = [[*self.heads], *self.rows]
        csv.writer(text, lineterminator="\n").writerows([_safe(cell) for cell in row] for row in rows)
        return text.getvalue()

    def columns(self) -> list[tuple[str, list[str], bool]]:
        """Return head and texts of each column for people, and whether it stands left; none without a cell."""
        texts = [[printable(str(cell), "?") for cell in row] for row in self.rows]
        count = len(self.heads or texts[0])
        return [
            (
                self.heads[k] if self.heads else "",
                [row[k] for row in texts],
                k < self._left_count or (self._ends_in_text and k == count - 1),
            )
            for k in range(count)
            if not texts or any(row[k] for row in texts)
        ]

    def _within(self, width_max: int | None) -> str:
        from rich.cells import cell_len, set_cell_size

        columns = self.columns()
        gaps = len(GAP) * (len(columns) - 1)
        heads = [[head] if head else [] for head, *_ in columns]
        widths = [max(map(cell_len, (head, *texts))) for head, texts, _ in columns]
        if width_max is not None and sum(widths) + gaps > width_max:
            heads = [head.split() for head, *_ in columns]
            widths = [max(map(cell_len, (*head, *texts))) for head, (_, texts, _) in zip(heads, columns, strict=True)]
            if self._ends_in_text and any(str(row[-1]) for row in self.rows):
                room = max(width_max - sum(widths[:-1]) - gaps, *map(cell_len, heads[-1]), len(CUT))
                widths[-1] = min(widths[-1], room)
        depth = max(map(len, heads))
        printed = []
        for head, (_, texts, is_left), width in zip(heads, columns, widths, strict=True):
            cells = [*[""] * (depth - len(head)), *head, *texts]
            cut = [each if cell_len(each) <= width else set_cell_size(each, width - len(CUT)) + CUT for each in cells]
            blanks = [" " * (width - cell_len(each)) for each in cut]
            printed.append([each + blank if is_left else blank + each for each, blank in zip(cut, blanks, strict=True)])
        return "\n".join(GAP.join(line).rstrip() for line in zip(*printed, strict=True))


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

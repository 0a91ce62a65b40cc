"""Tables: no name and no number is ever cut, on a terminal, in a file or in a pipe; no cell of a CSV is a formula."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from kiks.table import Table

HEADS = ("name", "found in", "evaluations", "said last")
NAMES = st.text("abé漢字", min_size=1, max_size=12)
NUMBERS = st.integers(-(10**9), 10**9) | st.floats(allow_nan=False)
ROWS = st.lists(st.tuples(NAMES, NUMBERS, NUMBERS, st.text("xyz ", min_size=1)), min_size=1)


def printed(table: Table, columns: int | None) -> list[str]:
    """Return its lines on a terminal of so many columns; in a pipe if None, where the terminal's width says nothing."""
    with pytest.MonkeyPatch.context() as changed:
        changed.setenv("COLUMNS", str(columns or 40))
        changed.setattr("sys.stdout.isatty", lambda: columns is not None)
        return table.for_output().splitlines()


@given(ROWS, st.none() | st.integers(1, 200), st.booleans())
def test_names_and_numbers_are_whole_at_any_width(
    rows: list[tuple[str, float, float, str]], columns: int | None, ends_in_text: bool
) -> None:
    table = Table(HEADS, rows, ends_in_text=ends_in_text)
    lines = printed(table, columns)
    for row, line in zip(rows, lines[-len(rows) :], strict=True):
        *numbers, text = map(str, row)
        assert line.split()[:3] == numbers
        if not ends_in_text:
            assert line.endswith(text.rstrip())
    heads = lines[: -len(rows)]
    assert {*" ".join(heads).split()} == {*" ".join(HEADS).split()}
    if columns is None:
        assert lines == str(table).splitlines()
    elif ends_in_text and (widest := max(map(cell_len, lines))) > columns:
        assert widest <= max(map(cell_len, heads)), "the text must give way until its head is the longest"


def test_columns_without_a_cell_are_left_out_and_nothing_steers_the_terminal() -> None:
    table = Table(("name", "crashed", "stopped", "said last"), [("ann\x1b[2J", "", 1, ""), ("b", "", "", "")])
    assert str(table).splitlines() == ["name     stopped", "ann?[2J        1", "b"]
    assert str(Table((), [("maze", "a wall"), ("pit", "a hole")], left_count=2)) == "maze  a wall\npit   a hole"
    assert str(Table(("name", "points"), [])) == "name  points"


def test_a_text_is_cut_in_a_list_without_a_head_too() -> None:
    table = Table((), [("maze", "a wall that is long")], ends_in_text=True)
    assert printed(table, 16) == ["maze  a wall ..."]


def test_no_cell_of_a_csv_begins_a_formula() -> None:
    texts = ("=1+1", "+1", "-1", "@sum", "\t=1", " =1", "a\r\nb\0", "ann")
    assert Table(("text",), [(text,) for text in texts]).csv().splitlines()[1:] == [
        *("'=1+1", "'+1", "'-1", "'@sum", "' =1", "' =1", "a  b ", "ann"),
    ]
    assert Table(("number",), [(-1.5,)]).csv() == "number\n-1.5\n"

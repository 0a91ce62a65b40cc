"""Two versions of a program become one: nothing of either is lost."""

from hypothesis import given
from hypothesis import strategies as st

from kiks.desk.server.merging import ALSO, LINES_MAX, merged

TEXTS = st.lists(st.sampled_from("abcde"), max_size=8).map("\n".join)


@given(TEXTS, TEXTS, TEXTS)
def test_each_line_that_somebody_wrote_is_there(before: str, one: str, other: str) -> None:
    both = merged(before, one, other).split("\n")
    plain = {line.removeprefix(ALSO) for line in both}
    assert plain >= ({*one.split("\n")} | {*other.split("\n")}) - {*before.split("\n")}
    assert merged(before, one, before) == merged(before, one, one) == one
    assert merged(before, before, other) == other


@given(TEXTS, TEXTS)
def test_what_two_pages_offer_twice_is_there_once(typed: str, other: str) -> None:
    before = "x\ny\nz"
    one, other = f"{typed}\n{before}", f"{before}\n{other}"
    both = merged(before, other, merged(before, one, before))
    assert merged(before, one, both) == merged(before, other, both) == both


def test_long_programs_are_not_compared_line_by_line() -> None:
    long = "a\n" * 50 * LINES_MAX
    assert merged(long, long + "one", long) == long + "one"
    assert ALSO in merged(long, long + "one", long + "other")

"""Messages between processes: however a stream is cut, the same requests come out."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from kiks.ports.messages import Inbox, Request, packed

NUMBERS = st.integers(-(1 << 64), 1 << 64)
ARGUMENTS = st.one_of(NUMBERS, st.none(), st.booleans(), st.binary(max_size=80), st.text(max_size=9))
REQUESTS = st.builds(
    Request,
    st.integers(1, 15),
    robot=NUMBERS,
    at_ns=NUMBERS,
    arguments=st.tuples(ARGUMENTS, st.lists(st.tuples(ARGUMENTS), max_size=2)),
)


@given(st.lists(REQUESTS, max_size=6), st.lists(st.integers(0, 800), max_size=6))
def test_requests_do_not_depend_on_how_their_bytes_are_cut(requests: list[Request], cuts: list[int]) -> None:
    stream = b"".join(packed(tuple(request)) for request in requests)
    places = sorted(min(cut, len(stream)) for cut in cuts)
    inbox, taken = Inbox(), []
    for begin, end in zip([0, *places], [*places, len(stream)], strict=True):
        taken += [Request(*fields) for fields in inbox.take(stream[begin:end])]
    assert taken == requests

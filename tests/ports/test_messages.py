"""Messages between processes: however a stream is cut, the same requests come out."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from kiks.ports.messages import Kind, Request, take_requests

NUMBERS = st.integers(-(1 << 63), (1 << 63) - 1)
REQUESTS = st.builds(
    Request,
    st.sampled_from(Kind),
    robot=st.integers(0, (1 << 16) - 1),
    at_ns=NUMBERS,
    ticket=st.integers(0, (1 << 32) - 1),
    first=NUMBERS,
    second=NUMBERS,
    third=NUMBERS,
    thought_ns=NUMBERS,
    data=st.binary(max_size=80),
)


@given(st.lists(REQUESTS, max_size=6), st.lists(st.integers(0, 800), max_size=6))
def test_requests_do_not_depend_on_how_their_bytes_are_cut(requests: list[Request], cuts: list[int]) -> None:
    stream = b"".join(request.pack() for request in requests)
    places = sorted(min(cut, len(stream)) for cut in cuts)
    buffer, taken = bytearray(), []
    for begin, end in zip([0, *places], [*places, len(stream)], strict=True):
        buffer += stream[begin:end]
        taken += take_requests(buffer)
    assert taken == requests
    assert not buffer
    assert all(isinstance(request.kind, Kind) for request in taken)

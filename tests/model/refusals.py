"""What is refused: the error, that its text is one line, what memory it takes, and a full disk."""

import resource
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from kiks.errors import ParameterError


def refused(words: str, call: Callable[..., object], *given: object, error: type[Exception] = ParameterError) -> str:
    """Call what must raise an error whose text is one line that matches some words; return that line."""
    with pytest.raises(error, match=words) as caught:
        call(*given)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@contextmanager
def traced() -> Iterator[list[int]]:
    """Give a list that afterwards holds how much memory was taken at most [bytes]."""
    peak_bytes: list[int] = []
    tracemalloc.start()
    try:
        yield peak_bytes
    finally:
        peak_bytes.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()


@contextmanager
def full_disk(bytes_left: int) -> Iterator[None]:
    """Limit the size of files, as a full disk does."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (bytes_left, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)

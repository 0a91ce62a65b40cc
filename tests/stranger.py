"""Another user of this computer, who has no rights here."""

import encodings.idna  # noqa: F401  (sockets need it, and another user may not be able to read it)
import os
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

STRANGER = 65534
"""User ID of the account `nobody`."""

needs_root = pytest.mark.skipif(os.getuid() != 0, reason="only the superuser can act as another user")


@contextmanager
def as_stranger() -> Iterator[None]:
    """Do what is in the block with the rights of another user; its sockets and files are that user's."""
    groups = os.getgroups()
    os.setgroups([])
    os.setegid(STRANGER)
    os.seteuid(STRANGER)
    try:
        yield
    finally:
        os.seteuid(0)
        os.setegid(0)
        os.setgroups(groups)

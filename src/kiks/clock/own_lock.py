"""The lock of a world: it is KiKS's, whatever locks mean to a program that lives in simulated time.

`script/locks.py` gives `RLock` other methods while a program runs. All threads of such a program are one thread of the
operating system, and hold the world together while one of them waits for its robot.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    OwnLock = threading.RLock
else:
    _Base = type(threading.RLock())

    class OwnLock(_Base):
        """A reentrant lock with the methods of `RLock` as they are now."""

    for _name, _method in list(vars(_Base).items()):
        if callable(_method) and _name not in ("__new__", "__repr__"):
            setattr(OwnLock, _name, _method)

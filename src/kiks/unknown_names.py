"""What a module says of a name that it does not have. `import kiks` loads this file, so it loads little itself."""

from __future__ import annotations

import sys

TYPE_CHECKING = False  # checkers of types take it for True by its name; `typing` itself takes 5 ms to load
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any


def hinting(
    module: str, names: Sequence[str], get: Callable[[str], Any] | None = None
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the `__getattr__` of a module that says which of its names was meant, and its `__dir__`.

    Python says so itself, but for `from MODULE import NAME` only from 3.12 on.

    Args:
        module: Its name.
        names: Its public names.
        get: Returns what a name stands for, or raises an AttributeError; no other names if left out.
    """

    def find(name: str) -> Any:
        if get is not None and name in names:
            return get(name)
        from opcode import opmap

        from kiks.meant import nearest

        public = ".".join(dict.fromkeys((module.partition(".")[0], module.rpartition(".")[2])))
        caller = sys._getframe(1)
        if caller.f_code.co_code[caller.f_lasti] == opmap["IMPORT_FROM"]:
            raise ImportError(f"cannot import name {name!r} from {public!r}.{nearest(name, names)}")
        raise AttributeError(f"module {public!r} has no attribute {name!r}", name=name, obj=sys.modules[module])

    return find, lambda: [*names]

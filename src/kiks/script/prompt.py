"""The prompt of Python's own debugger, pdb, in a run that a debugger follows: it can go back, too."""

from __future__ import annotations

from collections.abc import Callable
from pdb import Pdb
from types import FrameType
from typing import Any


class Prompt(Pdb):
    """Pdb, which gets the lines of the program from what follows them anyway.

    Args:
        watch_line: Called with the file and the line of a breakpoint.
        go_back: Goes back from a frame as a command says, or returns why that cannot be done.

    Attributes:
        follows: Whether it looks at each line, as in a step.
    """

    def __init__(self, watch_line: Callable[[str, int], None], go_back: Callable[[str, FrameType], str]) -> None:
        super().__init__(nosigint=True)
        self._watch_line, self._back = watch_line, go_back
        self.follows = False

    def open_at(self, frame: FrameType) -> None:
        """Ask a person at a line what to do."""
        self.reset()
        bottom = frame
        while bottom.f_back is not None:
            bottom = bottom.f_back
        self.botframe = bottom
        self.interaction(frame, None)

    def _set_stopinfo(self, stopframe: Any, returnframe: Any, stoplineno: int = 0, *more: Any) -> None:
        super()._set_stopinfo(stopframe, returnframe, stoplineno, *more)  # type: ignore[misc]
        self.follows = stoplineno != -1

    def set_continue(self) -> None:
        """Go on to the next breakpoint; what follows the program stays."""
        self._set_stopinfo(self.botframe, None, -1)

    def set_break(self, filename: str, lineno: int, *more: Any, **others: Any) -> Any:
        """Set a breakpoint."""
        problem = super().set_break(filename, lineno, *more, **others)
        self._watch_line(self.canonic(filename), lineno)
        return problem

    def do_back(self, text: str) -> None:
        """Back [LINE]: go back to the line before, or to the last time that a line of this file ran."""
        self._go_back(f"back {text}")

    def do_rback(self, _: str) -> None:
        """Rback: go back to the last breakpoint, or to the start."""
        self._go_back("rback")

    def do_when(self, text: str) -> None:
        """When FORMULA: go back to the line before a formula became true last, such as contacts == 3."""
        self._go_back(f"when {text}")

    def _go_back(self, command: str) -> None:
        assert self.curframe is not None
        self.error(self._back(command, self.curframe))

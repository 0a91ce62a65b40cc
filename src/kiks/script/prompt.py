"""The prompt of Python's own debugger, pdb, in a run that a debugger follows: it can go back, too."""

from __future__ import annotations

from bdb import Breakpoint
from collections.abc import Callable
from pdb import Pdb
from types import FrameType
from typing import Any

from kiks.script.refusals import is_of_kiks, is_of_program


class Prompt(Pdb):
    """Pdb as a person sees it; what follows the program steps and stops for it.

    Args:
        go_back: Goes back as a command says, or returns why that cannot be done.

    Attributes:
        has_changed: Whether a person has typed a statement, which may have changed the program.
    """

    def __init__(self, go_back: Callable[[str], str]) -> None:
        super().__init__(nosigint=True)
        self._back, self._going, self.has_changed = go_back, "continue", False

    def ask(self, frame: FrameType) -> str:
        """Ask a person at a line what to do; return it as a request of the protocol, or 'quit'."""
        self.reset()
        self._going = "continue"
        bottom = frame
        while bottom.f_back is not None:
            bottom = bottom.f_back
        self.botframe = bottom
        self.interaction(frame, None)
        for each in self.get_breaks(frame.f_code.co_filename, frame.f_lineno) or ():
            if each.temporary:
                self.clear_bpbynumber(each.number)
        return self._going

    @property
    def breakpoints(self) -> dict[str, list[dict[str, Any]]]:
        """The breakpoints of each file, as the protocol has them."""
        found: dict[str, list[dict[str, Any]]] = {}
        for each in Breakpoint.bpbynumber:
            if each is not None and each.enabled:
                found.setdefault(each.file, []).append({"line": each.line, "condition": each.cond})
        return found

    def get_stack(self, frame: Any, trace: Any) -> tuple[list[tuple[FrameType, int]], int]:
        """Return the frames as pdb has them, without those of KiKS and of what starts a program."""
        stack, at = super().get_stack(frame, trace)
        shown = [each for each in stack if not is_of_kiks(each[0].f_code.co_filename)] or stack
        while len(shown) > 1 and not is_of_program(shown[0][0].f_code.co_filename):
            shown.pop(0)
        return shown, max(at - (len(stack) - len(shown)), 0)

    def default(self, line: str) -> None:
        """Carry out a line of Python."""
        try:
            compile(line.removeprefix("!").strip(), "<stdin>", "eval")
        except SyntaxError:
            self.has_changed = True
        super().default(line)

    def set_step(self) -> None:
        """Go on to the next line."""
        self._going = "stepIn"

    def set_next(self, frame: FrameType) -> None:
        """Go on to the next line of this function."""
        self._going = "next"

    def set_until(self, frame: FrameType, lineno: int | None = None) -> None:
        """Go on so, too."""
        self._going = "next"

    def set_return(self, frame: FrameType) -> None:
        """Go on to the line after the end of this function."""
        self._going = "stepOut"

    def set_continue(self) -> None:
        """Go on to the next breakpoint."""
        self._going = "continue"

    def set_quit(self) -> None:
        """End the program."""
        self._going = "quit"

    def do_back(self, text: str) -> None:
        """Back [LINE]: go back to the line before, or to the last time that a line of this file ran."""
        self.error(self._back(f"back {text}"))

    def do_rback(self, _: str) -> None:
        """Rback: go back to the last breakpoint, or to the start."""
        self.error(self._back("rback"))

    def do_when(self, text: str) -> None:
        """When FORMULA: go back to the line before a formula became true last, such as contacts == 3."""
        self.error(self._back(f"when {text}"))

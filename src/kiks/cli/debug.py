"""`kiks run --debug`: a run that an editor follows, and that is made again to go back in it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from kiks.cli.options import say

if TYPE_CHECKING:
    from kiks.ports.programs import Programs
    from kiks.run import Run

PORT = 5678
"""The port that editors try first; it is debugpy's, too."""

WithDebugger = Annotated[
    bool,
    typer.Option(
        "--debug",
        help=f"Wait for an editor such as VS Code, at port {PORT} or at the one that follows (--debug 5679): it "
        "stops the run, world and all, and goes back in it. With --no-wait the run begins at once, and breakpoint() "
        "opens pdb.",
    ),
]
DebugPort = Annotated[int, typer.Option("--debug-port", hidden=True, min=0, max=65535)]


class Debugging:
    """What follows the programs of a run.

    Args:
        port: The port for editors.
        waits: Whether the run waits for an editor.

    Attributes:
        goes_again: Whether the run that has ended is made again.
    """

    def __init__(self, port: int, *, waits: bool) -> None:
        from kiks.debug.adapter import Adapter
        from kiks.debug.session import DebugSession

        self.goes_again = False
        self._programs: Programs | None = None
        self._session = DebugSession(self._tell, self._make_again)
        self._adapter = Adapter(port, self._session, self._end)
        if waits:
            say(
                f"waiting for an editor at 127.0.0.1:{self._adapter.port}. In VS Code: Run and Debug, Python Debugger, "
                "Attach. --no-wait begins at once."
            )
            self._adapter.is_configured.wait()

    def take_programs(self, run: Run, **options: Any) -> Programs:
        """Make what runs the programs of a run; see `Run.take_programs`."""
        self.goes_again = False
        self._programs = run.take_programs(consult=self._session.consult, **options)
        self._session.begin(run)
        return self._programs

    def close(self, code: int) -> None:
        """Tell the editor that the run has ended."""
        self._session.forget()
        self._adapter.close(code)

    def _tell(self, event: str, body: dict[str, Any]) -> None:
        self._adapter.tell(event, body)

    def _make_again(self) -> None:
        assert self._programs is not None
        self.goes_again = True
        self._programs.end_soon(0, "")

    def _end(self) -> None:
        if self._programs is not None:
            self._programs.end_soon(0, "the editor has ended the run.")

"""What the log says, as lines on the terminal."""

from __future__ import annotations

import logging

import typer


class _Lines(logging.Handler):
    """A line on the error output for each entry."""

    def emit(self, record: logging.LogRecord) -> None:
        typer.echo(f"kiks: {self.format(record)}", err=True)


def show_log(*, is_quiet: bool = False) -> None:
    """Show who comes and goes, and what goes wrong; if quiet, what goes wrong alone."""
    log = logging.getLogger("kiks")
    log.handlers = [_Lines()]
    log.setLevel(logging.WARNING if is_quiet else logging.INFO)

"""The word to the person who waits: the first start compiles the engine."""

from __future__ import annotations

import typer


def note_compiling() -> None:
    """Say on the terminal that the engine is being compiled, if it is not in the cache."""
    from kiks.engine.compiling import is_compiled

    if not is_compiled():
        typer.echo("Compiling the engine for this computer: once, ten seconds or so ...", err=True)

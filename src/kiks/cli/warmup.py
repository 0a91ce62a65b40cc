"""`kiks warmup`."""

from __future__ import annotations

import typer

from kiks.cli.engine_start import compile_all


def warmup() -> None:
    """Compile the engine now, so that the next start is fast.

    Example: kiks warmup
    """
    from time import perf_counter

    start_s = perf_counter()
    compile_all()
    typer.echo(f"The engine is ready ({perf_counter() - start_s:.1f} s).")

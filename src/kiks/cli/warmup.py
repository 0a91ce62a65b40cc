"""`kiks warmup`."""

from __future__ import annotations

import typer

from kiks.cli.engine_start import compile_all, compile_batch, compile_everything


def warmup() -> None:
    """Compile the engine and the batch now, so the next start is fast.

    Example: kiks warmup
    """
    from time import perf_counter

    from kiks.engine.code_cache import is_compiled
    from kiks.engine.compiling import LAST

    start_s = perf_counter()
    if is_compiled(LAST) and is_compiled("roll_out"):
        compile_everything()
        compile_batch()
    else:
        typer.echo("Compiling the engine and the batch for this computer: once, a minute or so ...", err=True)
        compile_all()
    typer.echo(f"The engine is ready ({perf_counter() - start_s:.1f} s).")

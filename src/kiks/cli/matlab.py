"""`kiks matlab`."""

from __future__ import annotations

import typer

from kiks.cli.options import shipped_folder


def matlab() -> None:
    """Print the line that lets Octave and MATLAB find the toolbox; type it there, or put it into your startup file.

    Example: octave --eval "$(kiks matlab) kiks; follow"
    """
    folder = shipped_folder("matlab", "kiks.m")
    typer.echo(f"addpath('{folder}'); addpath('{folder / 'demos'}');")

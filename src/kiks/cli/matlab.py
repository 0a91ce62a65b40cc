"""`kiks matlab`."""

from __future__ import annotations

import typer

from kiks.cli.options import shipped_folder


def matlab() -> None:
    """Print the line that adds the toolbox to the path of Octave and MATLAB: type it there, or put it into startup.m.

    Example: octave --eval "$(kiks matlab) kiks; follow"
    """
    folder = shipped_folder("matlab", "kiks.m")
    typer.echo(f"addpath('{folder}'); addpath('{folder / 'demos'}');")

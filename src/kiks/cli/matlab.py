"""`kiks matlab`."""

from __future__ import annotations

import typer


def matlab() -> None:
    """Print the line that adds the toolbox to Octave or MATLAB.

    Type it there, or put it into startup.m.

    Example: octave --eval "$(kiks matlab) kiks; follow"
    """
    from kiks.model.package import shipped

    folder = shipped("matlab")
    typer.echo(f"addpath('{folder}'); addpath('{folder / 'demos'}');")

"""`kiks matlab`."""

from __future__ import annotations

from pathlib import Path

import typer

import kiks


def matlab() -> None:
    """Print the line that lets Octave and MATLAB find the toolbox; type it there, or put it into your startup file.

    Example: octave --eval "$(kiks matlab) kiks; follow"
    """
    typer.echo(f"addpath('{toolbox_folder()}'); addpath('{toolbox_folder() / 'demos'}');")


def toolbox_folder() -> Path:
    """Return the folder of the toolbox: in the package, or beside the source where that is used as it is."""
    package = Path(kiks.__file__).parent
    folders = (package / "matlab", package.parents[1] / "matlab")
    return next((folder for folder in folders if (folder / "kiks.m").is_file()), folders[0])

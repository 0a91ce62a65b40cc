"""Where the files lie that come with KiKS."""

from __future__ import annotations

from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1]
"""The folder of KiKS itself."""


def shipped(name: str) -> Path:
    """Return the path of a file or folder that comes with KiKS, by its path from the root of a checkout."""
    places = (PACKAGE / name, PACKAGE.parents[1] / name)
    return next((place for place in places if place.exists()), places[0])


def where_from(path: str | Path, otherwise: str) -> str:
    """Return what to do about a missing file: one of the examples can be copied; of any other, what `otherwise` says.

    Example:
        >>> where_from("examples/programs/wander.py", "Check the name.")
        'It is an example of KiKS: `kiks examples examples` copies all of them here.'
        >>> where_from("wander.py", "Check the name.")
        'Check the name.'
    """
    path = Path(path)
    if path.parts[:1] == ("examples",) and (shipped(str(path)).exists() or not Path("examples").exists()):
        return "It is an example of KiKS: `kiks examples examples` copies all of them here."
    return otherwise

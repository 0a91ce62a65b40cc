"""What a recording becomes: one table, by the ending of a file's name.

A kind is a function of a recording and a path, which writes the file. Its keyword arguments are the kind's options, so
a new kind is a row in this table.
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from kiks.errors import ParameterError, shown
from kiks.meant import nearest
from kiks.model.atomic_files import ending_of
from kiks.model.checks import check_choice

if TYPE_CHECKING:
    from kiks.recording.recording import Recording


class Kind(NamedTuple):
    """A kind of file.

    Attributes:
        module: Where the function is that writes it; it is imported when it is needed.
        function: Its name.
        endings: Those that the file may have.
    """

    module: str
    function: str
    endings: tuple[str, ...]


KINDS = {
    "film": Kind("film", "save_film", (".mp4", ".gif", ".webp")),
    "picture": Kind("pictures", "save_picture", (".png", ".svg", ".pdf", ".jpg")),
    "figures": Kind("figures", "save_figures", (".png", ".svg", ".pdf")),
    "photo": Kind("photo", "save_photo", (".png", ".jpg")),
    "table": Kind("tables", "save_table", (".csv", ".parquet", ".mat")),
    "page": Kind("page", "save_page", (".html",)),
}
"""All kinds; of several with one ending, the first is the usual one."""

ENDINGS = tuple(dict.fromkeys(ending for kind in KINDS.values() for ending in kind.endings))


def export(
    recording: Recording | Sequence[Recording], path: str | Path, *, kind: str | None = None, **options: Any
) -> None:
    """Write a file of a recording: a film, a picture, figures, a photo, a table or a page.

    Args:
        recording: The recording; figures may be of several, side by side.
        path: The file, whose ending says what it becomes.
        kind: 'film', 'picture', 'figures', 'photo', 'table' or 'page', where an ending leaves a choice: a .png is a
            picture from above if left out.
        options: Those of the kind: the keyword arguments of `save_film`, `save_picture` and so on.

    Example:
        >>> import tempfile, kiks
        >>> folder = Path(tempfile.mkdtemp())
        >>> sim = kiks.Simulation(kiks.Arena.box(300, 300))
        >>> with sim.record(folder / "run.mcap"):
        ...     sim.run(1.0)
        >>> export(kiks.Recording(folder / "run.mcap"), folder / "run.csv", table="wheels")
        >>> (folder / "run.csv").read_text()[:12]
        'time_s,robot'
    """
    kind = kind_of(path, kind)
    known = options_of(kind)
    for name, value in options.items():
        if name not in known:
            raise ParameterError(
                f"{name} must be left out of a {kind}, but it was {shown(value)}.{nearest(name, known)}"
            )
    recordings = [*recording] if isinstance(recording, Sequence) else [recording]
    if kind != "figures" and len(recordings) != 1:
        raise ParameterError(
            f"a {kind} must be of one recording, but there are {len(recordings)}. The kind 'figures' shows several."
        )
    _function(kind)(recordings if kind == "figures" else recordings[0], path, **options)


def kind_of(path: str | Path, kind: str | None = None) -> str:
    """Return which kind a file is: the given one, or the usual one of its ending."""
    if kind is None:
        ending = ending_of(path, "the file", ENDINGS)
        return next(name for name, each in KINDS.items() if ending in each.endings)
    check_choice("kind", kind, KINDS)
    ending_of(path, f"a {kind}", KINDS[kind].endings)
    return kind


def options_of(kind: str) -> list[str]:
    """Return the names of the options that a kind has."""
    parameters = inspect.signature(_function(kind)).parameters.values()
    return [each.name for each in parameters if each.kind is each.KEYWORD_ONLY]


def _function(kind: str) -> Callable[..., object]:
    function: Callable[..., object] = getattr(
        importlib.import_module(f"kiks.export.{KINDS[kind].module}"), KINDS[kind].function
    )
    return function

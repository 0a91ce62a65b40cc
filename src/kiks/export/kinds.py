"""What a recording or an evolution becomes: one table, by the ending of a file's name.

A kind is a function of what is exported and a path, which writes the file. Its keyword arguments are the kind's
options, so a new kind is a row in this table.
"""

from __future__ import annotations

from collections.abc import Sequence
from inspect import Parameter, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from kiks.errors import ParameterError, shown
from kiks.meant import nearest
from kiks.model.atomic_files import ending_of
from kiks.model.checks import check_choice
from kiks.upwards import Hook

if TYPE_CHECKING:
    from kiks.recording.recording import Recording


SOURCES = RECORDING, EVOLUTION, CHAMPION = "a recording", "the folder of an evolution", "a champion's file"
"""What files are made of."""


class ExportKind(NamedTuple):
    """A kind of file.

    Attributes:
        write: The function that writes it.
        endings: Those that the file may have.
        source: What it is made of: one of `SOURCES`.
    """

    write: Hook
    endings: tuple[str, ...]
    source: str = RECORDING


FILMS = (".mp4", ".gif", ".webp")
"""Endings of films."""

KINDS = {
    "film": ExportKind(Hook("kiks.export.film", "save_film"), FILMS),
    "picture": ExportKind(Hook("kiks.export.pictures", "save_picture"), (".png", ".svg", ".pdf", ".jpg")),
    "figures": ExportKind(Hook("kiks.export.figures", "save_figures"), (".png", ".svg", ".pdf")),
    "photo": ExportKind(Hook("kiks.export.photo", "save_photo"), (".png", ".jpg")),
    "table": ExportKind(Hook("kiks.export.tables", "save_table"), (".csv", ".parquet", ".mat")),
    "page": ExportKind(Hook("kiks.export.page", "save_page"), (".html",)),
    "ghosts": ExportKind(Hook("kiks.learn.ghosts", "save_ghosts"), (*FILMS, ".png"), EVOLUTION),
    "ghost page": ExportKind(Hook("kiks.learn.ghosts", "save_ghost_page"), (".html",), EVOLUTION),
    "champion page": ExportKind(Hook("kiks.learn.champion_page", "save_champion_page"), (".html",), CHAMPION),
}
"""All kinds; of several with one ending, the first is the usual one."""

ENDINGS = tuple(dict.fromkeys(ending for kind in KINDS.values() for ending in kind.endings))


def export(
    source: Recording | Sequence[Recording] | str | Path, path: str | Path, *, kind: str | None = None, **options: Any
) -> None:
    """Write a file of a recording: a film, a picture, figures, a photo, a table or a page; of an evolution, ghosts.

    Args:
        source: The recording, several for figures side by side, the folder of an evolution, or a champion's file.
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
    kind = export_kind(path, kind, source_of(source) if isinstance(source, str | Path) else RECORDING)
    known = option_names(kind)
    for name, value in options.items():
        if name not in known:
            raise ParameterError(
                f"{name} must be left out of {with_article(kind)}, but it was {shown(value)}.{nearest(name, known)}"
            )
    if not isinstance(source, str | Path):
        recordings = [*source] if isinstance(source, Sequence) else [source]
        if kind != "figures" and len(recordings) != 1:
            raise ParameterError(
                f"a {kind} must be of one recording, but there are {len(recordings)}. The kind 'figures' shows several."
            )
        source = recordings if kind == "figures" else recordings[0]
    KINDS[kind].write(source, path, **options)


def source_of(file: str | Path) -> str:
    """Return which of `SOURCES` a file or folder is, by its name."""
    if Path(file).is_dir():
        return EVOLUTION
    return CHAMPION if Path(file).suffix == ".toml" else RECORDING


def export_kind(path: str | Path, kind: str | None = None, source: str = RECORDING) -> str:
    """Return which kind a file is: the given one, or the usual one of its ending, among those of one of `SOURCES`."""
    known = {name: each for name, each in KINDS.items() if each.source == source}
    if kind is None:
        ending = ending_of(
            path, "the file", dict.fromkeys(ending for each in known.values() for ending in each.endings)
        )
        return next(name for name, each in known.items() if ending in each.endings)
    check_choice("kind", kind, known)
    ending_of(path, f"a {kind}", KINDS[kind].endings)
    return kind


def with_article(kind: str) -> str:
    """Return the name of a kind as a sentence has it: a film, figures."""
    return kind if kind.endswith("s") else f"a {kind}"


def option_names(kind: str) -> list[str]:
    """Return the names of the options that a kind has."""
    parameters = signature(KINDS[kind].write.function()).parameters.values()
    return [each.name for each in parameters if each.kind is Parameter.KEYWORD_ONLY]

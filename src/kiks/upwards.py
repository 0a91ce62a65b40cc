"""Calls that lead from a lower folder to a higher one, without an import upwards.

A lower file calls a hook, which names the function behind it as text. That function is imported at the first call, so
heavy libraries are loaded only where they are used.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeVar

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Kind = TypeVar("Kind")


class Hook:
    """A function of a higher folder.

    Args:
        module: The module in which it is.
        name: Its name there.

    Example:
        >>> root = Hook("math", "sqrt")
        >>> root(9.0)
        3.0
    """

    def __init__(self, module: str, name: str) -> None:
        self._module, self._name = module, name

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call the function."""
        return self.function()(*args, **kwargs)

    def function(self) -> Callable[..., Any]:
        """Return the function."""
        found: Callable[..., Any] = getattr(importlib.import_module(self._module), self._name)
        return found


def shown_in_notebooks(module: str, name: str) -> Callable[[type[Kind]], type[Kind]]:
    """Return a decorator of a class whose objects notebooks show as a picture or a table.

    Args:
        module: The module of a function that draws an object.
        name: Its name. It returns what Jupyter calls a MIME bundle: data by their types, and sizes.

    Example:
        >>> @shown_in_notebooks("kiks.export.notebook", "arena")
        ... class Room:
        ...     pass
        >>> hasattr(Room(), "_repr_mimebundle_")
        True
    """
    draw = Hook(module, name)

    def decorate(kind: type[Kind]) -> type[Kind]:
        # Jupyter names types that it wants; it takes what it gets.
        kind._repr_mimebundle_ = lambda self, include=None, exclude=None: draw(self)  # type: ignore[attr-defined]
        return kind

    return decorate


class OpenRecording(Protocol):
    """Records a simulation into a file until `close`, or the end of `with`."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...

    def mark(self, note: str) -> None:
        """Write a bookmark."""

    def close(self) -> None:
        """End the recording."""


class View(Protocol):
    """A simulation that is shown in a browser until `close`."""

    url: str

    def close(self) -> None:
        """End it."""


load_arena_file = Hook("kiks.model.project", "load_arena_file")
"""Reads an arena from a file by its suffix."""

fill_distances = Hook("kiks.engine.wall_tables", "fill_distances")
"""Computes how far the cells of an arena are from walls."""

fill_faces = Hook("kiks.engine.wall_tables", "fill_faces")
"""Computes where the surface of an arena's walls runs."""

copy_simulation: Callable[..., tuple[Any, ...]] = Hook("kiks.sim.saved_state", "reduced")
"""Returns how `copy` and `pickle` make a simulation in the same state."""

show_in_browser: Callable[..., View] = Hook("kiks.desk.server.show", "show")
"""Opens a simulation on a desk."""

record_simulation: Callable[..., OpenRecording] = Hook("kiks.recording.recorder", "RunRecorder")
"""Records a simulation to a file."""

plot_simulation: Callable[..., Figure] = Hook("kiks.export.notebook", "plot_run")
"""Draws figures of a simulation that is being recorded."""

plot_recordings: Callable[..., Figure] = Hook("kiks.export.notebook", "plot")
"""Draws figures of recordings."""

run_octave: Callable[..., int] = Hook("kiks.toolbox.octave_program", "run_octave")
"""Runs a program of Octave to its end."""

save_columns = Hook("kiks.export.tables", "save_columns")
"""Writes a table of any columns."""

export_recording = Hook("kiks.export.kinds", "export")
"""Writes a film, a picture, figures, a photo, a table or a page of a recording."""

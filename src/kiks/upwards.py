"""Calls that lead from a lower folder to a higher one, without an import upwards.

A lower file calls a hook. `kiks/__init__.py`, which is above all folders, says which function is behind it. That
function is imported at the first call, so heavy libraries are loaded only where they are used.
"""

from __future__ import annotations

import importlib
from typing import Any


class Hook:
    """A function that a higher folder provides.

    Example:
        >>> root = Hook()
        >>> root.provide("math", "sqrt")
        >>> root(9.0)
        3.0
    """

    def __init__(self) -> None:
        self._home: tuple[str, str] | None = None

    def provide(self, module: str, name: str) -> None:
        """Say in which module the function is, and its name there."""
        self._home = module, name

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call the function."""
        assert self._home is not None, "kiks/__init__.py provides all hooks"
        module, name = self._home
        return getattr(importlib.import_module(module), name)(*args, **kwargs)


load_arena_file = Hook()
"""Reads an arena from a file by its suffix."""

draw_for_notebook = Hook()
"""Draws an arena, a simulation, or the figures of a recording for a notebook."""

show_in_browser = Hook()
"""Opens a simulation on a desk."""

record_simulation = Hook()
"""Records a simulation to a file."""

plot_simulation = Hook()
"""Draws figures of a simulation that is being recorded."""

plot_recordings = Hook()
"""Draws figures of recordings."""

export_recording = Hook()
"""Writes a film, a picture, figures, a photo, a table or a page of a recording."""

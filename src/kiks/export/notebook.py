"""What notebooks show."""

from __future__ import annotations

from kiks.export.figures import COLUMN_INCHES, figure_of, file_of
from kiks.export.pictures import Picture
from kiks.model.arena import Arena
from kiks.recording.recording import Recording
from kiks.sim.simulation import Simulation


def for_notebook(thing: Arena | Simulation | Recording) -> tuple[bytes, dict[str, int]]:
    """Return a picture of an arena or a simulation, or the figures of a recording: a PNG, and how large it is shown."""
    if isinstance(thing, Recording):
        return file_of(figure_of([thing]), "png"), {"width": round(COLUMN_INCHES * 96)}
    if isinstance(thing, Arena):
        return Picture.of_arena(thing).for_notebook()
    with thing.lock:
        picture = Picture.of_simulation(thing)
    return picture.for_notebook()

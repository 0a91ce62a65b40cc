"""The film that a program makes of a session's world, from when it opens a port until it closes it."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

from kiks.export.film import check_film, save_film
from kiks.model.atomic_files import check_writable
from kiks.recording.recorder import RunWriter
from kiks.recording.recording import Recording
from kiks.recording.ring import Ring
from kiks.sim.simulation import Simulation

_log = logging.getLogger("kiks.film")


class SessionFilm:
    """Records a world from now on, and makes a film of it in the end.

    Args:
        sim: The world.
        path: The film's file, .mp4, .gif or .webp.
        robot: Number of the robot whose readings are shown.
    """

    def __init__(self, sim: Simulation, path: Path, robot: int) -> None:
        check_film(path)
        check_writable(path, "a film")
        self._path, self._robot = path, robot
        self._ring = Ring(sim, _log.warning)
        self._writer = RunWriter.of(sim)
        self._writer.add(self._ring)

    def save(self, on_progress: Callable[[float], object]) -> int:
        """End the film with the present state, make it, and return the number of its pictures.

        Args:
            on_progress: See `save_film`.
        """
        if self._ring in self._writer.stores:
            self._writer.flush()
            self._writer.remove(self._ring)
        return save_film(Recording(self._ring), self._path, robot=self._robot, on_progress=on_progress)

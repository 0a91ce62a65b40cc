"""The cameras of a world: which robots carry one, when each takes its pictures, and what they show."""

from __future__ import annotations

from functools import partial

import numpy as np

from kiks.engine.sensing import camera
from kiks.engine.state import PIXEL_COUNT
from kiks.firmware.k213 import K213, Picture
from kiks.sim.world import World
from kiks.units import TICK_NS


class Cameras:
    """K213 turrets on robots.

    Pictures are taken when the time is a multiple of a camera's reading period. All periods are whole ticks, so the
    engine stops there, on a tick's boundary, however often the state is read.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._fitted: dict[int, K213] = {}
        self._pixels = np.zeros(PIXEL_COUNT, np.float64)

    def __bool__(self) -> bool:
        return bool(self._fitted)

    def fit(self, index: int, camera: K213) -> None:
        """Let a robot's camera take its pictures from now on, and the first at once."""
        self._fitted[index] = camera
        camera.take = partial(self._take, index)
        camera.look(self._world.now_ns)

    def sync(self) -> None:
        """Let each camera take the last of its pictures that is due; a program cannot ask for earlier ones.

        After a change of the period the engine may have passed an instant already: no picture is taken of the past.
        """
        world = self._world
        now_ns, fitted = world.now_ns, self._fitted
        due = [(due_ns, index) for index, each in fitted.items() if (due_ns := each.due_ns(now_ns)) >= 0]
        # In the order of time: the engine cannot go back for a picture that was due earlier.
        for due_ns, index in sorted(due):
            if due_ns >= world.state.tick_count * TICK_NS:
                world.tick_to(due_ns)
                fitted[index].look(due_ns)

    def retake(self) -> None:
        """Take those pictures again that were taken at this instant, before something was moved."""
        for fitted in self._fitted.values():
            if fitted.taken_ns == self._world.now_ns:
                fitted.look(fitted.taken_ns)

    def expect(self, index: int) -> list[float]:
        """Return what a camera would see now, without noise or rounding."""
        self._kernel(index, self._world.now_ns, is_noisy=False)
        return [float(grey) for grey in self._pixels]

    def _take(self, index: int, time_ns: int) -> Picture:
        light = self._kernel(index, time_ns, is_noisy=self._world.specs[index].is_noisy)
        greys = np.rint(self._pixels, out=self._pixels)
        return np.minimum(np.maximum(greys, 0.0, out=greys), 255.0, out=greys).astype(np.uint8), light

    def _kernel(self, index: int, time_ns: int, *, is_noisy: bool) -> int:
        world = self._world
        light: int = camera.take_image(world.scene, index, world.state.tick_count, time_ns, is_noisy, self._pixels)
        return light

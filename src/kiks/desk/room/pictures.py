"""Small pictures of a desk's world, for a page that shows many desks."""

from __future__ import annotations

import io

from kiks.desk.server.desk import Desk
from kiks.export.looks import lit_leds
from kiks.export.stage import Canvas, arena_canvas
from kiks.sim.simulation import Simulation

SIZE = (256, 192)
"""Most pixels of a picture, across and down."""


class Pictures:
    """Draws the world that a desk shows; walls and lamps once, until they change.

    Args:
        desk: The desk.
    """

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._drawn: tuple[object, ...] = ()

    async def draw(self) -> bytes:
        """Return a picture of this moment as a JPEG."""
        from PIL import Image

        arena, lamps, specs, poses, bodies, lit = await self._desk.do(_look)
        if self._drawn != (drawn := (arena, lamps.tobytes())):
            scale = min(SIZE[0] / arena.width_mm, SIZE[1] / arena.height_mm)
            self._ground = arena_canvas(arena, lamps, specs, scale)
            self._drawn = drawn
        canvas = Canvas(self._ground.pixels.copy(), self._ground.scale, 0.0, arena.height_mm)
        canvas.draw_things(bodies, poses, specs, lit)
        data = io.BytesIO()
        Image.fromarray(canvas.pixels).save(data, "JPEG", quality=85)
        return data.getvalue()


def _look(sim: Simulation):  # type: ignore[no-untyped-def] # the parts of a world
    lit = lit_leds(sim.specs, sim.world.state.robots[0]).tolist()
    return sim.arena, sim.world.lamps.copy(), tuple(sim.specs), sim.poses().copy(), sim.bodies(), lit

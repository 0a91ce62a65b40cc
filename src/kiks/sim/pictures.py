"""What the colour camera of a robot sees."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kiks.engine.sensing.colour_camera import take_picture
from kiks.model.window import Window
from kiks.sim.colours import LAMPLIGHT, body_colour, robot_colour
from kiks.sim.world import World


def picture(world: World, index: int, window: Window) -> NDArray[np.uint8]:
    """Return what a robot sees now through a window on its sensor: red, green and blue, uint8 [height, width, 3].

    The ticks are done. Row 0 is the uppermost.
    """
    robots, bodies = map(robot_colour, range(world.robot_count)), map(body_colour, world.state.bodies[0])
    colours = np.array([*robots, *bodies, LAMPLIGHT], np.uint8)
    pixels = np.empty((window.height, window.width, 3), np.uint8)
    given = colours, window.x, window.y, window.zoom
    take_picture(world.scene, index, world.state.tick_count, world.now_ns, *given, pixels)
    return pixels

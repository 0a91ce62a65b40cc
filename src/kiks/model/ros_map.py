"""Maps of ROS: a picture with black walls, and a file that says what its greys mean.

The keys are those of wiki.ros.org/map_server, section 1.1; what the modes mean is as in nav2_map_server's map_io.cpp.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field

from kiks.errors import ArenaError, KiksError, ParameterError
from kiks.model.arena import Arena
from kiks.model.arena_doubts import check_has_floor, doubt_colours
from kiks.model.atomic_files import within
from kiks.model.data_file import Number, Text, check, one_line, read_file, record
from kiks.model.picture import Pixels, read_picture

Share = Annotated[Number, Field(ge=0, le=1)]

UNKNOWN_GREY = 205
"""What the map_savers of ROS and of Nav2 write for unknown in mode trinary, whatever the thresholds are."""

KNOWN_FREE = "what the map does not know to be free is wall. Its keys mode, negate and free_thresh say what that is."


@record
class RosMap:
    """The file of a map.

    Attributes:
        image: The picture, in the folder of the file or below.
        resolution: Edge of a pixel [m].
        origin: Place of the lower left pixel [m], which an arena ignores, as it has its own coordinates; and how far
            the map is turned to the left [rad].
        negate: Whether white is occupied, and not black.
        occupied_thresh: Pixels that are occupied with more than this probability are walls.
        free_thresh: Pixels that are occupied with less are free.
        mode: How greys are read: as probabilities ('trinary' and 'scale'), or as 0 to 100 % and unknown ('raw').
    """

    image: Text
    resolution: Annotated[Number, Field(gt=0, le=0.1)]
    occupied_thresh: Share
    free_thresh: Share
    origin: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)
    negate: Literal[0, 1] = 0
    mode: Literal["trinary", "scale", "raw"] = "trinary"

    def __post_init__(self) -> None:
        if self.negate and self.mode == "raw":
            raise ParameterError("negate must be 0 in mode raw, where greys are no shades, but it was 1. Write 0.")

    def walls(self, pixels: Pixels) -> npt.NDArray[np.bool_]:
        """Return which pixels are not known to be free: bool [row, column]; what is transparent is not."""
        from PIL import Image

        grey = 255 - pixels.grey if self.negate else pixels.grey
        if self.mode == "raw":
            is_free = grey < 100 * self.free_thresh
        else:
            is_free = (255 - grey) / 255 < self.free_thresh
        if self.mode == "trinary":
            is_free &= grey != UNKNOWN_GREY
        walls: npt.NDArray[np.bool_] = ~(is_free & (pixels.opacity == 255))
        if not (turn_deg := round(math.degrees(self.origin[2]), 3)):
            return walls
        image = Image.fromarray(walls.astype(np.uint8))
        return np.asarray(image.rotate(turn_deg, expand=True, fillcolor=1)).astype(np.bool_)


def load_ros_map(path: Path) -> Arena:
    """Read a map: what is not known to be free, as between the rooms of a building, is a wall."""
    import yaml

    what = f"Map {str(path)!r}"
    data = read_file(path, what, error=ArenaError)
    try:
        table: Any = yaml.safe_load(data)
    except (yaml.YAMLError, ValueError, RecursionError) as failure:
        raise ArenaError(f"{what} must be YAML, but: {one_line(failure)}. Correct the file at that place.") from None
    try:
        given = check(RosMap, table, what, error=ArenaError)
        mm_per_pixel = 1000 * given.resolution
        walls = given.walls(read_picture(within(path.parent, given.image, "image"), mm_per_pixel))
        check_has_floor(walls, KNOWN_FREE)
        arena = Arena.from_array(walls, mm_per_pixel=mm_per_pixel, name=path.stem)
    except KiksError as error:
        raise ArenaError(f"{what}: {error}") from None
    doubt_colours(arena, path, KNOWN_FREE)
    return arena

"""Maps of ROS: a picture with black walls, and a file that says what its greys mean.

The keys are those of wiki.ros.org/map_server, section 1.1.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from kiks.errors import ArenaError, ParameterError
from kiks.model.arena import Arena
from kiks.model.atomic_files import within
from kiks.model.data_file import Number, Text, check, one_line, read_file, record
from kiks.model.picture import read_picture

Share = Annotated[Number, Field(ge=0, le=1)]


@record
class RosMap:
    """The file of a map.

    Attributes:
        image: The picture, in the folder of the file or below.
        resolution: Edge of a pixel [m].
        origin: Place of the lower left pixel [m] and its turn; an arena has its own coordinates.
        negate: Whether white is occupied, and not black.
        occupied_thresh: Pixels that are occupied with more than this probability are walls.
        free_thresh: Pixels that are occupied with less are free.
        mode: How greys are read.
    """

    image: Text
    resolution: Annotated[Number, Field(gt=0, le=0.1)]
    occupied_thresh: Share
    free_thresh: Share
    origin: tuple[Number, ...] = ()
    negate: Literal[0, 1] = 0
    mode: Literal["trinary", "scale", "raw"] = "trinary"


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
        grey = read_picture(within(path.parent, given.image, "image"), 1000 * given.resolution).astype(np.float64)
    except ParameterError as error:
        raise ArenaError(f"{what}: {error}") from None
    occupied = (grey if given.negate else 255.0 - grey) / 255.0
    return Arena.from_array(occupied >= given.free_thresh, mm_per_pixel=1000 * given.resolution, name=path.stem)

"""The scene: all that kernels know of some worlds, in one argument.

Python hands kernels a record with the addresses of the arrays (`SCENE`), because opening it costs as much as opening
one array. `Scene` makes the record and keeps its arrays alive; an entry point opens it with `open_scene`.

Discs are numbered from 0, robots first, then bodies (balls and cylinders).
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kiks.engine.compiling import entry, make_ready
from kiks.engine.grid import CROWD, NEIGHBOURS, PAIRS_PER_DISC, SIGHT_SLACK_MM, Grid, enter_all, squares_of
from kiks.engine.parameters import PARAMETERS
from kiks.engine.physics.contact import Ground
from kiks.engine.sensing.floor_spots import plains_of
from kiks.engine.sensing.rays import Walls, walls_of
from kiks.engine.sensing.thesis_networks import NETWORKS
from kiks.engine.simd.addresses import ArrayRecord, address_field, address_of_array, opener
from kiks.engine.state import BODY, ROBOT, State
from kiks.model.arena import Arena

_INTEGER, _COUNT, _SMALL, _BYTE = np.dtype(np.int64), np.dtype(np.int32), np.dtype(np.int16), np.dtype(np.uint8)
_NUMBER, _NARROW = np.dtype(np.float64), np.dtype(np.float32)

_ARRAYS: dict[str, tuple[Any, int]] = {
    "robots": (ROBOT, 2),
    "bodies": (BODY, 2),
    "kinds": (PARAMETERS, 1),
    "begins": (_COUNT, 3),
    "entries": (_COUNT, 2),
    "spots": (_NUMBER, 3),
    "pairs": (_COUNT, 3),
    "neighbours": (_COUNT, 3),
    "places": (_NUMBER, 3),
    "crowds": (CROWD, 1),
    "clearance": (_NARROW, 2),
    "rooms": (_NARROW, 2),
    "brightness": (_BYTE, 2),
    "leaps": (_SMALL, 2),
    "faces": (_COUNT, 2),
    "networks": (NETWORKS, 1),
    "lamps": (_NUMBER, 3),
    "seeds": (_INTEGER, 1),
    "floor": (_BYTE, 2),
    "plains": (_SMALL, 2),
}

ALL_WHITE = np.full((1, 1), 255, np.uint8)
"""A floor of one brightness."""

MEETING = "meeting"
"""The part of the engine that a lone robot without a gripper does not need."""

SCENE = np.dtype(
    [address_field(name, dimensions) for name, (_, dimensions) in _ARRAYS.items()]
    + [("widest_mm", np.float64), ("sight_mm", np.float64), ("cell_mm", np.float64), ("pad", np.int64)]
)
"""The record that stands for a scene."""


OPEN_SCENE = ArrayRecord(
    SCENE, {name: element for name, (element, _) in _ARRAYS.items()}, {"grid": Grid, "ground": Ground, "walls": Walls}
)
"""Numba's type of an open scene."""

open_scene = opener(OPEN_SCENE)
"""Return the open scene, whose names are those of `SCENE`, from the record that Python hands to a kernel.

* robots: records of `ROBOT`, shape [world, robot];
* bodies: records of `BODY`, shape [world, body];
* kinds: records of `PARAMETERS`, one for each kind of robot; a robot's `kind` is the index of its own;
* grid: the grid that finds neighbours (`kiks.engine.grid.Grid`);
* ground: the walls as contact sees them (`kiks.engine.physics.contact.Ground`);
* walls: the walls as rays see them (`kiks.engine.sensing.rays.Walls`);
* networks: a record of `kiks.engine.sensing.thesis_networks.NETWORKS`, or none if no response needs it;
* lamps: x [mm], y [mm], power [W] and 1 for on or 0 for off, float64 [world, lamp, 4];
* seeds: seeds of the worlds, int64 [world];
* floor: brightness of the floor, uint8 [rows, columns] without a border; a single cell if it is the same everywhere;
* plains: the brightness where a floor sensor sees no other (`kiks.engine.sensing.floor_spots.plains_of`).
"""


class Scene:
    """The arrays of some worlds, arranged for kernels.

    Args:
        state: The state; when its arrays are replaced, it needs a new scene.
        kinds: Constants of the kinds of robots, records of `PARAMETERS`.
        arenas: The arena, and others that are to have room in the grid.
        networks: What responses need of the thesis's networks (`networks_for`).
        lamps: x [mm], y [mm], power [W] and 1 for on or 0 for off, float64 [world, lamp, 4].
        seeds: Seeds of the worlds, int64 [world].

    Attributes:
        record: What kernels take, an array of one `SCENE`.
        arrays: The arrays by name, which live as long as the scene.
    """

    def __init__(
        self,
        state: State,
        kinds: NDArray[np.void],
        arenas: Sequence[Arena],
        networks: NDArray[np.void],
        lamps: NDArray[np.float64],
        seeds: ArrayLike,
    ) -> None:
        world_count, robot_count = state.robots.shape
        disc_count = robot_count + state.bodies.shape[1]
        size_mm = max(arena.height_mm for arena in arenas), max(arena.width_mm for arena in arenas)
        # A lone robot meets nothing, and its motors move it; a lone ball rolls as one of many does.
        has_company = disc_count > min(robot_count, 1)
        rows, columns = squares_of(*size_mm) if has_company else (1, 1)
        self.record = np.zeros(1, SCENE)
        self.arrays: dict[str, NDArray[Any]] = {}
        self._keep(
            robots=state.robots,
            bodies=state.bodies,
            kinds=kinds,
            begins=np.zeros((world_count, rows, columns + 1), np.int32),
            entries=np.zeros((world_count, disc_count), np.int32),
            spots=np.zeros((world_count, disc_count, 3)),
            pairs=np.zeros((world_count, PAIRS_PER_DISC * disc_count if has_company else 0, 2), np.int32),
            neighbours=np.zeros((world_count, robot_count, NEIGHBOURS if has_company else 0), np.int32),
            places=np.zeros((world_count, disc_count, 2)),
            crowds=np.zeros(world_count, CROWD),
            networks=networks,
            lamps=lamps,
            seeds=np.asarray(seeds, np.int64),
        )
        if has_company or state.robots["has_gripper"].any():
            make_ready(MEETING)
        self.record["widest_mm"] = max(kinds["radius_mm"].max(initial=0.0), state.bodies["radius_mm"].max(initial=0.0))
        self.record["sight_mm"] = kinds["ray_reach_mm"].max(initial=0.0) + SIGHT_SLACK_MM
        self._take_walls(arenas[0])
        enter_worlds(self.record, np.arange(world_count))

    def _keep(self, **arrays: NDArray[Any]) -> None:
        """Keep arrays, and write where they are into the record."""
        for name, array in arrays.items():
            self.record[name] = address_of_array(array, *_ARRAYS[name])
        self.arrays |= arrays

    def _take_walls(self, arena: Arena) -> None:
        clearance, rooms, brightness, leaps, faces, cell_mm, pad = walls_of(arena)
        floor = ALL_WHITE if arena.shades is None else arena.shades
        plains = plains_of(floor, arena.mm_per_cell)
        self._keep(clearance=clearance, rooms=rooms, brightness=brightness, leaps=leaps, faces=faces)
        self._keep(floor=floor, plains=plains)
        self.record["cell_mm"], self.record["pad"] = cell_mm, pad

    def set_lamps(self, lamps: NDArray[np.float64]) -> None:
        """Replace the lamps."""
        self._keep(lamps=lamps)

    def in_arena(self, arena: Arena) -> Scene:
        """Return a scene of the same arrays with the walls of another arena."""
        other = copy.copy(self)
        other.record, other.arrays = self.record.copy(), dict(self.arrays)
        other._take_walls(arena)
        return other


@entry
def enter_worlds(record: Any, worlds: Any) -> Any:
    """Update the grids of some worlds, int64 [world]: for Python, after it has moved something."""
    scene = open_scene(record[0])
    for world in worlds:
        enter_all(scene, world)

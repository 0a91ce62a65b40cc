"""The arena: a raster of brightness, the distance of each cell from walls, and the objects in it.

x points right, y up, and (0, 0) is the lower left corner of the raster. Pictures and arrays have row 0 on top;
`Arena.from_array` flips them, and nothing else does.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from kiks import upwards
from kiks.errors import ArenaError, ParameterError, counted, shown
from kiks.model.arena_objects import Ball, Cylinder, Lamp, LampSwitch, Pose, checked_places
from kiks.model.atomic_files import path_of
from kiks.model.box import Box
from kiks.model.checks import check_kind, check_number
from kiks.model.maze import draw_maze
from kiks.model.raster import MAX_CELLS, PAD, SIZE_MIN_MM, between, cells_per_pixel
from kiks.model.room import draw_room
from kiks.model.wall_tables import WallTables, wall_tables
from kiks.model.walls import AnyShape, Wall, Zone, painted

__all__ = ["MAX_CELLS", "PAD", "SIZE_MIN_MM", "Arena", "Ball", "Cylinder", "Lamp", "LampSwitch", "Pose", "Wall", "Zone"]

_KINDS = (
    ("starts", "start", Pose),
    ("lamps", "lamp", Lamp),
    ("balls", "ball", Ball),
    ("cylinders", "cylinder", Cylinder),
)

MOSTLY_WALL = 0.6
"""Share of walls beyond which a picture has probably its colours the other way round."""

TURN_ROUND = "In most other programs walls are black: an arena file with invert = true turns the picture round."
"""What to do then."""


@upwards.shown_in_notebooks("kiks.export.notebook", "arena")
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Arena:
    """A checked arena that never changes; `dataclasses.replace` makes a changed copy.

    Args:
        ground: Its picture: uint8 [row, column], row 0 at the bottom: 0 is floor, 1..255 a wall from black to white.
            Kept read-only; copied unless it already is.
        mm_per_cell: Edge of a cell [mm], at most 1.
        name: Its name.
        starts: Starts of robots, each on floor.
        lamps: Lamps, each inside the raster.
        lamp_switches: When lamps are switched on or off in the course of a run.
        floor: The brightness of the floor: uint8 [row, column] as `ground`, 0 black to 255 white; white all over if
            None. Only floor sensors see it (the page "Turrets").
        zones: Zones over that: lines, boxes and discs, the later ones over the earlier ones.
        balls: Balls, each centre on floor.
        cylinders: Cylinders, each centre on floor.
        walls: Walls over the picture: lines, boxes and discs, the later ones over the earlier ones.

    Attributes:
        brightness: The picture with these walls, as sensors see it: uint8 [row, column], row 0 at the bottom.
        shades: The floor with these zones, as floor sensors see it: uint8 [row, column]; None if it is white.

    Example:
        >>> arena = Arena.box(400, 300)
        >>> arena.clearance_at_mm(60, 150)
        50.0
        >>> arena.free_for(30, 30, radius_mm=27.5)
        False
    """

    ground: npt.NDArray[np.uint8]
    mm_per_cell: float
    name: str
    starts: tuple[Pose, ...] = ()
    lamps: tuple[Lamp, ...] = ()
    balls: tuple[Ball, ...] = ()
    cylinders: tuple[Cylinder, ...] = ()
    walls: tuple[Wall, ...] = ()
    lamp_switches: tuple[LampSwitch, ...] = ()
    floor: npt.NDArray[np.uint8] | None = None
    zones: tuple[Zone, ...] = ()
    brightness: npt.NDArray[np.uint8] = field(init=False)
    shades: npt.NDArray[np.uint8] | None = field(init=False)
    _tables: WallTables = field(init=False)

    def __post_init__(self) -> None:
        check_kind("name", self.name, str)
        given = self.ground
        if not isinstance(given, np.ndarray) or given.dtype != np.uint8 or given.ndim != 2:
            raise ParameterError(
                f"ground must be a uint8 array [row, column], but it was {_described(given)}. "
                "Arena.from_array accepts other integers."
            )
        cells_per_pixel(given.shape[0], given.shape[1], self.mm_per_cell)
        if self.mm_per_cell > 1:
            raise ParameterError(
                f"mm_per_cell must be at most 1, but it was {shown(self.mm_per_cell)}. "
                "Arena.from_array cuts coarser pixels into cells."
            )
        given = _read_only(given)
        walls = _checked_shapes("walls", Wall, self.walls)
        raster = painted(given, self.mm_per_cell, walls)
        if raster.all():
            raise ArenaError(
                f"Arena {shown(self.name)} must have floor, but every cell is wall. Black (0) is floor and all else "
                "wall: invert the picture if it was drawn the other way round."
            )
        self._take_floor(given)
        object.__setattr__(self, "ground", given)
        object.__setattr__(self, "walls", walls)
        object.__setattr__(self, "brightness", raster)
        object.__setattr__(self, "mm_per_cell", float(self.mm_per_cell))
        object.__setattr__(self, "_tables", wall_tables(raster, self.mm_per_cell))
        for switch in self.lamp_switches:
            check_kind("each of lamp_switches", switch, LampSwitch)
        object.__setattr__(self, "lamp_switches", tuple(sorted(self.lamp_switches, key=lambda each: each.time_s)))
        for name, label, kind in _KINDS:
            entries = checked_places(label, kind, getattr(self, name), raster, self.mm_per_cell)
            object.__setattr__(self, name, entries)

    def _take_floor(self, ground: npt.NDArray[np.uint8]) -> None:
        """Check the floor, and paint its zones."""
        floor, zones = self.floor, _checked_shapes("zones", Zone, self.zones)
        if floor is not None:
            if not isinstance(floor, np.ndarray) or floor.dtype != np.uint8:
                raise ParameterError(
                    f"floor must be a uint8 array [row, column] or None, but it was {_described(floor)}. "
                    "Convert it, for instance with array.astype(np.uint8)."
                )
            if floor.shape != ground.shape:
                found = " x ".join(map(str, floor.shape[::-1]))
                raise ArenaError(
                    f"the floor must have as many cells as the walls, {ground.shape[1]} x {ground.shape[0]}, but it "
                    f"has {found}. Draw it in the size of the arena."
                )
            floor = _read_only(floor)
        shades = floor
        if zones:
            shades = painted(_white(ground.shape) if floor is None else floor, self.mm_per_cell, zones)
        for name, value in (("floor", floor), ("zones", zones), ("shades", shades)):
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        counts = [(len(getattr(self, name)), label) for name, label, _ in _KINDS]
        counts += [(len(self.walls), "wall"), (len(self.zones), "zone")]
        held = "".join(f", {counted(count, label)}" for count, label in counts if count)
        held += ", a floor" if self.floor is not None else ""
        return f"<Arena {shown(self.name)}: {self.width_mm:g} x {self.height_mm:g} mm{held}>"

    def __reduce__(self) -> tuple[Any, ...]:
        # Through the constructor: a plain pickle would bring the raster back writable and carry the caches along.
        return Arena, tuple(getattr(self, each.name) for each in fields(self) if each.init)

    def __deepcopy__(self, memo: dict[int, Any]) -> Arena:
        return self  # as it never changes

    @classmethod
    def from_array(cls, brightness: npt.NDArray[Any], *, mm_per_pixel: float = 1.0, name: str = "array") -> Arena:
        """Make an arena of an array that looks like a picture.

        Args:
            brightness: Integers 0..255 [row, column] with row 0 on top, 0 = floor; or booleans, True = wall of 255.
            mm_per_pixel: Edge of a pixel [mm]. A pixel above 1 mm becomes k x k cells, k = ceil(mm_per_pixel).
            name: Its name.

        Example:
            >>> import numpy as np
            >>> import kiks
            >>> walls = np.zeros((300, 400), np.uint8)
            >>> walls[:, :10] = 255  # a white wall on the left
            >>> kiks.Arena.from_array(walls).width_mm
            400.0
        """
        if not isinstance(brightness, np.ndarray) or brightness.ndim != 2 or brightness.dtype.kind not in "bui":
            raise ParameterError(
                f"brightness must be an array [row, column] of integers 0..255 or booleans, but it was "
                f"{_described(brightness)}. Convert it, for instance with array.astype(np.uint8)."
            )
        cells = cells_per_pixel(brightness.shape[0], brightness.shape[1], mm_per_pixel)
        if brightness.dtype == np.bool_:
            brightness = np.where(brightness, np.uint8(255), np.uint8(0))
        low, high = int(brightness.min()), int(brightness.max())
        if low < 0 or high > 255:
            raise ParameterError(
                f"brightness must lie within 0..255, but it spans {low}..{high}. Scale it, keeping 0 for floor."
            )
        upright = np.flipud(brightness).astype(np.uint8, order="C")
        if cells > 1:
            upright = upright.repeat(cells, axis=0).repeat(cells, axis=1)
        upright.setflags(write=False)
        return cls(upright, mm_per_pixel / cells, name)

    @classmethod
    def from_image(cls, path: str | Path, mm_per_pixel: float = 1.0) -> Arena:
        """Read a picture: black is floor, any other grey a wall of that brightness (the page "Arenas").

        Args:
            path: A PNG, TIF, PGM or BMP file.
            mm_per_pixel: Edge of a pixel [mm].

        Example:
            >>> import tempfile
            >>> from pathlib import Path
            >>> import kiks
            >>> from PIL import Image
            >>> file = Path(tempfile.mkdtemp(), "room.png")
            >>> Image.fromarray(kiks.Arena.box(200, 100).brightness).save(file)
            >>> kiks.Arena.from_image(file, mm_per_pixel=2)
            <Arena 'room': 400 x 200 mm>
        """
        from kiks.model.picture import read_picture

        path = path_of(path)
        return cls.from_array(read_picture(path, mm_per_pixel).brightness, mm_per_pixel=mm_per_pixel, name=path.stem)

    @classmethod
    def load(cls, path: str | Path) -> Arena:
        """Read an arena.

        Args:
            path: The name of one that comes with KiKS (`kiks arena list`), or a file: an arena file (.toml), a project
                (.kiks), an arena of the Matlab KiKS (.kad), a map of ROS (.yaml), or a picture of 1 mm a pixel.

        Example:
            >>> Arena.load("office").name
            'Office'
        """
        arena: Arena = upwards.load_arena_file(path_of(path))
        return arena

    @classmethod
    def default(cls) -> Arena:
        """Return the classic arena: 500 x 650 mm, white walls, round corners (kiks-behaviour.md, section 1.1).

        Example:
            >>> import kiks
            >>> arena = kiks.Arena.default()
            >>> arena.width_mm, arena.height_mm
            (500.0, 650.0)
        """
        box = cls.box(500, 650, rounded_mm=100)
        return cls(box.brightness, box.mm_per_cell, "default", starts=(Pose(250.0, 325.0, math.pi / 2),))

    @classmethod
    def box(
        cls, width_mm: int, height_mm: int, *, wall_mm: int = 10, rounded_mm: int = 0, brightness: int | str = 255
    ) -> Arena:
        """Return an empty arena with a wall around it, in whole millimetres.

        Args:
            width_mm: Outer width [mm].
            height_mm: Outer height [mm].
            wall_mm: Thickness of the wall [mm]; 0 leaves the border of the world alone.
            rounded_mm: Radius of the corners of the floor [mm].
            brightness: Brightness of the wall, 1..255, or a material of `kiks.model.materials`, such as 'wood'.

        Example:
            >>> int(Arena.box(400, 300, brightness="wood").brightness.max())
            190
        """
        box = Box(width_mm, height_mm, wall_mm, rounded_mm, brightness)  # type: ignore[arg-type] # a material's name
        return cls.from_array(box.raster(), name="box")

    @classmethod
    def maze(cls, *, columns: int = 4, rows: int = 4, path_mm: int = 120, wall_mm: int = 10, seed: int = 0) -> Arena:
        """Return a random maze with white walls; exactly one path connects any two of its places.

        The robot starts in the entrance, left of the top row, and a lamp hangs in the exit, right of the bottom row.

        Args:
            columns: Cells side by side, without the entrance and the exit.
            rows: Cells one above the other.
            path_mm: Width of a passage [mm], at least 2 `wall_mm` + 77.
            wall_mm: Thickness of a wall between passages [mm].
            seed: The same seed, the same maze, on every computer.

        Example:
            >>> Arena.maze(columns=5, rows=5).width_mm
            880.0
        """
        picture, start, lamp = draw_maze(columns, rows, path_mm, wall_mm, seed)
        return replace(cls.from_array(picture, name="maze"), starts=(start,), lamps=(lamp,))

    @classmethod
    def room(
        cls,
        *,
        width_mm: int = 1100,
        height_mm: int = 1100,
        walls: int = 4,
        pillars: int = 3,
        lamps: int = 1,
        seed: int = 0,
    ) -> Arena:
        """Return a random room with walls and pillars of several shades, and lamps of 25 W.

        A robot reaches every place: things are at least 120 mm apart. A list of many rooms trains a controller in
        others of them in each generation (`kiks.Task`).

        Args:
            width_mm: Outer width [mm], from 500 to 3000.
            height_mm: Outer height [mm], likewise.
            walls: Number of walls, straight or with a corner; some begin at the frame.
            pillars: Number of round pillars.
            lamps: Number of lamps.
            seed: The same seed, the same room, on every computer.

        Raises:
            ParameterError: If the things do not fit.

        Example:
            >>> rooms = [Arena.room(seed=seed) for seed in range(24)]
            >>> len(rooms[0].walls), len(rooms[0].lamps)
            (7, 1)
        """
        built, lit = draw_room(width_mm, height_mm, walls, pillars, lamps, seed)
        return replace(cls.box(width_mm, height_mm), name=f"room {seed}", walls=built, lamps=lit)

    @property
    def width_mm(self) -> float:
        """Width of the raster [mm]."""
        return float(self.brightness.shape[1] * self.mm_per_cell)

    @property
    def height_mm(self) -> float:
        """Height of the raster [mm]."""
        return float(self.brightness.shape[0] * self.mm_per_cell)

    @property
    def bodies(self) -> tuple[Ball | Cylinder, ...]:
        """The balls, then the cylinders."""
        together: list[Ball | Cylinder] = [*self.balls]
        return (*together, *self.cylinders)

    @property
    def surface(self) -> npt.NDArray[np.uint8]:
        """Brightness with the border of the world around it: uint8 [row + 2 PAD, column + 2 PAD], border 255."""
        return self._tables.surface

    @property
    def clearance(self) -> npt.NDArray[np.float32]:
        """Distance from each cell's centre to that of the nearest wall cell [mm].

        float32 [row + 2 PAD, column + 2 PAD], exact (Euclidean), 0 in wall cells; the border of the world is wall.
        """
        return self._tables.clearance

    @property
    def rooms(self) -> npt.NDArray[np.float32]:
        """The least `clearance` in each block of 16 x 16 cells [mm]: far from walls, one look-up in a small table."""
        return self._tables.rooms

    @property
    def leaps(self) -> npt.NDArray[np.int16]:
        """Free distance from any point of a cell in any direction [1/16 cells], and the brightness of walls.

        int16 [row + 2 PAD, column + 2 PAD], rounded down; wall cells have their brightness, negative.
        """
        return self._tables.leaps

    @property
    def faces(self) -> npt.NDArray[np.int32]:
        """The smooth surface of walls next to free cells, without the steps of the raster.

        int32 [row + 2 PAD, column + 2 PAD]: three numbers with signs in one (`kiks.model.raster.unpack_faces`), the
        first in the highest bits: x and y of a unit vector straight into the wall [1/1023], 11 bits each, and how far
        that way its surface is from the cell's centre [1/256 cells], 10 bits; 0 for all other cells.
        """
        return self._tables.faces

    def clearance_at_mm(self, x_mm: float, y_mm: float) -> float:
        """Return the distance of a point from the surface of the nearest wall [mm].

        Interpolates `clearance` between cell centres and takes off half a cell. That is exact before a straight wall
        along the raster; before a corner it is up to 0.21 cells too much, half way between two walls up to half a
        cell too little. In walls and outside it is negative.
        """
        x_mm, y_mm = check_number("x_mm", x_mm), check_number("y_mm", y_mm)
        column, column_share = between(x_mm / self.mm_per_cell + PAD - 0.5, self.clearance.shape[1])
        row, row_share = between(y_mm / self.mm_per_cell + PAD - 0.5, self.clearance.shape[0])
        square = self.clearance[row : row + 2, column : column + 2].astype(np.float64)
        upright = square[0] + row_share * (square[1] - square[0])
        return float(upright[0] + column_share * (upright[1] - upright[0]) - 0.5 * self.mm_per_cell)

    def free_for(self, x_mm: float, y_mm: float, radius_mm: float) -> bool:
        """Return whether a disc of `radius_mm` [mm] at a place [mm] touches no wall."""
        if check_number("radius_mm", radius_mm, 0, advice="A Khepera has 27.5.") == 0:
            raise ParameterError("radius_mm must be positive, but it was 0. A Khepera has 27.5.")
        return self.clearance_at_mm(x_mm, y_mm) >= radius_mm

    def find_start(self, radius_mm: float) -> Pose:
        """Return the start of a robot of `radius_mm` [mm].

        That is the first of `starts`. Without any it is the cell with most room, among equals the one nearest to
        the middle, heading up: the same one every time.

        Example:
            >>> import kiks
            >>> kiks.Arena.box(500, 500).find_start(radius_mm=27.5)
            Pose(x_mm=249.5, y_mm=249.5, heading_rad=1.5707963267948966)
        """
        pose = self.starts[0] if self.starts else self.widest_place()
        if not self.free_for(pose.x_mm, pose.y_mm, radius_mm):
            room_mm = 2 * self.clearance_at_mm(pose.x_mm, pose.y_mm)
            where, advice = (
                (
                    f"start 1 at ({pose.x_mm:g}, {pose.y_mm:g}) mm has room for",
                    "Move the start pose away from the wall.",
                )
                if self.starts
                else ("its widest place has room for", self._advice())
            )
            raise ArenaError(
                f"Arena {shown(self.name)} must have room for a robot {2 * radius_mm:g} mm across, but {where} "
                f"{room_mm:.1f} mm only. {advice}"
            )
        return pose

    def _advice(self) -> str:
        """Return what is likely to be wrong with an arena in which a robot has no room."""
        if (self.brightness > 0).mean() > MOSTLY_WALL:
            return TURN_ROUND
        return "Draw wider passages or give a larger mm_per_pixel."

    def widest_place(self) -> Pose:
        """Return the place with most room, where a robot starts if there are no `starts`.

        Example:
            >>> import kiks
            >>> kiks.Arena.box(400, 300).widest_place().y_mm
            149.5
        """
        inside = self.clearance[PAD:-PAD, PAD:-PAD]
        rows, columns = np.nonzero(inside == inside.max())
        # Twice the offset from the middle, in cells, is a whole number, so rounding cannot decide between equals.
        offset = (2 * rows + 1 - inside.shape[0]) ** 2 + (2 * columns + 1 - inside.shape[1]) ** 2
        best = int(offset.argmin())
        x_mm, y_mm = ((int(index[best]) + 0.5) * self.mm_per_cell for index in (columns, rows))
        return Pose(x_mm, y_mm, math.pi / 2)


def _checked_shapes(name: str, kind: type[AnyShape], shapes: Any) -> tuple[AnyShape, ...]:
    found = tuple(shapes) if isinstance(shapes, Iterable) else (shapes,)
    for each in found:
        if not isinstance(each, kind):
            raise ParameterError(
                f"{name} must be a list of {kind.__name__}, but it has {shown(each)}. "
                f"Give {kind.__name__}(line_mm=...)."
            )
    return found


def _read_only(cells: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Return cells read-only: themselves, or a copy."""
    if cells.flags.writeable or cells.base is not None or not cells.flags.c_contiguous:
        cells = cells.copy(order="C")
        cells.setflags(write=False)
    return cells


@lru_cache(4)
def _white(shape: tuple[int, int]) -> npt.NDArray[np.uint8]:
    """Return a white floor, which arenas of one size share."""
    return _read_only(np.full(shape, 255, np.uint8))


def _described(value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype} with {value.ndim} dimensions"
    return f"of type {type(value).__name__}"

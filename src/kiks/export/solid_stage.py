"""The world of a film in space: walls as boxes, robots and cylinders as high as they are, balls as balls. It needs VTK.

The floor carries the ground of a film from above, with lamps and trails, and each robot carries on its top how it looks
from above.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import BALL
from kiks.errors import library
from kiks.export.looks import Colour, body_colour, robot_colour
from kiks.export.sheet import INK
from kiks.export.stage import OUTSIDE, Canvas, Ground, Pixels
from kiks.model.arena import Arena
from kiks.model.robot_parts import Body
from kiks.recording.moments import Moment

WALL_MM, ROBOT_MM, CYLINDER_MM, CHASSIS_MM = 36.0, 32.0, 50.0, 4.0
"""Heights [mm], low enough that walls hide little; the chassis of a robot begins above the floor."""

CELLS_MAX = 400
"""Most cells of the walls in each direction."""

GROUND_PIXELS = 2000
"""Pixels of the longer side of the floor."""

TOP_PIXELS = 192
"""Pixels of a side of the picture on top of a robot."""

ELEVATION_DEG, VIEW_DEG, MARGIN = 56.0, 30.0, 1.04
"""Angle of the camera above the floor, its angle of view, and how much more than the arena it sees."""

ROUND = 40
"""Corners of a circle."""


class SolidStage:
    """Draws the world of a film in space, as `kiks.export.stage.Stage` does from above.

    Args:
        size: Width and height of the pictures.
        follow: Index of the robot that stays in the middle; None: the whole arena is seen.
        zoom: How much larger the arena is than one that is seen as a whole.
        has_trails: Whether robots, balls and cylinders leave trails.
    """

    def __init__(self, size: tuple[int, int], *, follow: int | None, zoom: float, has_trails: bool) -> None:
        self._vtk = vtk = library("vtk", "render")
        self._numpy = library("vtkmodules.util.numpy_support", "render")
        # It tells that there is no screen, which it does not need.
        vtk.vtkLogger.SetStderrVerbosity(vtk.vtkLogger.VERBOSITY_OFF)
        self._follow, self._zoom = follow, zoom
        self._ground = Ground(has_trails=has_trails)
        self._arena: Arena | None = None
        self._renderer = vtk.vtkRenderer()
        self._renderer.SetBackground(*_share(OUTSIDE))
        self._renderer.UseFXAAOn()
        self._window = vtk.vtkRenderWindow()
        self._window.SetOffScreenRendering(1)
        self._window.SetMultiSamples(0)
        self._window.SetSize(*size)
        self._window.AddRenderer(self._renderer)
        self._camera = vtk.vtkWindowToImageFilter()
        self._camera.SetInput(self._window)
        self._camera.ReadFrontBufferOff()
        self._still: list[Any] = []
        self._robots: list[Any] = []
        self._bodies: dict[int, Any] = {}

    def draw(self, moment: Moment, share: float, picture: Pixels) -> None:
        """Draw a moment, as `kiks.export.stage.Stage.draw` does."""
        arena = moment.setup.arena
        self._ground.draw(moment, share, GROUND_PIXELS / max(arena.width_mm, arena.height_mm))
        if arena is not self._arena:
            self._build(arena)
        self._floor.SetInputData(self._image(self._ground.canvas.pixels))
        self._place_robots(moment)
        self._place_bodies(moment)
        self._aim(moment)
        height, width = picture.shape[:2]
        self._camera.Modified()
        self._camera.Update()
        pixels = self._numpy.vtk_to_numpy(self._camera.GetOutput().GetPointData().GetScalars())
        picture[...] = pixels.reshape(height, width, 3)[::-1]

    # ---- what stands still ----

    def _build(self, arena: Arena) -> None:
        """Build the floor and the walls."""
        vtk = self._vtk
        for actor in self._still:
            self._renderer.RemoveActor(actor)
        plane = vtk.vtkPlaneSource()
        plane.SetOrigin(0.0, 0.0, 0.0)
        plane.SetPoint1(arena.width_mm, 0.0, 0.0)
        plane.SetPoint2(0.0, arena.height_mm, 0.0)
        self._floor = vtk.vtkTexture()
        self._floor.InterpolateOn()
        floor = self._actor(plane)
        floor.SetTexture(self._floor)
        floor.GetProperty().LightingOff()
        self._still = [floor]
        for brightness, boxes in wall_boxes(arena).items():
            append = vtk.vtkAppendPolyData()
            for left, right, low, high in boxes:
                box = vtk.vtkCubeSource()
                box.SetBounds(left, right, low, high, 0.0, WALL_MM)
                append.AddInputConnection(box.GetOutputPort())
            # As light as from above.
            grey = 40 + brightness * 150 // 255
            self._still.append(self._actor(append, (grey, grey, grey)))
        for actor in self._still:
            self._renderer.AddActor(actor)
        self._arena = arena

    # ---- what moves ----

    def _place_robots(self, moment: Moment) -> None:
        count = len(moment.poses)
        if len(self._robots) != count:
            for actor in self._robots:
                self._renderer.RemoveActor(actor)
            specs = moment.setup.specs
            self._robots = [self._robot(spec.body, index) for index, spec in zip(range(count), specs, strict=False)]
            for actor in self._robots:
                self._renderer.AddActor(actor)
        for actor, (x_mm, y_mm, heading_rad) in zip(self._robots, moment.poses.tolist(), strict=False):
            actor.SetPosition(x_mm, y_mm, 0.0)
            actor.SetOrientation(0.0, 0.0, math.degrees(heading_rad))

    def _robot(self, shape: Body, index: int) -> Any:
        """Return a robot at the origin that heads along x."""
        vtk, radius_mm = self._vtk, shape.radius_mm
        robot = vtk.vtkAssembly()
        wheel_mm = 0.5 * ROBOT_MM
        body = self._upright(0.97 * radius_mm, ROBOT_MM - CHASSIS_MM, robot_colour(index))
        if shape.stripe_count:
            self._paint_stripes(body, shape)
        body.SetPosition(0.0, 0.0, (CHASSIS_MM + ROBOT_MM) / 2)
        robot.AddPart(body)
        for side in (-1, 1):
            part = self._actor(self._cylinder(wheel_mm / 2, 0.2 * radius_mm), INK)
            part.SetPosition(0.0, 0.9 * side * radius_mm, wheel_mm / 2)
            robot.AddPart(part)
        top = vtk.vtkPlaneSource()
        for set_corner, corner in ((top.SetOrigin, (-1, -1)), (top.SetPoint1, (1, -1)), (top.SetPoint2, (-1, 1))):
            set_corner(corner[0] * radius_mm, corner[1] * radius_mm, ROBOT_MM + 0.5)
        texture = vtk.vtkTexture()
        texture.InterpolateOn()
        texture.SetInputData(self._image(robot_top(shape, index)))
        part = self._actor(top)
        part.SetTexture(texture)
        part.GetProperty().LightingOff()
        robot.AddPart(part)
        return robot

    def _paint_stripes(self, upright: Any, shape: Body) -> None:
        """Paint the stripes of a robot on an upright cylinder."""
        mapper, greys = upright.GetMapper(), stripe_greys(shape)
        mapper.GetInputAlgorithm().SetResolution(len(greys))
        mapper.Update()
        # Its faces begin ahead; its two ends are the last ones.
        colours = np.repeat(np.append(greys, [0, 0]).astype(np.uint8), 3).reshape(-1, 3)
        mapper.GetInput().GetCellData().SetScalars(self._numpy.numpy_to_vtk(colours, deep=True))
        mapper.SetScalarModeToUseCellData()

    def _place_bodies(self, moment: Moment) -> None:
        numbers = {int(body["number"]) for body in moment.bodies}
        for number in self._bodies.keys() - numbers:
            self._renderer.RemoveActor(self._bodies.pop(number))
        for body in moment.bodies:
            number, radius_mm, is_ball = int(body["number"]), float(body["radius_mm"]), body["what"] == BALL
            if number not in self._bodies:
                actor = self._actor(self._sphere(radius_mm), body_colour(body)) if is_ball else None
                self._bodies[number] = actor or self._upright(radius_mm, CYLINDER_MM, body_colour(body))
                self._renderer.AddActor(self._bodies[number])
            height_mm = ROBOT_MM if body["is_lifted"] else 0.0
            middle_mm = radius_mm if is_ball else CYLINDER_MM / 2
            self._bodies[number].SetPosition(float(body["x_mm"]), float(body["y_mm"]), height_mm + middle_mm)

    # ---- the camera ----

    def _aim(self, moment: Moment) -> None:
        """Let the camera look from the south at the whole arena, or at the followed robot."""
        width, height = self._window.GetSize()
        camera = self._renderer.GetActiveCamera()
        focus, place = camera_places(moment, self._follow, self._zoom, width / height)
        camera.SetViewAngle(VIEW_DEG)
        camera.SetFocalPoint(*focus)
        camera.SetPosition(*place)
        camera.SetViewUp(0.0, 0.0, 1.0)
        self._renderer.ResetCameraClippingRange()

    # ---- parts ----

    def _actor(self, source: Any, colour: Colour | None = None) -> Any:
        mapper = self._vtk.vtkPolyDataMapper()
        mapper.SetInputConnection(source.GetOutputPort())
        actor = self._vtk.vtkActor()
        actor.SetMapper(mapper)
        if colour is not None:
            actor.GetProperty().SetColor(*_share(colour))
            actor.GetProperty().SetAmbient(0.35)
            actor.GetProperty().SetDiffuse(0.7)
        return actor

    def _sphere(self, radius_mm: float) -> Any:
        sphere = self._vtk.vtkSphereSource()
        sphere.SetRadius(radius_mm)
        sphere.SetThetaResolution(ROUND)
        sphere.SetPhiResolution(ROUND // 2)
        return sphere

    def _upright(self, radius_mm: float, height_mm: float, colour: Colour) -> Any:
        """Return an upright cylinder, whose origin is its middle."""
        actor = self._actor(self._cylinder(radius_mm, height_mm), colour)
        actor.RotateX(90.0)
        return actor

    def _cylinder(self, radius_mm: float, length_mm: float) -> Any:
        """Return the source of a cylinder along y."""
        cylinder = self._vtk.vtkCylinderSource()
        cylinder.SetRadius(radius_mm)
        cylinder.SetHeight(length_mm)
        cylinder.SetResolution(ROUND)
        return cylinder

    def _image(self, pixels: NDArray[np.uint8]) -> Any:
        """Return a picture as VTK has it, with row 0 at the bottom."""
        height, width, depth = pixels.shape
        image = self._vtk.vtkImageData()
        image.SetDimensions(width, height, 1)
        flat = np.ascontiguousarray(pixels[::-1]).reshape(-1, depth)
        image.GetPointData().SetScalars(self._numpy.numpy_to_vtk(flat, deep=True))
        return image


def camera_places(
    moment: Moment, follow: int | None, zoom: float, aspect: float
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return what a camera in the south looks at, and where it is [mm].

    Args:
        moment: What it sees.
        follow: Index of the robot in the middle; None for the arena.
        zoom: How much larger the arena is than one that is seen as a whole.
        aspect: Width of the picture by its height.
    """
    arena = moment.setup.arena
    x_mm, y_mm = arena.width_mm / 2, arena.height_mm / 2
    if follow is not None and follow < len(moment.poses):
        x_mm, y_mm = moment.poses[follow, :2].tolist()
    half = math.tan(math.radians(VIEW_DEG) / 2)
    sine, cosine = math.sin(math.radians(ELEVATION_DEG)), math.cos(math.radians(ELEVATION_DEG))
    # The near edge of the floor is the widest, and the floor is foreshortened.
    wide = arena.width_mm / (2 * half * aspect) + arena.height_mm / 2 * cosine
    high = arena.height_mm / 2 * (sine / half + cosine)
    away_mm = MARGIN * max(wide, high) / zoom
    return (x_mm, y_mm, ROBOT_MM), (x_mm, y_mm - away_mm * cosine, ROBOT_MM + away_mm * sine)


def stripe_greys(body: Body) -> NDArray[np.uint8]:
    """Return the greys of equal parts around a striped body, counter-clockwise from ahead, uint8 [part]."""
    each = 4 * body.stripe_count
    count = each * -(-ROUND // each)
    middles_rad = (np.arange(count) + 0.5) * (2 * math.pi / count)
    begins_rad, ends_rad = np.array(body.white_stripes_rad).T[..., np.newaxis]
    is_white = ((begins_rad < middles_rad) & (middles_rad < ends_rad)).any(axis=0)
    return np.where(is_white, 255, 0).astype(np.uint8)


def robot_top(body: Body, index: int) -> Pixels:
    """Return how a robot that heads to the right looks from above, with a fourth part that says where it is."""
    radius_mm = body.radius_mm
    scale = TOP_PIXELS / (2 * radius_mm)
    canvas = Canvas(np.zeros((TOP_PIXELS, TOP_PIXELS, 3), np.uint8), scale, -radius_mm, radius_mm)
    with canvas.patch([(0.0, 0.0)], radius_mm) as sheet:
        sheet.robot((0.0, 0.0, 0.0), body, index)
    rows, columns = np.indices((TOP_PIXELS, TOP_PIXELS)) - (TOP_PIXELS - 1) / 2
    return np.dstack([canvas.pixels, np.uint8(255) * (np.hypot(rows, columns) < TOP_PIXELS / 2 - 1)])


def wall_boxes(arena: Arena) -> dict[int, list[tuple[float, float, float, float]]]:
    """Return boxes that make the walls of an arena: left, right, lower and upper side [mm] by their brightness."""
    walls = arena.brightness
    step = max(-(-max(walls.shape) // CELLS_MAX), 1)
    rows, columns = (-(-side // step) for side in walls.shape)
    padded = np.zeros((rows * step, columns * step), walls.dtype)
    padded[: walls.shape[0], : walls.shape[1]] = walls
    cells = padded.reshape(rows, step, columns, step).max(axis=(1, 3))
    cell_mm = arena.mm_per_cell * step
    found: dict[int, list[tuple[float, float, float, float]]] = {}
    growing: dict[tuple[int, int, int], int] = {}  # left, right and brightness of runs that go on, and their first row
    for row in range(rows + 1):
        runs: dict[tuple[int, int, int], int] = {}
        if row < rows:
            edges = np.flatnonzero(np.diff(cells[row].astype(int), prepend=-1, append=-1)).tolist()
            for left, right in pairwise(edges):
                if cells[row, left]:
                    key = left, right, int(cells[row, left])
                    runs[key] = growing.pop(key, row)
        for (left, right, brightness), first in growing.items():
            box = (
                left * cell_mm,
                min(right * cell_mm, arena.width_mm),
                first * cell_mm,
                min(row * cell_mm, arena.height_mm),
            )
            found.setdefault(brightness, []).append(box)
        growing = runs
    return found


def _share(colour: Colour) -> list[float]:
    return [part / 255 for part in colour[:3]]

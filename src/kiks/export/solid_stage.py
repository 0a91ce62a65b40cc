"""The world of a film in space. It needs VTK.

The floor carries the ground of a film from above, with lamps and trails.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.errors import library
from kiks.export.space import ROUND, VIEW_DEG, Solid, camera_places, things, walls
from kiks.export.stage import OUTSIDE, Ground, Pixels
from kiks.model.arena import Arena
from kiks.recording.moments import Moment
from kiks.sim.colours import Colour

GROUND_PIXELS = 2000
"""Pixels of the longer side of the floor."""


class SolidStage:
    """Draws the world of a film in space, as `kiks.export.stage.Stage`, whose arguments it has, does from above."""

    def __init__(self, size: tuple[int, int], *, follow: int | None, zoom: float, has_trails: bool) -> None:
        self._vtk = vtk = library("vtk", "render")
        self._numpy = library("vtkmodules.util.numpy_support", "render")
        # VTK warns that there is no screen, which it does not need.
        vtk.vtkLogger.SetStderrVerbosity(vtk.vtkLogger.VERBOSITY_OFF)
        self._follow, self._zoom = follow, zoom
        self._ground = Ground(has_trails=has_trails)
        self._arena: Arena | None = None
        self._renderer = vtk.vtkRenderer(background=_share(OUTSIDE), use_fxaa=True)
        self._window = vtk.vtkRenderWindow(off_screen_rendering=True, multi_samples=0, size=size)
        self._window.AddRenderer(self._renderer)
        self._camera = vtk.vtkWindowToImageFilter(input=self._window, read_front_buffer=False)
        self._still: list[Any] = []
        self._moving: dict[tuple[str, int, int], Any] = {}

    def draw(self, moment: Moment, share: float, picture: Pixels) -> None:
        """Draw a moment, as `kiks.export.stage.Stage.draw` does."""
        arena = moment.saved.arena
        self._ground.draw(moment, share, GROUND_PIXELS / max(arena.width_mm, arena.height_mm))
        if arena is not self._arena:
            self._build(arena)
        self._floor.SetInputData(self._image(self._ground.canvas.pixels))
        self._place(moment)
        self._aim(moment)
        height, width = picture.shape[:2]
        self._camera.Modified()
        self._camera.Update()
        pixels = self._numpy.vtk_to_numpy(self._camera.GetOutput().GetPointData().GetScalars())
        picture[...] = pixels.reshape(height, width, 3)[::-1]

    def _build(self, arena: Arena) -> None:
        """Build the floor and the walls."""
        for actor in self._still:
            self._renderer.RemoveActor(actor)
        floor, self._floor = self._plate((arena.width_mm, arena.height_mm))
        floor.SetPosition(arena.width_mm / 2, arena.height_mm / 2, 0.0)
        self._still = [floor]
        for colour, boxes in walls(arena).items():
            append = self._vtk.vtkAppendPolyData()
            for box in boxes:
                source = self._source(box)  # a port does not keep it alive
                append.AddInputConnection(source.GetOutputPort())
            self._still.append(self._actor(append, colour))
        for actor in self._still:
            self._renderer.AddActor(actor)
        self._arena = arena

    def _place(self, moment: Moment) -> None:
        """Place robots, balls and cylinders."""
        present = {thing.key: thing for thing in things(moment)}
        for key in self._moving.keys() - present:
            self._renderer.RemoveActor(self._moving.pop(key))
        for key, thing in present.items():
            if key not in self._moving:
                self._moving[key] = self._vtk.vtkAssembly()
                for solid in thing.solids:
                    self._moving[key].AddPart(self._part(solid))
                self._renderer.AddActor(self._moving[key])
            self._moving[key].SetPosition(*thing.place)
            self._moving[key].SetOrientation(0.0, 0.0, math.degrees(thing.heading_rad))

    def _aim(self, moment: Moment) -> None:
        """Let the camera look from the south at the whole arena, or at the followed robot."""
        width, height = self._window.GetSize()
        camera = self._renderer.GetActiveCamera()
        focus, place = camera_places(moment, self._follow, self._zoom, width / height)
        camera.focal_point, camera.position = focus, place
        camera.view_angle, camera.view_up = VIEW_DEG, (0.0, 0.0, 1.0)
        self._renderer.ResetCameraClippingRange()

    def _part(self, solid: Solid) -> Any:
        if solid.shape == "plate":
            assert solid.pixels is not None
            part, texture = self._plate(solid.size)
            texture.SetInputData(self._image(solid.pixels))
            part.SetPosition(*solid.middle)
            return part
        source = self._source(solid)
        part = self._actor(source, solid.colour)
        if solid.pixels is not None:
            source.SetResolution(len(solid.pixels))
            mapper = part.GetMapper()
            mapper.Update()
            # Its faces begin ahead; its two ends are the last ones.
            colours = np.repeat(np.append(solid.pixels, [0, 0]).astype(np.uint8), 3).reshape(-1, 3)
            mapper.GetInput().GetCellData().SetScalars(self._numpy.numpy_to_vtk(colours, deep=True))
            mapper.SetScalarModeToUseCellData()
        if solid.shape == "upright":
            part.RotateX(90.0)
        if solid.shape != "box":
            part.SetPosition(*solid.middle)
        return part

    def _source(self, solid: Solid) -> Any:
        """Return what makes the faces of a solid: of a box where it is, of others about their middle, along y."""
        vtk, (length_mm, width_mm, height_mm) = self._vtk, solid.size
        if solid.shape == "box":
            return vtk.vtkCubeSource(center=solid.middle, x_length=length_mm, y_length=width_mm, z_length=height_mm)
        if solid.shape == "ball":
            return vtk.vtkSphereSource(radius=length_mm / 2, theta_resolution=ROUND, phi_resolution=ROUND // 2)
        long_mm = width_mm if solid.shape == "wheel" else height_mm
        return vtk.vtkCylinderSource(radius=length_mm / 2, height=long_mm, resolution=ROUND)

    def _plate(self, size: Sequence[float]) -> tuple[Any, Any]:
        """Return a picture that lies around the origin, and its texture."""
        x_mm, y_mm = size[0] / 2, size[1] / 2
        corners = {"origin": (-x_mm, -y_mm, 0.0), "point1": (x_mm, -y_mm, 0.0), "point2": (-x_mm, y_mm, 0.0)}
        texture = self._vtk.vtkTexture(interpolate=True)
        actor = self._actor(self._vtk.vtkPlaneSource(**corners))
        actor.texture, actor.property.lighting = texture, False
        return actor, texture

    def _actor(self, source: Any, colour: Colour | None = None) -> Any:
        mapper = self._vtk.vtkPolyDataMapper()
        mapper.SetInputConnection(source.GetOutputPort())
        actor = self._vtk.vtkActor(mapper=mapper)
        if colour is not None:
            looks = actor.property
            looks.color, looks.ambient, looks.diffuse = _share(colour), 0.35, 0.7
        return actor

    def _image(self, pixels: NDArray[np.uint8]) -> Any:
        """Return a picture as VTK has it, with row 0 at the bottom."""
        height, width, depth = pixels.shape
        image = self._vtk.vtkImageData(dimensions=(width, height, 1))
        flat = np.ascontiguousarray(pixels[::-1]).reshape(-1, depth)
        image.GetPointData().SetScalars(self._numpy.numpy_to_vtk(flat, deep=True))
        return image


def _share(colour: Colour) -> list[float]:
    return [part / 255 for part in colour[:3]]

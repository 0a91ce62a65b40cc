"""Pictures of a world from above: walls, lamps, robots, balls and cylinders, where they began, and their paths."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import BALL, BODY, CYLINDER
from kiks.export.looks import Colour, body_colour, robot_colour
from kiks.export.sheet import FINER, Place, Sheet, ground_picture, path_colour, path_mm
from kiks.model.arena import Arena, Ball
from kiks.model.atomic_files import ending_of, replace_file
from kiks.model.robot import Body, RobotSpec
from kiks.recording.moments import moments
from kiks.recording.recording import Recording
from kiks.sim.simulation import Simulation
from kiks.units import NS_PER_S

if TYPE_CHECKING:
    from PIL.Image import Image

PICTURES = {".png": "PNG", ".svg": "SVG", ".pdf": "PDF", ".jpg": "JPEG"}
"""The types of pictures by their endings."""

POINT_NS, POINTS_MAX = NS_PER_S // 10, 20_000
"""Time between two points of a path [ns], and the most points of a path: of a longer run they lie farther apart."""

_LONGEST_SIDE = 1200
_PAGE_INCHES = 7.0
_BODY_PATH_MM = 2.4


class Trails(NamedTuple):
    """The paths of robots and bodies, from where they began to where they are.

    Attributes:
        robots: Of each robot, its points: x_mm, y_mm and perhaps more.
        bodies: Of each ball and cylinder by its number, its points: x_mm, y_mm.
    """

    robots: Sequence[Sequence[Sequence[float]]]
    bodies: Mapping[int, Sequence[Place]]


@dataclass(frozen=True)
class Picture:
    """What a picture shows.

    Attributes:
        arena: The arena.
        lamps: x_mm, y_mm, power_w, and 1 for on or 0 for off, float64 [lamp, 4].
        bodies: Records of `kiks.engine.state.BODY`, shape [body].
        poses: Of the robots: x_mm, y_mm, heading_rad, float64 [robot, 3].
        robots: The robots' shapes.
        trails: The paths that are drawn, with faint rings where they begin; None for none.
        spec: The robot for whose sensors the light of lamps is drawn; a Khepera if None.

    Example:
        >>> Picture.of_simulation(Simulation(Arena.box(300, 200))).image().size
        (600, 400)
    """

    arena: Arena
    lamps: NDArray[np.float64]
    bodies: NDArray[np.void]
    poses: NDArray[np.float64]
    robots: Sequence[Body]
    trails: Trails | None = None
    spec: RobotSpec | None = None

    @classmethod
    def of_simulation(cls, sim: Simulation) -> Picture:
        """Return the picture of a simulation as it stands."""
        robots = [spec.body for spec in sim.specs]
        spec = next(iter(sim.specs), None)
        return cls(sim.arena, sim.world.lamps, sim.bodies(), sim.poses(), robots, spec=spec)

    @classmethod
    def of_arena(cls, arena: Arena) -> Picture:
        """Return the picture of an arena with its lamps, balls and cylinders, and a Khepera at each start."""
        bodies = np.zeros(len(arena.bodies), BODY)
        for record, body in zip(bodies, arena.bodies, strict=True):
            record["x_mm"], record["y_mm"], record["radius_mm"] = body.x_mm, body.y_mm, body.radius_mm
            record["brightness"], record["what"] = body.brightness, BALL if isinstance(body, Ball) else CYLINDER
        lamps, starts = (np.array(rows, np.float64) for rows in (arena.lamps, arena.starts))
        robots = [RobotSpec.load("khepera").body] * len(starts)
        return cls(arena, lamps.reshape(-1, 4), bodies, starts.reshape(-1, 3), robots)

    @classmethod
    def of_recording(cls, recording: Recording, time_ns: int) -> Picture:
        """Return the picture of a recorded world at a time [ns], with the paths up to it."""
        begin_ns = recording.log.begin_ns
        step_ns = max(POINT_NS, (time_ns - begin_ns) // POINTS_MAX)
        paths: list[list[Sequence[float]]] = []
        places: dict[int, list[Place]] = {}
        for moment in moments(recording.log, [*range(begin_ns, time_ns, step_ns), time_ns]):
            paths += [[] for _ in range(len(moment.poses) - len(paths))]
            for path, pose in zip(paths, moment.poses.tolist(), strict=False):
                path.append(pose)
            for number, x_mm, y_mm in moment.bodies[["number", "x_mm", "y_mm"]].tolist():
                places.setdefault(number, []).append((x_mm, y_mm))
        robots = [spec.body for spec in moment.saved.specs]
        saved, trails = moment.saved, Trails(paths, places)
        spec = next(iter(saved.specs), None)
        return cls(saved.arena, saved.lamps, moment.bodies, moment.poses, robots, trails, spec)

    def image(self, *, longest_side: int = _LONGEST_SIDE) -> Image:
        """Return it in pixels, of which a side has at most so many."""
        from PIL import Image

        sheet = self._sheet(longest_side)
        width, height = sheet.image.size
        return sheet.image.resize((width // FINER, height // FINER), Image.Resampling.LANCZOS)

    def save(self, path: str | Path) -> None:
        """Write it to a file: with lines that stay sharp if it ends in .svg, else in pixels."""
        if _type_of(path) != "SVG":
            save_image(self.image(), path)
            return
        sheet = self._sheet(_LONGEST_SIDE, pen := _SvgPen())
        replace_file(path, _svg(sheet.image, pen.elements), "a picture")

    def _sheet(self, longest_side: int, pen: _SvgPen | None = None) -> Sheet:
        """Return a sheet with all of it."""
        arena, count = self.arena, len(self.poses)
        scale = FINER * min(longest_side / max(arena.width_mm, arena.height_mm), 2.0)
        size = (max(round(arena.width_mm * scale), FINER), max(round(arena.height_mm * scale), FINER))
        sheet = Sheet(ground_picture(arena, self.lamps, self.spec, size), scale, 0.0, arena.height_mm, pen)
        for x_mm, y_mm, _, is_on in self.lamps.tolist():
            sheet.lamp((x_mm, y_mm), is_on=bool(is_on))
        if self.trails is not None:
            for index, (robot, path) in enumerate(zip(self.robots, self.trails.robots, strict=False)):
                colours = (path_colour(index, count, k / max(len(path) - 1, 1)) for k in range(len(path)))
                sheet.path(path, colours, path_mm(count))
                sheet.ring(path[0][:2], robot.radius_mm, (*robot_colour(index), 90))
            for body in self.bodies:
                places = self.trails.bodies[int(body["number"])]
                sheet.line(places, (*body_colour(body), 200), _BODY_PATH_MM)
                sheet.ring(places[0], float(body["radius_mm"]), (*body_colour(body), 190))
        for body in self.bodies:
            sheet.body(body)
        for index, (pose, robot) in enumerate(zip(self.poses.tolist(), self.robots, strict=False)):
            sheet.robot(pose, robot, index)
        return sheet


def save_picture(recording: Recording, path: str | Path, *, time_s: float | None = None) -> None:
    """Draw a recorded world from above, with the paths of all that moved.

    Args:
        recording: The recording.
        path: The picture's file; .svg has lines that stay sharp.
        time_s: When [s]; the end of the recording if left out.
    """
    _type_of(path)
    time_ns = recording.log.end_ns if time_s is None else recording.time_ns(time_s)
    Picture.of_recording(recording, time_ns).save(path)


def save_image(image: Image, path: str | Path) -> None:
    """Write an image in pixels; the type follows from the ending."""
    pixels, kind = BytesIO(), _type_of(path)
    # PDF: so many pixels an inch that it fits a page across, and pixels as they are.
    image.save(pixels, kind, **({"resolution": image.width / _PAGE_INCHES, "quality": 95} if kind == "PDF" else {}))
    replace_file(path, pixels.getvalue(), "a picture")


def _type_of(path: str | Path) -> str:
    return PICTURES[ending_of(path, "a picture", PICTURES)]


class _SvgPen:
    """Draws what Pillow's `ImageDraw` would draw, as elements of SVG; of its methods those that a sheet uses."""

    def __init__(self) -> None:
        self.elements: list[str] = []

    def ellipse(
        self, box: tuple[float, ...], fill: Colour | None = None, outline: Colour | None = None, width: float = 1
    ) -> None:
        left, top, right, bottom = box
        edge = 0.0 if outline is None else width / 2  # Pillow's outline lies within the box
        place = (
            f'cx="{(left + right) / 2:.1f}" cy="{(top + bottom) / 2:.1f}" r="{max((right - left) / 2 - edge, 0):.1f}"'
        )
        self._add("circle", place, fill, outline, width)

    def polygon(self, points: Sequence[Place], fill: Colour | None = None) -> None:
        self._add("polygon", _svg_points(points), fill, None, 0)

    def line(self, points: Sequence[Place], fill: Colour | None = None, width: float = 1, joint: str = "") -> None:
        self._add("polyline", _svg_points(points) + ' stroke-linejoin="round"', None, fill, width)

    def text(self, at: Place, text: str, fill: Colour | None = None, font: Any = None, **_others: Any) -> None:
        place = f'x="{at[0]:.1f}" y="{at[1]:.1f}" font-size="{font.size:.1f}" font-family="sans-serif"'
        place += ' font-weight="bold" text-anchor="middle" dominant-baseline="central"'
        self._add("text", place, fill, None, 0, text)

    def _add(
        self, kind: str, shape: str, fill: Colour | None, stroke: Colour | None, width: float, text: str = ""
    ) -> None:
        words = [kind, shape, *_svg_colour("fill", fill)]
        if stroke is not None:
            words += [*_svg_colour("stroke", stroke), f'stroke-width="{width:.1f}"']
        self.elements.append(f"<{' '.join(words)}>{text}</{kind}>")


def _svg_points(points: Sequence[Place]) -> str:
    return f'points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in points)}"'


def _svg_colour(name: str, colour: Colour | None) -> Iterable[str]:
    yield f'{name}="none"' if colour is None else f'{name}="#{bytes(colour[:3]).hex()}"'
    if colour is not None and len(colour) > 3:
        yield f'{name}-opacity="{colour[3] / 255:.2f}"'


def _svg(image: Image, elements: Sequence[str]) -> str:
    """Return a file with the picture of a sheet, and elements above it; it is shown smaller than they are."""
    pixels = BytesIO()
    image.save(pixels, "PNG")
    size = f'width="{image.width}" height="{image.height}"'
    data = b64encode(pixels.getvalue()).decode()
    shown = f'width="{image.width // FINER}" height="{image.height // FINER}"'
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {image.width} {image.height}" {shown}>',
        f'<image {size} href="data:image/png;base64,{data}"/>',
        *elements,
        "</svg>",
    ]
    return "\n".join(lines) + "\n"

"""Pictures of a world from above: walls, lamps, robots, balls and cylinders, where they began, and their paths."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import BALL, BODY, CYLINDER
from kiks.export.caption import Caption, Sign, letter_pixels, scale_bar
from kiks.export.kinds import KINDS
from kiks.export.looks import lit_leds
from kiks.export.sheet import FINER, LAMP_MM, WHITE, Place, Sheet, ground_picture, path_colour, path_mm, pen_on
from kiks.export.vector_pen import UNIT_POINTS, VectorPen, figure_bytes
from kiks.model.arena import Arena, Ball
from kiks.model.atomic_files import ending_of, replace_file
from kiks.model.replaceable import MADE_BY
from kiks.model.robot import RobotSpec
from kiks.recording.moments import moments
from kiks.recording.recording import Recording
from kiks.recording.rerun import RunPiece
from kiks.sim.colours import Colour, body_colour, robot_colour
from kiks.sim.simulation import Simulation
from kiks.units import NS_PER_S, s_from_ns

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL.Image import Image

PICTURES = KINDS["picture"].endings
"""The endings of pictures."""

POINT_NS, POINTS_MAX = NS_PER_S // 10, 20_000
"""Time between two points of a path [ns], and the most points of a path: of a longer run they lie farther apart."""

_LONGEST_SIDE = 1200
_PAGE_SHARE = 0.6
_BODY_PATH_MM = 2.4
_PATH_SHARE = 0.002  # of the arena: a thinner path is not seen in a column of a paper
_PATHS_MAX = 6


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
        specs: The robots' kinds; the light of lamps is drawn for the sensors of the first, or a Khepera's.
        trails: The paths that are drawn, with faint rings where they begin; None for none.
        title: What the caption begins with: who drove, with which seed.
        lit: Which LEDs of each robot are lit, as `lit_leds` says; none if left out.

    Example:
        >>> Picture.of_simulation(Simulation(Arena.box(300, 200))).image().size
        (600, 400)
    """

    arena: Arena
    lamps: NDArray[np.float64]
    bodies: NDArray[np.void]
    poses: NDArray[np.float64]
    specs: Sequence[RobotSpec]
    trails: Trails | None = None
    title: str = ""
    lit: Sequence[int] = ()

    @classmethod
    def of_simulation(cls, sim: Simulation) -> Picture:
        """Return the picture of a simulation as it stands."""
        title = ", ".join(filter(None, (sim.arena.name, f"seed {sim.seed}", f"{sim.time_s:.1f} s")))
        lit = lit_leds(sim.specs, sim.world.state.robots[0]).tolist()
        return cls(sim.arena, sim.world.lamps, sim.bodies(), sim.poses(), sim.specs, title=title, lit=lit)

    @classmethod
    def of_arena(cls, arena: Arena) -> Picture:
        """Return the picture of an arena with its lamps, balls and cylinders, and a Khepera at each start."""
        bodies = np.zeros(len(arena.bodies), BODY)
        for record, body in zip(bodies, arena.bodies, strict=True):
            record["x_mm"], record["y_mm"], record["radius_mm"] = body.x_mm, body.y_mm, body.radius_mm
            record["brightness"], record["what"] = body.brightness, BALL if isinstance(body, Ball) else CYLINDER
        lamps, starts = (np.array(rows, np.float64) for rows in (arena.lamps, arena.starts))
        specs = [RobotSpec.load("khepera")] * len(starts)
        title = ", ".join(filter(None, (arena.name, f"{arena.width_mm:g} x {arena.height_mm:g} mm")))
        return cls(arena, lamps.reshape(-1, 4), bodies, starts.reshape(-1, 3), specs, title=title)

    @classmethod
    def of_recording(cls, recording: Recording, time_ns: int, pieces: Iterable[RunPiece] | None = None) -> Picture:
        """Return the picture of a recorded world at a time [ns], with the paths up to it; see `moments` for pieces."""
        begin_ns = recording.log.begin_ns
        step_ns = max(POINT_NS, (time_ns - begin_ns) // POINTS_MAX)
        paths: list[list[Sequence[float]]] = []
        places: dict[int, list[Place]] = {}
        for moment in moments(recording.log, [*range(begin_ns, time_ns, step_ns), time_ns], pieces):
            paths += [[] for _ in range(len(moment.poses) - len(paths))]
            for path, pose in zip(paths, moment.poses.tolist(), strict=False):
                path.append(pose)
            for number, x_mm, y_mm in moment.bodies[["number", "x_mm", "y_mm"]].tolist():
                places.setdefault(number, []).append((x_mm, y_mm))
        saved, trails = moment.saved, Trails(paths, places)
        title = f"{recording.what}, {s_from_ns(time_ns - begin_ns):.1f} s"
        lit = lit_leds(saved.specs, moment.robots).tolist()
        return cls(saved.arena, saved.lamps, moment.bodies, moment.poses, saved.specs, trails, title, lit)

    def image(self, *, longest_side: int = _LONGEST_SIDE) -> Image:
        """Return the arena alone in pixels, of which a side has at most so many."""
        return _shrunk(self._image(longest_side))

    def captioned(self) -> Image:
        """Return it in pixels, with its caption."""
        from PIL import Image

        arena = self._image(_LONGEST_SIDE)
        width = _page_width(arena.size)
        caption = Caption(self.title, self._signs(arena.width, width), width, pen_on(arena).textlength)
        words = Image.new("RGB", (width, caption.height), WHITE)
        caption.draw(Sheet(pen_on(words), 1.0, 0.0, 0.0))
        page = Image.new("RGB", (width, arena.height + caption.height), WHITE)
        page.paste(arena, (0, 0))
        page.paste(words, (0, arena.height))
        return _shrunk(page)

    def save(self, path: str | Path) -> None:
        """Write it to a file, with its caption: with lines that stay sharp if it ends in .svg or .pdf."""
        kind = ending_of(path, "a picture", PICTURES)
        if kind in (".svg", ".pdf"):
            replace_file(path, figure_bytes(self._figure(), kind[1:]), "a picture")
        else:
            save_image(self.captioned(), path)

    def draw_on(self, axes: Any, inches: float) -> None:
        """Draw the arena on axes of Matplotlib, in millimetres.

        Args:
            axes: The axes.
            inches: About how wide it is on paper, from which the width of lines follows.
        """
        arena = self.arena
        scale = inches * 72 / UNIT_POINTS / arena.width_mm
        axes.set(xlim=(0, arena.width_mm), ylim=(0, arena.height_mm), aspect="equal")
        pen = VectorPen(axes, scale, arena.height_mm)
        pen.ground(arena, self.lamps, self.specs)
        self._draw(Sheet(pen, scale, 0.0, arena.height_mm))

    def _image(self, longest_side: int) -> Image:
        """Return the arena, FINER times as large."""
        arena, (width, height) = self.arena, self._size(longest_side)
        image = ground_picture(arena, self.lamps, self.specs, (width, height))
        self._draw(Sheet(pen_on(image), width / arena.width_mm, 0.0, arena.height_mm))
        return image

    def _figure(self) -> Figure:
        """Return it as a figure of Matplotlib, with its caption."""
        from matplotlib.figure import Figure

        width, height = self._size(_LONGEST_SIDE)
        across = _page_width((width, height))
        caption = Caption(self.title, self._signs(width, across), across, VectorPen.textlength)
        whole, inch = height + caption.height, 72 / UNIT_POINTS
        figure = Figure(figsize=(across / inch, whole / inch))
        self.draw_on(figure.add_axes((0, caption.height / whole, width / across, height / whole)), width / inch)
        words = figure.add_axes((0, 0, 1, caption.height / whole), xlim=(0, across), ylim=(-caption.height, 0))
        caption.draw(Sheet(VectorPen(words, 1.0, 0.0), 1.0, 0.0, 0.0))
        for axes in figure.axes:
            axes.set(xticks=[], yticks=[])
            axes.spines[:].set_visible(False)
        return figure

    def _size(self, longest_side: int) -> tuple[int, int]:
        """Return width and height of the arena [pixels of a sheet]."""
        sides_mm = self.arena.width_mm, self.arena.height_mm
        scale = FINER * min(longest_side / max(sides_mm), 2.0)
        width, height = (max(round(side_mm * scale), FINER) for side_mm in sides_mm)
        return width, height

    def _draw(self, sheet: Sheet) -> None:
        """Draw all of it on a sheet that has the walls."""
        count, seen_mm = len(self.poses), _PATH_SHARE * max(self.arena.width_mm, self.arena.height_mm)
        for x_mm, y_mm, _, is_on in self.lamps.tolist():
            sheet.lamp((x_mm, y_mm), is_on=bool(is_on))
        if self.trails is not None:
            for index, (spec, path) in enumerate(zip(self.specs, self.trails.robots, strict=False)):
                sheet.path(path, _path_colours(index, count, len(path)), max(path_mm(count), seen_mm))
                sheet.ring(path[0][:2], spec.body.radius_mm, (*robot_colour(index), 90))
            for body in self.bodies:
                places = self.trails.bodies[int(body["number"])]
                sheet.line(places, (*body_colour(body), 200), _BODY_PATH_MM)
                sheet.ring(places[0], float(body["radius_mm"]), (*body_colour(body), 190))
        for body in self.bodies:
            sheet.body(body)
        for index, (pose, spec) in enumerate(zip(self.poses.tolist(), self.specs, strict=False)):
            sheet.robot(pose, spec, index, self.lit[index] if self.lit else 0)

    def _signs(self, width: int, page_width: int) -> list[Sign]:
        """Return what its caption explains, by the width of the arena and of the page [pixels]."""
        pixel_mm = self.arena.width_mm / width
        signs = [scale_bar(page_width * pixel_mm, letter_pixels(page_width) * pixel_mm)]
        count = len(self.poses) if self.trails is not None and self.trails.robots else 0
        signs += [_path_sign(index, count) for index in range(count if count <= _PATHS_MAX else 1)]
        signs += [_lamp_sign(is_on=is_on) for is_on in (True, False) if (self.lamps[:, 3] == is_on).any()]
        firsts = (self.bodies[self.bodies["what"] == what][:1] for what in (BALL, CYLINDER))
        signs += [_body_sign(body) for first in firsts for body in first]
        return signs


def _shrunk(image: Image) -> Image:
    from PIL import Image

    return image.resize((image.width // FINER, image.height // FINER), Image.Resampling.LANCZOS)


def _page_width(size: tuple[int, int]) -> int:
    """Return the width of the page of an arena [pixels]: a narrow one leaves some of it free, for words."""
    return max(size[0], round(_PAGE_SHARE * size[1]))


def _path_colours(index: int, robot_count: int, points: int) -> Iterator[Colour]:
    return (path_colour(index, robot_count, k / max(points - 1, 1)) for k in range(points))


def _path_sign(index: int, robot_count: int) -> Sign:
    """Return the sign of a robot's path, with the ring where it began; one for all if there are many."""
    radius_mm, end_mm = 13.0, 90.0

    def draw(sheet: Sheet) -> None:
        line = [(x_mm, 0.0) for x_mm in np.linspace(radius_mm, end_mm, 26).tolist()]
        sheet.path(line, _path_colours(index, robot_count, len(line)), 2.4)
        sheet.ring(line[0], radius_mm, (*robot_colour(index), 90))

    text = f"robot {index + 1}, from its start"
    return Sign(draw, end_mm, text if robot_count <= _PATHS_MAX else "each robot, from its start")


def _lamp_sign(*, is_on: bool) -> Sign:
    def draw(sheet: Sheet) -> None:
        sheet.lamp((LAMP_MM, 0.0), is_on=is_on)

    return Sign(draw, 2 * LAMP_MM, "lamp" if is_on else "lamp that is off")


def _body_sign(body: Any) -> Sign:
    body, radius_mm = body.copy(), float(body["radius_mm"])
    body["x_mm"], body["y_mm"] = radius_mm, 0.0

    def draw(sheet: Sheet) -> None:
        sheet.body(body)

    return Sign(draw, 2 * radius_mm, "ball" if body["what"] == BALL else "cylinder", 2.2 * radius_mm)


def save_picture(recording: Recording, path: str | Path, *, time_s: float | None = None) -> None:
    """Draw a recorded world from above, with the paths of all that moved.

    Args:
        recording: The recording.
        path: The picture's file; .svg has lines that stay sharp.
        time_s: When [s]; the end of the recording if left out.
    """
    ending_of(path, "a picture", PICTURES)
    time_ns = recording.log.end_ns if time_s is None else recording.time_ns(time_s)
    Picture.of_recording(recording, time_ns).save(path)


def save_image(image: Image, path: str | Path) -> None:
    """Write an image in pixels; the type follows from the ending, .png or .jpg."""
    from PIL.PngImagePlugin import PngInfo

    pixels, about = BytesIO(), PngInfo()
    about.add_text("Software", MADE_BY)
    if ending_of(path, "a picture", PICTURES) == ".png":
        image.save(pixels, "PNG", pnginfo=about)
    else:
        image.save(pixels, "JPEG", comment=MADE_BY)
    replace_file(path, pixels.getvalue(), "a picture")

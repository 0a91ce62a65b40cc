"""Photos of recordings: light is followed by Mitsuba, with shadows, as a camera would see the arena."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import BALL
from kiks.errors import library
from kiks.export.film import SIZE, checked_follow, checked_size
from kiks.export.looks import Colour, body_colour, robot_colour
from kiks.export.pictures import check_picture, save_image
from kiks.export.sheet import FLOOR, INK
from kiks.export.solid_stage import (
    CHASSIS_MM,
    CYLINDER_MM,
    ROBOT_MM,
    VIEW_DEG,
    WALL_MM,
    camera_places,
    robot_top,
    stripe_greys,
    wall_boxes,
)
from kiks.model.checks import check_count
from kiks.model.robot_parts import Body
from kiks.recording.moments import Moment, moments
from kiks.recording.recording import Recording

SAMPLES, SAMPLES_MAX = 48, 4096
"""Rays through a pixel if nothing else is asked for, and the most: more of them are slower and less grainy."""

BOUNCES = 4

SKY, CEILING = 0.55, 2.6
"""Radiance of the surroundings, and of a soft light over the arena."""

LAMP_MM, LAMP_RADIUS_MM, LAMP_RADIANCE = 45.0, 8.0, 25.0
"""Height and radius of a lamp [mm], and its radiance a watt."""


def save_photo(
    recording: Recording,
    path: str | Path,
    *,
    time_s: float | None = None,
    size: tuple[int, int] = SIZE,
    follow: int | None = None,
    zoom: float | None = None,
    samples: int = SAMPLES,
) -> None:
    """Take a photo of a recorded world: 1280 x 720 pixels take a minute or two on two cores.

    Args:
        recording: The recording.
        path: The picture's file, .png or .jpg.
        time_s: When [s]; the end of the recording if left out.
        size: Width and height [pixels].
        follow: Number of the robot in the middle; if left out, the whole arena is seen.
        zoom: How much larger the arena is than one that is seen as a whole; 3 if left out, with `follow` alone.
        samples: Rays through a pixel.
    """
    from PIL import Image

    check_picture(path)
    size = checked_size(size)
    follow, zoom = checked_follow(recording, follow, zoom)
    samples = check_count("samples", samples, 1, SAMPLES_MAX)
    time_ns = recording.log.end_ns if time_s is None else recording.time_ns(time_s)
    (moment,) = moments(recording.log, [time_ns])
    mitsuba = library("mitsuba", "render")
    mitsuba.set_variant("scalar_rgb")
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    scene = _Scene(mitsuba, moment)
    scene.aim(size, None if follow is None else follow - 1, zoom, samples)
    bitmap = mitsuba.Bitmap(mitsuba.render(mitsuba.load_dict(scene.parts)))
    pixels = bitmap.convert(mitsuba.Bitmap.PixelFormat.RGB, mitsuba.Struct.Type.UInt8, srgb_gamma=True)
    save_image(Image.fromarray(np.array(pixels)), path)


class _Scene:
    """The parts of a scene of Mitsuba.

    Args:
        mitsuba: The module.
        moment: What is in the scene.

    Attributes:
        parts: By their names.
    """

    def __init__(self, mitsuba: Any, moment: Moment) -> None:
        self._mitsuba, self._moment = mitsuba, moment
        arena = moment.setup.arena
        self.parts: dict[str, Any] = {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": BOUNCES},
            "sky": {"type": "constant", "radiance": {"type": "rgb", "value": SKY}},
        }
        middle, longest = (arena.width_mm / 2, arena.height_mm / 2), max(arena.width_mm, arena.height_mm)
        # It hangs aside, so that shadows are seen.
        place = middle[0] - longest, middle[1], 1.5 * longest
        ceiling = self._place().look_at(origin=place, target=(*middle, 0.0), up=(0.0, 0.0, 1.0)).scale(0.5 * longest)
        light = {"type": "area", "radiance": {"type": "rgb", "value": CEILING}}
        self._add("rectangle", to_world=ceiling, emitter=light)
        floor = self._place().translate((*middle, 0.0)).scale((*middle, 1.0))
        self._add("rectangle", to_world=floor, bsdf=_matt(FLOOR))
        for brightness, boxes in wall_boxes(arena).items():
            for left, right, low, high in boxes:
                self._add_box(left, right, low, high, brightness)
        for x_mm, y_mm, power_w, is_on in moment.lamps.tolist():
            self._add_lamp(x_mm, y_mm, power_w, is_on=bool(is_on))
        for body in moment.bodies:
            self._add_body(body)
        for index, (pose, spec) in enumerate(zip(moment.poses.tolist(), moment.setup.specs, strict=False)):
            self._add_robot(pose, spec.body, index)

    def aim(self, size: tuple[int, int], follow: int | None, zoom: float, samples: int) -> None:
        """Put the camera up."""
        focus, place = camera_places(self._moment, follow, zoom, size[0] / size[1])
        self.parts["camera"] = {
            "type": "perspective",
            "fov": VIEW_DEG,
            "fov_axis": "y",
            "to_world": self._place().look_at(origin=place, target=focus, up=(0.0, 0.0, 1.0)),
            "film": {"type": "hdrfilm", "width": size[0], "height": size[1]},
            "sampler": {"type": "independent", "sample_count": samples},
        }

    def _add(self, kind: str, **values: Any) -> None:
        self.parts[f"part {len(self.parts)}"] = {"type": kind, **values}

    def _add_box(self, left: float, right: float, low: float, high: float, brightness: int) -> None:
        middle = (left + right) / 2, (low + high) / 2, WALL_MM / 2
        place = self._place().translate(middle).scale(((right - left) / 2, (high - low) / 2, WALL_MM / 2))
        grey = 60 + brightness * 180 // 255
        self._add("cube", to_world=place, bsdf=_matt((grey, grey, grey)))

    def _add_lamp(self, x_mm: float, y_mm: float, power_w: float, *, is_on: bool) -> None:
        values: dict[str, Any] = {"bsdf": _matt((150, 145, 130))}
        if is_on:
            warm = [part * LAMP_RADIANCE * power_w for part in (1.0, 0.8, 0.4)]
            values = {"emitter": {"type": "area", "radiance": {"type": "rgb", "value": warm}}}
        self._add("sphere", center=(x_mm, y_mm, LAMP_MM), radius=LAMP_RADIUS_MM, **values)

    def _add_body(self, body: Any) -> None:
        place, radius_mm = (float(body["x_mm"]), float(body["y_mm"])), float(body["radius_mm"])
        low_mm = ROBOT_MM if body["is_lifted"] else 0.0
        if body["what"] == BALL:
            shine = {"type": "plastic", "diffuse_reflectance": {"type": "rgb", "value": _linear(body_colour(body))}}
            self._add("sphere", center=(*place, low_mm + radius_mm), radius=radius_mm, bsdf=shine)
        else:
            self._add_upright(place, radius_mm, low_mm, low_mm + CYLINDER_MM, body_colour(body))

    def _add_robot(self, pose: list[float], body: Body, index: int) -> None:
        x_mm, y_mm, heading_rad = pose
        radius_mm = body.radius_mm
        self._add_upright((x_mm, y_mm), 0.97 * radius_mm, CHASSIS_MM, ROBOT_MM, robot_colour(index))
        if body.stripe_count:
            stripes = self._bitmap(np.repeat(stripe_greys(body)[np.newaxis, :, np.newaxis], 3, axis=2))
            paint = {"type": "diffuse", "reflectance": stripes | {"filter_type": "nearest"}}
            place = self._place().translate((x_mm, y_mm, CHASSIS_MM)).rotate((0, 0, 1), math.degrees(heading_rad))
            place = place.scale((0.98 * radius_mm, 0.98 * radius_mm, ROBOT_MM - CHASSIS_MM))
            self._add("cylinder", to_world=place, bsdf={"type": "twosided", "paint": paint})
        aside = -math.sin(heading_rad), math.cos(heading_rad), 0.0
        wheel_mm, width_mm = ROBOT_MM / 4, 0.2 * radius_mm
        for side in (-1.0, 1.0):
            inner_mm = 0.8 * side * radius_mm
            origin = x_mm + inner_mm * aside[0], y_mm + inner_mm * aside[1], wheel_mm
            outwards = tuple(place + side * part for place, part in zip(origin, aside, strict=True))
            axle = self._place().look_at(origin=origin, target=outwards, up=(0.0, 0.0, 1.0))
            self._add("cylinder", to_world=axle.scale((wheel_mm, wheel_mm, width_mm)), bsdf=_two_sided(INK))
            rim = axle.translate((0.0, 0.0, width_mm)).scale((wheel_mm, wheel_mm, 1.0))
            self._add("disk", to_world=rim, bsdf=_two_sided(INK))
        top = robot_top(body, index)[::-1]  # row 0 of a bitmap is at the bottom
        place = self._place().translate((x_mm, y_mm, ROBOT_MM + 0.3)).rotate((0, 0, 1), math.degrees(heading_rad))
        paint = {"type": "diffuse", "reflectance": self._bitmap(top[..., :3])}
        mask = {"type": "mask", "opacity": self._bitmap(top[..., 3:]), "nested": {"type": "twosided", "paint": paint}}
        self._add("rectangle", to_world=place.scale((radius_mm, radius_mm, 1.0)), bsdf=mask)

    def _add_upright(
        self, place: tuple[float, float], radius_mm: float, low_mm: float, high_mm: float, colour: Colour
    ) -> None:
        """Add an upright cylinder."""
        bottom, top = (*place, low_mm), (*place, high_mm)
        self._add("cylinder", p0=bottom, p1=top, radius=radius_mm, bsdf=_two_sided(colour))
        lid = self._place().translate(top).scale((radius_mm, radius_mm, 1.0))
        self._add("disk", to_world=lid, bsdf=_two_sided(colour))

    def _bitmap(self, pixels: NDArray[np.uint8]) -> dict[str, Any]:
        bitmap = self._mitsuba.Bitmap(np.ascontiguousarray(pixels))
        return {"type": "bitmap", "bitmap": bitmap, "raw": pixels.shape[-1] == 1}

    def _place(self) -> Any:
        return self._mitsuba.ScalarTransform4f()


def _matt(colour: Colour) -> dict[str, Any]:
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": _linear(colour)}}


def _two_sided(colour: Colour) -> dict[str, Any]:
    return {"type": "twosided", "matt": _matt(colour)}


def _linear(colour: Colour) -> list[float]:
    """Return the shares of light of a colour on the screen (IEC 61966-2-1)."""
    shares = [part / 255 for part in colour[:3]]
    return [share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares]

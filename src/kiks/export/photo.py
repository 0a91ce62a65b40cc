"""Photos of recordings: light is followed by Mitsuba, with shadows, as a camera would see the arena."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.errors import library
from kiks.export.film import SIZE, checked_follow, checked_size
from kiks.export.kinds import KINDS
from kiks.export.pictures import save_image
from kiks.export.sheet import FLOOR, darkness
from kiks.export.space import VIEW_DEG, Solid, camera_places, things, walls
from kiks.model.atomic_files import check_writable, ending_of
from kiks.model.checks import check_count
from kiks.recording.moments import Moment, moments
from kiks.recording.recording import Recording
from kiks.sim.colours import Colour

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
        zoom: Magnification, 1 to 20, with `follow` alone; 1 fits the whole arena, 3 if left out.
        samples: Rays through a pixel.
    """
    from PIL import Image

    ending_of(path, "a photo", KINDS["photo"].endings)
    check_writable(path, "a photo")
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
    """The parts of a scene of Mitsuba."""

    def __init__(self, mitsuba: Any, moment: Moment) -> None:
        self._mitsuba, self._moment, self._here = mitsuba, moment, mitsuba.ScalarTransform4f()
        arena, here = moment.saved.arena, self._here
        self.parts: dict[str, Any] = {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": BOUNCES},
            "sky": {"type": "constant", "radiance": {"type": "rgb", "value": SKY}},
        }
        middle, longest = (arena.width_mm / 2, arena.height_mm / 2), max(arena.width_mm, arena.height_mm)
        # The light hangs aside, so that shadows are seen.
        place = middle[0] - longest, middle[1], 1.5 * longest
        ceiling = here.look_at(origin=place, target=(*middle, 0.0), up=(0.0, 0.0, 1.0)).scale(0.5 * longest)
        light = {"type": "area", "radiance": {"type": "rgb", "value": CEILING}}
        self._add("rectangle", to_world=ceiling, emitter=light)
        floor = here.translate((*middle, 0.0)).scale((*middle, 1.0))
        paint = _matt(FLOOR)
        if arena.shades is not None:
            colours = (1.0 - darkness(arena.shades))[..., None] * np.array(FLOOR)
            paint = {"type": "diffuse", "reflectance": self._bitmap(colours.astype(np.uint8))}
        self._add("rectangle", to_world=floor, bsdf=paint)
        for x_mm, y_mm, power_w, is_on in moment.saved.lamps.tolist():
            self._add_lamp(x_mm, y_mm, power_w, is_on=bool(is_on))
        for boxes in walls(arena).values():
            for box in boxes:
                self._add_solid(box, here)
        for thing in things(moment):
            frame = here.translate(thing.place).rotate((0.0, 0.0, 1.0), math.degrees(thing.heading_rad))
            for solid in thing.solids:
                self._add_solid(solid, frame)

    def aim(self, size: tuple[int, int], follow: int | None, zoom: float, samples: int) -> None:
        """Put the camera up."""
        focus, place = camera_places(self._moment, follow, zoom, size[0] / size[1])
        self.parts["camera"] = {
            "type": "perspective",
            "fov": VIEW_DEG,
            "fov_axis": "y",
            "to_world": self._here.look_at(origin=place, target=focus, up=(0.0, 0.0, 1.0)),
            "film": {"type": "hdrfilm", "width": size[0], "height": size[1]},
            "sampler": {"type": "independent", "sample_count": samples},
        }

    def _add(self, kind: str, **values: Any) -> None:
        self.parts[f"part {len(self.parts)}"] = {"type": kind, **values}

    def _add_lamp(self, x_mm: float, y_mm: float, power_w: float, *, is_on: bool) -> None:
        values: dict[str, Any] = {"bsdf": _matt((150, 145, 130))}
        if is_on:
            warm = [part * LAMP_RADIANCE * power_w for part in (1.0, 0.8, 0.4)]
            values = {"emitter": {"type": "area", "radiance": {"type": "rgb", "value": warm}}}
        self._add("sphere", center=(x_mm, y_mm, LAMP_MM), radius=LAMP_RADIUS_MM, **values)

    def _add_solid(self, solid: Solid, frame: Any) -> None:
        place, (length_mm, width_mm, height_mm) = frame.translate(solid.middle), solid.size
        match solid.shape:
            case "box":
                half = length_mm / 2, width_mm / 2, height_mm / 2
                self._add("cube", to_world=place.scale(half), bsdf=_matt(solid.colour))
            case "ball":
                shine = {"type": "plastic", "diffuse_reflectance": {"type": "rgb", "value": _linear(solid.colour)}}
                self._add("sphere", to_world=place.scale(length_mm / 2), bsdf=shine)
            case "plate":
                assert solid.pixels is not None
                top = solid.pixels[::-1]  # row 0 of a bitmap is at the bottom
                paint = {"type": "diffuse", "reflectance": self._bitmap(top[..., :3])}
                nested = {"type": "twosided", "paint": paint}
                mask = {"type": "mask", "opacity": self._bitmap(top[..., 3:]), "nested": nested}
                self._add("rectangle", to_world=place.scale((length_mm / 2, width_mm / 2, 1.0)), bsdf=mask)
            case _:
                self._add_cylinder(solid, place)

    def _add_cylinder(self, solid: Solid, place: Any) -> None:
        """Add an upright or a wheel; cylinders of Mitsuba stand from 0 to 1, with their ends open."""
        radius_mm, long_mm = solid.size[0] / 2, solid.size[2]
        if solid.shape == "wheel":
            place, long_mm = place.rotate((1.0, 0.0, 0.0), 90.0), solid.size[1]
        paint: Any = _matt(solid.colour)
        if solid.pixels is not None:
            stripes = self._bitmap(np.repeat(solid.pixels[np.newaxis, :, np.newaxis], 3, axis=2))
            paint = {"type": "diffuse", "reflectance": stripes | {"filter_type": "nearest"}}
        low = place.translate((0.0, 0.0, -long_mm / 2))
        side = low.scale((radius_mm, radius_mm, long_mm))
        self._add("cylinder", to_world=side, bsdf={"type": "twosided", "paint": paint})
        for end in (low, place.translate((0.0, 0.0, long_mm / 2))):
            flat = end.scale((radius_mm, radius_mm, 1.0))
            self._add("disk", to_world=flat, bsdf={"type": "twosided", "paint": _matt(solid.colour)})

    def _bitmap(self, pixels: NDArray[np.uint8]) -> dict[str, Any]:
        bitmap = self._mitsuba.Bitmap(np.ascontiguousarray(pixels))
        return {"type": "bitmap", "bitmap": bitmap, "raw": pixels.shape[-1] == 1}


def _matt(colour: Colour) -> dict[str, Any]:
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": _linear(colour)}}


def _linear(colour: Colour) -> list[float]:
    """Return the shares of light of a colour on the screen (IEC 61966-2-1)."""
    shares = [part / 255 for part in colour[:3]]
    return [share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares]

"""Samples measured on a real robot: readers for tables, for the laboratory's text files, and the rays of each sample.

A table of samples was measured on a rig: the robot stands at a gap from one object and is turned on the spot. Angles of
tables grow clockwise, the direction to the object's nearest point less the robot's heading. The robot sat on its rig a
little askew (`RIG_OFFSET_DEG`): what a table calls straight ahead is that much to the left of the robot's nose.

Grammar of the text files (a table is `[distance, angle, sensor]`; blanks and tabs separate, empty lines do not count):

    file   = header block*                 as many blocks as the header says distances
    header = SENSORS ANGLES DISTANCES FIRST_MM STEP_MM      whole numbers, such as 8 180 20 5 2
    block  = "TURN" NUMBER row*            NUMBER counts the blocks from 0; as many rows as the header says angles
    row    = SENSORS readings, whole numbers from 0 to the robot's largest; row i is at i * 360 / ANGLES degrees
    end    = ["END"]                       may close the file
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError, shown
from kiks.model.array_checks import Numbers, read_arrays
from kiks.model.atomic_files import path_of
from kiks.model.checks import check_number
from kiks.model.data_file import COORDINATE_MAX, read_file
from kiks.model.limits import SAMPLES_FILE_NUMBERS_MAX
from kiks.model.robot import SENSOR_COUNT
from kiks.model.thesis_networks import BODY_RADIUS_MM

Floats = NDArray[np.float64]

RIG_OFFSET_DEG = 2.0
"""How far the robot was turned to the right on its rig [deg]: its sensors say 1.5 to 3 (README of the samples)."""

MAXIMUM_COUNTS = 1023
"""Largest reading of the converter (khepera-protocol.md 8.4)."""

ACTIVE_COUNTS = (20, 1000)
"""Least and largest reading of that converter that tells something: below is noise, above saturation."""

_ADVICE = "See the README of the samples."
_TABLE = {
    "gap_mm": Numbers(("gap",), 0.0, COORDINATE_MAX, advice=_ADVICE),
    "object_angle_deg_cw": Numbers(("angle",), -COORDINATE_MAX, COORDINATE_MAX, advice=_ADVICE),
    "values": Numbers(("gap", "angle", SENSOR_COUNT), 0, MAXIMUM_COUNTS, is_whole=True, advice=_ADVICE),
}

_HEADER = "sensors, angles, distances, first distance [mm] and step [mm], like '8 180 20 5 2'"


@dataclass(frozen=True, eq=False)
class Samples:
    """Readings of the eight sensors of a robot that was turned on the spot at several gaps from one object.

    Args:
        name: What people call the object.
        radius_mm: Radius of the object [mm]: infinite for a straight wall.
        gap_mm: From the robot's rim to the object's surface [mm], shape [gaps].
        angle_deg: From the robot's heading to the object, clockwise and without the rig's offset [deg], shape
            [gaps, angles].
        counts: Readings, shape [gaps, angles, 8].
    """

    name: str
    radius_mm: float
    gap_mm: Floats
    angle_deg: Floats
    counts: NDArray[np.int64]

    def at_angles(self, chosen: slice) -> Samples:
        """Return the samples of some of the angles: `slice(0, None, 2)` for those with an even index."""
        return replace(self, angle_deg=self.angle_deg[:, chosen], counts=self.counts[:, chosen])


@dataclass(frozen=True, eq=False)
class Fan:
    """Where the rays of each sensor begin and where they go, seen from the robot: x ahead, y to the left.

    Args:
        origin_mm: Where a sensor sits, shape [8, 2].
        direction_rad: Direction of each ray, counter-clockwise from ahead, the leftmost first, shape [8, rays].
        range_mm: Longest length of a ray [mm].
    """

    origin_mm: Floats
    direction_rad: Floats
    range_mm: float

    @classmethod
    def spread(
        cls,
        mount_angle_deg: tuple[float, ...],
        mount_radius_mm: tuple[float, ...],
        direction_deg: tuple[float, ...],
        *,
        range_mm: float = 50.0,
        offsets_deg: tuple[float, ...] = (60.0, 40.0, 20.0, 0.0, -20.0, -40.0, -60.0),
    ) -> Fan:
        """Return the fan of sensors at polar places [deg, mm] that look in directions [deg]; left is positive."""
        place = np.radians(mount_angle_deg)
        origin = np.stack([np.cos(place), np.sin(place)], axis=-1) * np.array(mount_radius_mm)[:, None]
        return cls(origin, np.radians(np.add.outer(np.array(direction_deg), np.array(offsets_deg))), range_mm)


def meet(samples: Samples, fan: Fan, body_radius_mm: float = BODY_RADIUS_MM) -> tuple[Floats, Floats]:
    """Return how far each ray goes before it meets the object, at most the fan's range [mm], and how it meets it.

    Geometry: a ray from p in the unit direction u meets the wall n.x = D after t = (D - n.p) / (n.u), and the disc with
    centre c and radius R after t = b - w, with b = u.(c - p), q = |c - p|^2 - R^2 and w = sqrt(b^2 - q). The angle of
    incidence has the cosine n.u on the wall and w / R on the disc.

    Returns:
        Lengths, and cosines of the incidence, 0 for a ray that meets nothing; shapes [gaps, angles, 8, rays].
    """
    towards = -np.radians(samples.angle_deg)
    normal = np.stack([np.cos(towards), np.sin(towards)], axis=-1)  # [gaps, angles, 2]
    ray = np.stack([np.cos(fan.direction_rad), np.sin(fan.direction_rad)], axis=-1)  # [8, rays, 2]
    rim_mm = body_radius_mm + samples.gap_mm
    with np.errstate(divide="ignore", invalid="ignore"):
        if math.isinf(samples.radius_mm):
            before_mm = rim_mm[:, None, None] - normal @ fan.origin_mm.T  # [gaps, angles, 8]
            cosine = np.einsum("gai,sri->gasr", normal, ray)
            length = before_mm[..., None] / cosine
        else:
            centre = (rim_mm + samples.radius_mm)[:, None, None] * normal
            between = centre[:, :, None, :] - fan.origin_mm  # [gaps, angles, 8, 2]
            along = np.einsum("gasi,sri->gasr", between, ray)
            outside = (between**2).sum(axis=-1) - samples.radius_mm**2
            within = np.sqrt(along**2 - outside[..., None])
            length, cosine = along - within, within / samples.radius_mm
    is_met = np.isfinite(length) & (length >= 0.0) & (length < fan.range_mm)
    return np.where(is_met, length, fan.range_mm), np.where(is_met, cosine, 0.0)


def nearnesses(samples: Samples, fan: Fan) -> Floats:
    """Return the thesis's inverted lengths as shares of the range: 1 at the sensor, 0 for nothing in range.

    Returns:
        Shape [gaps, angles, 8, rays].
    """
    return 1.0 - meet(samples, fan)[0] / fan.range_mm


def active_counts(maximum_counts: int) -> tuple[float, float]:
    """Return the least and the largest reading of a converter that tells something."""
    least, most = (bound * maximum_counts / MAXIMUM_COUNTS for bound in ACTIVE_COUNTS)
    return least, most


def is_active(counts: NDArray[Any], maximum_counts: int = MAXIMUM_COUNTS) -> NDArray[np.bool_]:
    """Say which readings of a converter tell something: those between noise and saturation."""
    least, most = active_counts(maximum_counts)
    return (counts >= least) & (counts <= most)


# ---- files ----


def load_samples(file: str | Path, *, radius_mm: float = math.inf, maximum_counts: int = MAXIMUM_COUNTS) -> Samples:
    """Read samples from a table (.npz) or from the laboratory's text format (any other name).

    Args:
        file: A .npz with `values`, `gap_mm` and `object_angle_deg_cw`, or a text file.
        radius_mm: Radius of the object [mm]: infinite for a straight wall. The files do not tell.
        maximum_counts: Largest reading of the robot.
    """
    path = path_of(file, "file")
    if radius_mm != math.inf:
        check_number("radius_mm", radius_mm, 1e-3, COORDINATE_MAX, "Leave it out for a straight wall.")
    read = _read_table if path.suffix == ".npz" else _read_text
    gap_mm, angle_deg, counts = read(path, f"Samples {str(path)!r}", maximum_counts)
    angle_deg = np.broadcast_to(angle_deg - RIG_OFFSET_DEG, counts.shape[:2])
    return Samples(path.stem, radius_mm, gap_mm, angle_deg, counts)


def _read_table(path: Path, what: str, most: int) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Return gaps, angles and readings of a .npz."""
    table = _TABLE | {"values": replace(_TABLE["values"], high=most)}
    arrays = read_arrays(path, table, what, numbers_max=SAMPLES_FILE_NUMBERS_MAX)
    return arrays["gap_mm"], arrays["object_angle_deg_cw"], arrays["values"]


def _read_text(path: Path, what: str, most: int) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Return gaps, angles and readings of a text file."""
    lines = _TextReader(read_file(path, what), what)
    sensors, angles, distances, first_mm, step_mm = lines.numbers(_HEADER, 5)
    if sensors != SENSOR_COUNT:
        raise lines.wrong(f"The first number must be {SENSOR_COUNT}, the sensors of a Khepera", str(sensors))
    if not (1 <= angles <= 3600 and 1 <= distances <= 1000 and first_mm >= 0 and step_mm >= 1):
        raise lines.wrong(
            f"The first line must hold {_HEADER}, with 1 to 3600 angles and 1 to 1000 distances", shown(lines.text)
        )
    rows: list[list[int]] = []
    for distance in range(distances):
        lines.marker(distance)
        for angle in range(angles):
            row = lines.numbers(f"{sensors} readings (row {angle + 1} of {angles} of TURN {distance})", sensors)
            for count in row:
                if not 0 <= count <= most:
                    raise lines.wrong(f"A reading must be from 0 to {most}", str(count))
            rows.append(row)
    lines.finish(distances)
    gap_mm = first_mm + step_mm * np.arange(distances, dtype=np.float64)
    counts = np.array(rows, np.int64).reshape(distances, angles, sensors)
    return gap_mm, np.arange(angles, dtype=np.float64) * (360.0 / angles), counts


def _quoted(text: str) -> str:
    """Return how a message shows a line or a word: whatever file was named by mistake, its content stays there."""
    return shown(text) if re.fullmatch(r"(TURN )?[-+.,\d ]*|END", text) else "something else"


class _TextReader:
    """The lines of a text file one after the other, and whose number an error names."""

    def __init__(self, data: bytes, what: str) -> None:
        self.what, self.number, self.text = what, 1, ""
        if not data.strip():
            raise self.wrong(f"A file of samples must begin with {_HEADER}", "an empty file", "Was it copied whole?")
        if (odd := re.search(rb"[^\t\n\r -\x7f]", data)) is not None:
            self.number = data.count(b"\n", 0, odd.start()) + 1
            raise self.wrong(
                "A file of samples must be plain text", f"binary (byte 0x{odd[0][0]:02x})", "Name a table of *.npz."
            )
        lines = enumerate(data.decode("ascii").split("\n"), start=1)
        self._rest = ((number, line.strip()) for number, line in lines if line.strip())

    def wrong(self, rule: str, given: str, advice: str = "Correct that line, or leave the file out.") -> ParameterError:
        """Return the error that something in the present line breaks a rule."""
        return ParameterError(f"{self.what}, line {self.number}: {rule}, but it was {given}. {advice}")

    def next(self, expected: str) -> str:
        """Return the next line that is not empty."""
        try:
            self.number, self.text = next(self._rest)
        except StopIteration:
            raise self.wrong(f"After this line must come {expected}", "the end of the file", "It is cut off.") from None
        return self.text

    def numbers(self, expected: str, count: int) -> list[int]:
        """Return the next line's whole numbers."""
        words = self.next(expected).split()
        for word in words:
            if not word.removeprefix("-").isdigit() or len(word) > 9:
                raise self.wrong(f"A line here must hold {expected}, whole numbers", _quoted(word))
        if len(words) != count:
            raise self.wrong(f"A line here must hold {expected}", f"{len(words)} numbers")
        return [int(word) for word in words]

    def marker(self, number: int) -> None:
        """Go past the line that opens a block."""
        expected = f"'TURN {number}'"
        if self.next(expected).split() != ["TURN", str(number)]:
            raise self.wrong(f"A line here must be {expected}", _quoted(self.text))

    def finish(self, blocks: int) -> None:
        """Make sure that nothing but 'END' is left."""
        for number, text in self._rest:
            self.number, self.text = number, text
            if text != "END":
                raise self.wrong(
                    f"Nothing may follow the {blocks} blocks that the first line announces", _quoted(self.text)
                )

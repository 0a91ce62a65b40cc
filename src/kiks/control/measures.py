"""The measures that come with KiKS: distances, performance and places of a robot.

Speeds are those that were sent, in pulses/10 ms; 1 pulse/10 ms is 8 mm/s. A mean is one over control steps. A measure
with arguments is a function that returns it, the same one for the same arguments.

Example:
    >>> import kiks
    >>> batch = kiks.Batch(kiks.Arena.box(500, 500), 1, seed=1)
    >>> arc, watched = [0.5, 0.4] + [0.0] * 16, [kiks.measures.path_mm, kiks.measures.goal_mm(250, 300)]
    >>> print(batch.run(kiks.controllers.linear(), arc, seconds=2, measures=watched).values.round(2))
    [[[67.03 18.06]]]
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field

from kiks.control.arguments import made_once
from kiks.control.measure import BODY, LAMP, NEIGHBOUR, Measure, measure
from kiks.engine.compiling import kernel
from kiks.errors import ParameterError
from kiks.model.arena import Arena
from kiks.model.checks import check_kind, check_number
from kiks.model.data_file import Number, OneOf, Text, Whole, as_list
from kiks.model.robot import SENSOR_COUNT
from kiks.unknown_names import hinting

__all__ = [
    "avoidance",
    "beside_wall_share",
    "closeness",
    "closest_mm",
    "contacts",
    "coverage",
    "escaped_share",
    "final_x_mm",
    "final_y_mm",
    "gathered",
    "goal_mm",
    "largest_group",
    "light_approach",
    "light_mm",
    "light_stay_s",
    "near_light_share",
    "neighbour_mm",
    "net_mm",
    "path_mm",
    "reached_s",
    "roaming",
    "speed_pulses",
    "spread_mm",
    "straightness",
    "taken_out",
    "touching_share",
    "trajectory",
    "turned_pulses",
    "wall_following",
]


__getattr__, __dir__ = hinting(__name__, __all__)

Positive = Annotated[Number, Field(gt=0, le=1e6)]
Points = Annotated[Whole, Field(ge=1, le=10_000)]
Description = Callable[[NDArray[np.float64]], NDArray[np.float64]]
Names = Annotated[tuple[Text, ...], BeforeValidator(as_list), Field(max_length=10_000)]

FULL_SPEED = 10.0
"""Speed that counts as 1 [pulses/10 ms]: 80 mm/s, at which Floreano and Mondada's robot drove at most."""

FULL_SPEED_MM_S = 8.0 * FULL_SPEED
"""The same speed as seen from outside [mm/s]."""

ROAMING_S = 2.0
"""Time within which a robot must have been elsewhere to count as moving [s]."""

FOLLOWING_MM_S = 30.0
"""Speed at which a robot gets along a wall well enough [mm/s]: beyond it, keeping the wall counts, and not haste."""

WALL_LOST_S = 2.0
"""Longest time without a wall in which a robot still follows the same one [s]: at 64 mm/s, half a circle at an end."""

KEPT_S = 10.0
"""Time for which a robot must have followed a wall to score in full [s]."""

CLOSE_MM = 100.0
"""Distance of two things at which they are half close [mm]."""

FULL_COUNT = 1023.0
"""Proximity that counts as 1 (khepera-protocol.md 8.4)."""

PLACE_LIMIT_MM, SQUARE_LIMIT = 1e6, 1_000_000

SIDE_SENSORS = {"left": 0, "right": 5}
"""The sensor on each side, counted clockwise from the left (khepera-protocol.md 8.4)."""

Side = Annotated[str, OneOf(tuple(SIDE_SENSORS))]
Counts = Annotated[Number, Field(ge=1, le=FULL_COUNT)]
Place = Annotated[Number, Field(ge=-PLACE_LIMIT_MM, le=PLACE_LIMIT_MM)]
Radius = Annotated[Number, Field(ge=0, le=PLACE_LIMIT_MM)]

_BITS = 52
"""Yes-or-no answers in a note, which holds whole numbers up to 2^53."""


def mean(notes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the first note's share of the second, a count or a time; 0 of none."""
    shares: NDArray[np.float64] = np.zeros(notes.shape[:-1])
    np.divide(notes[..., 0], notes[..., 1], out=shares, where=notes[..., 1] > 0)
    return shares


# ---- how far ----


@measure
def path_mm(moment: Any, notes: Any) -> None:
    """How far it has driven, ahead and back together [mm]."""
    notes[0] = moment.path_mm


@measure
def net_mm(moment: Any, notes: Any) -> None:
    """How far it is from its start, straight [mm]."""
    notes[0] = distance_mm(moment, moment.start_x_mm, moment.start_y_mm)


@measure(notes=2, result=mean)
def straightness(moment: Any, notes: Any) -> None:
    """`net_mm` as a share of `path_mm`: 1 for a straight line, 0 for a circle."""
    notes[0], notes[1] = distance_mm(moment, moment.start_x_mm, moment.start_y_mm), moment.path_mm


@measure(notes=2, result=mean)
def speed_pulses(moment: Any, notes: Any) -> None:
    """Mean of the wheels' speeds, ahead positive [pulses/10 ms]."""
    notes[0] += 0.5 * (moment.wheels[0] + moment.wheels[1])
    notes[1] += 1.0


@measure
def turned_pulses(moment: Any, notes: Any) -> None:
    """Commanded path of both wheels, forwards or backwards [pulses]: an approximation of the energy used."""
    notes[0] += 100.0 * moment.period_s * (abs(moment.wheels[0]) + abs(moment.wheels[1]))


@measure(notes=4, result=mean)
def roaming(moment: Any, notes: Any) -> None:
    """Mean speed at which it gets away from where it was in the last two seconds: 1 for 80 mm/s, 0 on the spot.

    A robot that shuttles or spins drives fast and gets nowhere: there `path_mm` grows, and this does not.
    """
    notes[0] += roaming_share(moment, notes)
    notes[1] += 1.0


# ---- how well ----


@measure
def contacts(moment: Any, notes: Any) -> None:
    """How often it has met something."""
    notes[0] = moment.contact_count


@measure(notes=2, result=mean)
def touching_share(moment: Any, notes: Any) -> None:
    """Share of control steps in which it touched something, or had within 0.2 s."""
    notes[0] += 1.0 if moment.is_touching else 0.0
    notes[1] += 1.0


@measure(notes=2, result=mean, senses=("proximity",))
def avoidance(moment: Any, notes: Any) -> None:
    """Mean of V (1 - sqrt(D)) (1 - i): fast, straight, and far from everything.

    V is the mean of the wheels' speeds, 0 if the robot drives back, D half of how much they differ with their signs, i
    the highest proximity count; each from 0 to 1, a speed of 80 mm/s and 1023 counts being 1 (Floreano and Mondada,
    Automatic creation of an autonomous agent, From Animals to Animats 3, 1994, equation 1). That only driving ahead
    counts is our reading of it: of absolute speeds, shuttling on the spot would be best.
    """
    notes[0] += freely_ahead(moment)
    notes[1] += 1.0


@made_once
def wall_following(side: Side = "left", *, counts: Counts = 50.0) -> Measure:
    """Mean of m k w: it gets along a wall on that side, and keeps it.

    m is how far it is from where it was in the last two seconds, as in `roaming`, and 1 from 30 mm/s on. k grows from
    0 to 1 within ten seconds of following, and begins again when the robot was without a wall for more than two
    seconds. w is 1 while a wall is at its side, else 0. So a robot that stays in a corner or shuttles scores next to
    nothing, and one that crosses the room from wall to wall scores little. A measure of our own.

    Args:
        side: 'left' or 'right'.
        counts: Proximity of the sensor on that side from which on a wall is at its side.
    """
    sensor = SIDE_SENSORS[side]

    @measure(notes=6, result=mean, senses=("proximity",))
    def wall_following(moment: Any, notes: Any) -> None:
        away_mm = moved_lately_mm(moment, notes)
        # Notes 4 and 5: the time since it began to follow, and since a wall was at its side.
        notes[4] += moment.period_s
        notes[5] += moment.period_s
        if moment.sensors[sensor] >= counts:
            if notes[5] > WALL_LOST_S:
                notes[4] = 0.0
            notes[5] = 0.0
            notes[0] += min(away_mm / (ROAMING_S * FOLLOWING_MM_S), 1.0) * min(notes[4] / KEPT_S, 1.0)
        notes[1] += 1.0

    return wall_following


@made_once
def beside_wall_share(side: Side = "left", *, counts: Counts = 50.0) -> Measure:
    """Share of control steps in which a wall was at its side.

    Args:
        side: 'left' or 'right'.
        counts: Proximity of the sensor on that side from which on a wall is at its side.
    """
    sensor = SIDE_SENSORS[side]

    @measure(notes=2, result=mean, senses=("proximity",))
    def beside_wall_share(moment: Any, notes: Any) -> None:
        notes[0] += 1.0 if moment.sensors[sensor] >= counts else 0.0
        notes[1] += 1.0

    return beside_wall_share


# ---- where ----


@made_once
def trajectory(
    *, seconds: Positive, points: Points = 10, describe: Description | None = None, names: Names = ()
) -> Measure:
    """The way of a robot: its pose at the last control step of each of equal intervals. It has several values.

    Without `describe`, they are x_mm_1, y_mm_1, heading_rad_1, x_mm_2 and so on. A trial that has ended earlier stays
    where it ended. A task takes means of them over its worlds, so that a way needs worlds that are alike.

    Args:
        seconds: Time of a trial [s].
        points: Number of poses.
        describe: From ways, float64 [..., point, 3], to several numbers about each, float64 [..., number].
        names: Names of these numbers.

    Example:
        >>> import kiks
        >>> batch = kiks.Batch(kiks.Arena.box(500, 500), 1, seed=1)
        >>> arc = [0.5, 0.4] + [0.0] * 16
        >>> way = kiks.measures.trajectory(seconds=2, points=4)
        >>> rollouts = batch.run(kiks.controllers.linear(), arc, seconds=2, measures=[way])
        >>> rollouts.values.reshape(4, 3)[:, :2].round()
        array([[250., 263.],
               [252., 280.],
               [255., 298.],
               [259., 316.]])
        >>> middle = kiks.measures.trajectory(
        ...     seconds=2, describe=lambda ways: ways[..., :2].mean(axis=-2), names=["middle_x_mm", "middle_y_mm"]
        ... )
        >>> middle.value_names
        ('middle_x_mm', 'middle_y_mm')
    """
    if (describe is None) != (not names):
        raise ParameterError("names must be given with describe, and not without it. Give one for each number.")
    if not names:
        names = tuple(f"{name}_{k}" for k in range(1, points + 1) for name in ("x_mm", "y_mm", "heading_rad"))
    per_second, last = points / seconds, points - 1

    def result(notes: NDArray[np.float64]) -> NDArray[np.float64]:
        ways = notes[..., 1:].reshape(*notes.shape[:-1], points, 3)
        latest = np.minimum(np.arange(points), np.maximum(notes[..., :1].astype(np.int64) - 1, 0))
        ways = np.take_along_axis(ways, latest[..., None], axis=-2)
        return ways.reshape(*notes.shape[:-1], -1) if describe is None else describe(ways)

    @measure(notes=1 + 3 * points, result=result, names=names)
    def trajectory(moment: Any, notes: Any) -> None:
        latest = min(int(moment.time_s * per_second), last)
        for k in range(min(int(notes[0]), latest), latest + 1):
            notes[1 + 3 * k], notes[2 + 3 * k], notes[3 + 3 * k] = moment.x_mm, moment.y_mm, moment.heading_rad
        notes[0] = latest + 1.0

    return trajectory


@measure
def final_x_mm(moment: Any, notes: Any) -> None:
    """Where it is [mm]; with `final_y_mm` a description of what it did, for novelty and quality-diversity search."""
    notes[0] = moment.x_mm


@measure
def final_y_mm(moment: Any, notes: Any) -> None:
    """Where it is [mm]."""
    notes[0] = moment.y_mm


def coverage(arena: Arena, *, square_mm: float = 100.0) -> Measure:
    """Share of an arena's squares in which the robot's middle was seen, once a control step.

    Args:
        arena: The arena; squares that are all wall count, too.
        square_mm: Edge of a square [mm].

    Example:
        >>> import kiks
        >>> arena = kiks.Arena.box(500, 500)
        >>> batch = kiks.Batch(arena, 1, seed=1)
        >>> ahead = [0.5, 0.5] + [0.0] * 16
        >>> rollouts = batch.run(kiks.controllers.linear(), ahead, seconds=2, measures=[kiks.measures.coverage(arena)])
        >>> round(rollouts.values.item(), 2)
        0.08
    """
    check_kind("arena", arena, Arena)
    edge_mm = check_number("square_mm", square_mm, 1, PLACE_LIMIT_MM)
    columns, rows = int(np.ceil(arena.width_mm / edge_mm)), int(np.ceil(arena.height_mm / edge_mm))
    if columns * rows > SQUARE_LIMIT:
        raise ParameterError(
            f"coverage must have at most {SQUARE_LIMIT} squares, but {edge_mm:g} mm makes {columns} x {rows}. "
            "Give larger squares."
        )
    return _coverage(columns, rows, edge_mm)


@functools.lru_cache(maxsize=256)
def _coverage(columns: int, rows: int, edge_mm: float) -> Measure:
    def share(notes: NDArray[np.float64]) -> NDArray[np.float64]:
        shares: NDArray[np.float64] = np.bitwise_count(notes.astype(np.int64)).sum(axis=-1) / (columns * rows)
        return shares

    @measure(notes=-(-columns * rows // _BITS), result=share)
    def coverage(moment: Any, notes: Any) -> None:
        column = min(max(int(moment.x_mm / edge_mm), 0), columns - 1)
        square = min(max(int(moment.y_mm / edge_mm), 0), rows - 1) * columns + column
        bit = np.int64(1) << np.int64(square % _BITS)
        notes[square // _BITS] = float(np.int64(notes[square // _BITS]) | bit)

    return coverage


@made_once
def goal_mm(x_mm: Place, y_mm: Place) -> Measure:
    """How far it is from a place [mm]."""

    @measure
    def goal_mm(moment: Any, notes: Any) -> None:
        notes[0] = distance_mm(moment, x_mm, y_mm)

    return goal_mm


@made_once
def closest_mm(x_mm: Place, y_mm: Place) -> Measure:
    """How near it has come to a place, at best [mm]."""

    @measure(notes=2)
    def closest_mm(moment: Any, notes: Any) -> None:
        away_mm = distance_mm(moment, x_mm, y_mm)
        notes[0] = away_mm if notes[1] == 0.0 else min(notes[0], away_mm)
        notes[1] = 1.0

    return closest_mm


@made_once
def reached_s(x_mm: Place, y_mm: Place, *, radius_mm: Radius = 50.0, missed_s: Positive | None = None) -> Measure:
    """When it first came within a radius of a place [s].

    Args:
        x_mm: Where the place is [mm].
        y_mm: Where it is [mm].
        radius_mm: The radius [mm].
        missed_s: What counts for a robot that never did [s]; infinite if left out, which a task refuses.
    """
    missing_s = np.inf if missed_s is None else missed_s

    def arrival_s(notes: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where(notes[..., 1] > 0, notes[..., 0], missing_s)

    @measure(notes=2, result=arrival_s, advice="It never got there: give missed_s, such as the time of a trial.")
    def reached_s(moment: Any, notes: Any) -> None:
        if notes[1] == 0.0 and distance_mm(moment, x_mm, y_mm) <= radius_mm:
            notes[0], notes[1] = moment.time_s, 1.0

    return reached_s


@made_once
def escaped_share(*, radius_mm: Radius = 57.0) -> Measure:
    """Share of control steps before another robot's middle first came within a radius of its own; 1 if none did.

    The middles of two Kheperas that touch are 55 mm apart. Control steps see where robots are: Kheperas that pass each
    other at 240 mm/s may touch between two steps, and be 56.3 mm apart at both.

    Args:
        radius_mm: The radius [mm].
    """

    @measure(notes=3, result=mean, needs=NEIGHBOUR)
    def escaped_share(moment: Any, notes: Any) -> None:
        for other in range(moment.poses.shape[0]):
            is_near = distance_mm(moment, moment.poses[other, 0], moment.poses[other, 1]) <= radius_mm
            if other != moment.robot and is_near:
                notes[2] = 1.0
        notes[0] += 1.0 - notes[2]
        notes[1] += 1.0

    return escaped_share


# ---- what is about ----


@measure(
    needs=LAMP,
    advice="No lamp burned at the end of a trial: take goal_mm(x_mm, y_mm) of its place, light_approach or "
    "near_light_share.",
)
def light_mm(moment: Any, notes: Any) -> None:
    """How far the nearest lamp that burns is [mm]; infinite if there is none, which a task refuses."""
    notes[0] = nearest_lamp_mm(moment)


@measure(notes=2, result=mean, needs=LAMP)
def light_approach(moment: Any, notes: Any) -> None:
    """Mean share of the way to the nearest lamp that it has made: 0 if it stands still, near 1 if it soon stays there.

    The way is the straight one from its start. A robot that is farther away than its start has made 0.
    """
    start_mm = from_lamp_mm(moment, moment.start_x_mm, moment.start_y_mm)
    if 0.0 < start_mm < np.inf:
        notes[0] += max(1.0 - nearest_lamp_mm(moment) / start_mm, 0.0)
    notes[1] += 1.0


@made_once
def light_stay_s(radius_mm: Radius = 100.0) -> Measure:
    """How long it has been within a radius of a lamp that burns, without a break until the end [s]; 0 if it is not."""

    @measure(needs=LAMP)
    def light_stay_s(moment: Any, notes: Any) -> None:
        notes[0] = notes[0] + moment.period_s if nearest_lamp_mm(moment) <= radius_mm else 0.0

    return light_stay_s


@made_once
def near_light_share(radius_mm: Radius = 100.0) -> Measure:
    """Share of control steps in which it was within a radius of a lamp that burns."""

    @measure(notes=2, result=mean, needs=LAMP)
    def near_light_share(moment: Any, notes: Any) -> None:
        notes[0] += 1.0 if nearest_lamp_mm(moment) <= radius_mm else 0.0
        notes[1] += 1.0

    return near_light_share


@made_once
def gathered(x_mm: Place, y_mm: Place, *, radius_mm: Radius = 150.0) -> Measure:
    """How many balls and cylinders have their middle within a radius of a place."""

    @measure(needs=BODY)
    def gathered(moment: Any, notes: Any) -> None:
        notes[0] = 0.0
        for body in moment.bodies:
            across, up = body.x_mm - x_mm, body.y_mm - y_mm
            notes[0] += 1.0 if across * across + up * up <= radius_mm * radius_mm else 0.0

    return gathered


@made_once
def largest_group(radius_mm: Radius = 100.0) -> Measure:
    """Largest number of balls and cylinders that have their middles within a radius of one of them, itself included."""

    @measure(needs=BODY)
    def largest_group(moment: Any, notes: Any) -> None:
        notes[0] = 0.0
        for body in moment.bodies:
            near = 0.0
            for other in moment.bodies:
                across, up = other.x_mm - body.x_mm, other.y_mm - body.y_mm
                near += 1.0 if across * across + up * up <= radius_mm * radius_mm else 0.0
            notes[0] = max(notes[0], near)

    return largest_group


@measure(needs=BODY)
def closeness(moment: Any, notes: Any) -> None:
    """How close balls and cylinders are, the mean of 1 / (1 + (d / 100 mm)^2) over pairs at a distance d; 0 of none.

    It grows most when things that are near each other come nearer, so it pays for each step towards a group.
    """
    count = moment.bodies.shape[0]
    total = 0.0
    for k in range(count):
        for other in range(k):
            across = moment.bodies[k].x_mm - moment.bodies[other].x_mm
            up = moment.bodies[k].y_mm - moment.bodies[other].y_mm
            total += 1.0 / (1.0 + (across * across + up * up) / (CLOSE_MM * CLOSE_MM))
    notes[0] = total / max(0.5 * count * (count - 1), 1.0)


@measure(needs=NEIGHBOUR)
def neighbour_mm(moment: Any, notes: Any) -> None:
    """How far the nearest other robot is, from middle to middle [mm]; 0 of a lone robot, of which no goal may ask."""
    nearest = np.inf
    for other in range(moment.poses.shape[0]):
        if other != moment.robot:
            across, up = moment.poses[other, 0] - moment.x_mm, moment.poses[other, 1] - moment.y_mm
            nearest = min(nearest, np.sqrt(across * across + up * up))
    notes[0] = nearest if nearest < np.inf else 0.0


@measure(needs=BODY)
def spread_mm(moment: Any, notes: Any) -> None:
    """How far balls and cylinders are from the middle of them all [mm], root mean square; 0 of none."""
    count = moment.bodies.shape[0]
    x_mm, y_mm, squares = 0.0, 0.0, 0.0
    for body in moment.bodies:
        x_mm += body.x_mm / count
        y_mm += body.y_mm / count
    for body in moment.bodies:
        squares += ((body.x_mm - x_mm) * (body.x_mm - x_mm) + (body.y_mm - y_mm) * (body.y_mm - y_mm)) / count
    notes[0] = np.sqrt(squares)


@measure(needs=BODY)
def taken_out(moment: Any, notes: Any) -> None:
    """Number of balls and cylinders that grippers have dropped beyond the edge of the arena."""
    notes[0] = count_out(moment.bodies)


# ---- what they are made of ----


@kernel
def count_out(bodies: Any) -> Any:
    """Return how many bodies have left the arena."""
    count = 0.0
    for row in range(bodies.shape[0]):
        count += bodies[row].is_lifted != 0 and bodies[row].holder == 0
    return count


@kernel
def distance_mm(moment: Any, x_mm: Any, y_mm: Any) -> Any:
    """Return how far the robot is from a place."""
    across, up = moment.x_mm - x_mm, moment.y_mm - y_mm
    return np.sqrt(across * across + up * up)


@kernel
def moved_lately_mm(moment: Any, notes: Any) -> Any:
    """Return how far the robot is from where it was in the last two seconds; notes 2 and 3 remember that place.

    Note 1 counts the steps before this one.
    """
    if notes[1] == 0.0:
        notes[2], notes[3] = moment.start_x_mm, moment.start_y_mm
    # An exponential moving average of the position. On a straight way it lags by what the robot drives in `ROAMING_S`.
    share = min(moment.period_s / ROAMING_S, 1.0)
    notes[2] += share * (moment.x_mm - notes[2])
    notes[3] += share * (moment.y_mm - notes[3])
    return distance_mm(moment, notes[2], notes[3])


@kernel
def roaming_share(moment: Any, notes: Any) -> Any:
    """Return how fast the robot gets away from where it was, 1 for 80 mm/s, as in `roaming`; notes 2 and 3 as there."""
    return min(moved_lately_mm(moment, notes) / (ROAMING_S * FULL_SPEED_MM_S), 1.0)


@kernel
def freely_ahead(moment: Any) -> Any:
    """Return how fast, how straight and how far from everything the robot drives, from 0 to 1, as in `avoidance`."""
    ahead = 0.5 * (share_of_full(moment.wheels[0]) + share_of_full(moment.wheels[1]))
    return max(ahead, 0.0) * straight_share(moment) * clear_share(moment)


@kernel
def straight_share(moment: Any) -> Any:
    """Return 1 less the root of half of how much the speeds of the wheels differ, with their signs, as shares."""
    return 1.0 - np.sqrt(0.5 * abs(share_of_full(moment.wheels[0]) - share_of_full(moment.wheels[1])))


@kernel
def clear_share(moment: Any) -> Any:
    """Return 1 less the highest proximity, as a share; proximity is the first sense of the controller."""
    highest = 0.0
    for k in range(min(SENSOR_COUNT, moment.sensors.shape[0])):
        highest = max(highest, moment.sensors[k])
    return 1.0 - min(highest / FULL_COUNT, 1.0)


@kernel
def wheels_share(moment: Any) -> Any:
    """Return the mean speed of both wheels without their signs, as a share of `FULL_SPEED`."""
    return 0.5 * (abs(share_of_full(moment.wheels[0])) + abs(share_of_full(moment.wheels[1])))


@kernel
def share_of_full(speed: Any) -> Any:
    """Return a speed as a share of `FULL_SPEED`, cut to +-1."""
    return min(max(speed / FULL_SPEED, -1.0), 1.0)


@kernel
def nearest_lamp_mm(moment: Any) -> Any:
    """Return how far the nearest lamp that burns is; infinite if there is none."""
    return from_lamp_mm(moment, moment.x_mm, moment.y_mm)


@kernel
def from_lamp_mm(moment: Any, x_mm: Any, y_mm: Any) -> Any:
    """Return how far a place is from the nearest lamp that burns; infinite if there is none."""
    nearest = np.inf
    for lamp in range(moment.lamps.shape[0]):
        if moment.lamps[lamp, 3] != 0.0 and moment.lamps[lamp, 2] > 0.0:
            across, up = x_mm - moment.lamps[lamp, 0], y_mm - moment.lamps[lamp, 1]
            nearest = min(nearest, np.sqrt(across * across + up * up))
    return nearest

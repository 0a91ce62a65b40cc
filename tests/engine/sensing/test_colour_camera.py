"""The colour camera: an oracle in space, laws of pictures, and what people expect to see."""

import hashlib
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import kiks
from kiks.engine.sensing import colour_camera as eye
from kiks.model.arena import Arena, Ball, Cylinder, Lamp, Pose, Zone
from kiks.model.robot import ColourCamera, RobotSpec
from kiks.model.window import SENSOR_HEIGHT, SENSOR_WIDTH, Window
from kiks.sim.colours import LAMPLIGHT, body_colour, robot_colour
from kiks.sim.pictures import picture

QUIET = RobotSpec.load("khepera").without_noise().with_changes(body__diameter_mm=70.0)
QUIET = RobotSpec(**(vars(QUIET) | {"colour_camera": ColourCamera(noise_share=0.0)}))
NOISY = RobotSpec(**(vars(RobotSpec.load("khepera")) | {"colour_camera": ColourCamera()}))
FOCAL = SENSOR_WIDTH / 2 / math.tan(math.radians(48.13 / 2))
ORANGE = np.array((245, 130, 40))
COARSE = Window(3, 5, 80, 60, 8)


def world(starts: tuple[tuple[float, float, float], ...], robot: Any = QUIET, **things: Any) -> kiks.Simulation:
    arena = replace(things.pop("arena", Arena.box(700, 500)), starts=tuple(Pose(*each) for each in starts), **things)
    return kiks.Simulation(arena, seed=4, robot=robot, robots=len(starts))


def seen(sim: kiks.Simulation, window: Window = COARSE) -> NDArray[np.int64]:
    return picture(sim.world, 0, window).astype(int)


def is_like(pixels: NDArray[np.int64], colour: Any) -> NDArray[np.bool_]:
    """Return which pixels have the hue of a colour, however dark they are."""
    shares = pixels / np.maximum(pixels.max(axis=-1, keepdims=True), 1)
    found: NDArray[np.bool_] = np.abs(shares - np.array(colour) / max(colour)).max(axis=-1) < 0.03
    return found


# ---- the oracle: each ray in space, by formulas of the textbook ----


def met_by(sim: kiks.Simulation, start: NDArray[Any], ray: NDArray[Any]) -> tuple[float, float, float]:
    """Return the colour of what a ray in space meets first, in a box with upright things, balls and lamps."""
    width, height = sim.arena.width_mm, sim.arena.height_mm
    best, colour = math.inf, eye.ROOM

    def meets(way: float, found: Any, cosine: float | None = None) -> None:
        nonlocal best, colour
        if 0.0 < way < best:
            share = 1.0 if cosine is None else 1.0 - eye.SIDE_SHARE * (1.0 - cosine)
            best, colour = way, tuple(share * part for part in found)

    for axis, planes in ((0, (10.0, width - 10.0)), (1, (10.0, height - 10.0))):
        for plane in planes:
            way = (plane - start[axis]) / ray[axis] if ray[axis] else -1.0
            if way > 0.0 and 0.0 <= start[2] + way * ray[2] <= eye.WALL_MM:
                meets(way, (eye.WALL_SHARE * 255,) * 3)
    if ray[2] < 0.0:
        way = -start[2] / ray[2]
        x, y = (start + way * ray)[:2]
        if 0 <= x < width and 0 <= y < height:
            meets(
                way,
                (
                    eye.FLOOR_SHARE
                    * int(sim.arena.shades[int(y / sim.arena.mm_per_cell), int(x / sim.arena.mm_per_cell)]),
                )
                * 3,
            )
    for index in range(1, len(sim.world.specs)):
        x, y, _ = sim.world.pose(index)
        upright(meets, start, ray, (x, y), sim.world.specs[index].body.radius_mm, robot_colour(index))
    for body in sim.world.bodies():
        place = float(body["x_mm"]), float(body["y_mm"])
        if body["what"] == 3:
            sphere(meets, start, ray, (*place, float(body["radius_mm"])), float(body["radius_mm"]), body_colour(body))
        else:
            upright(meets, start, ray, place, float(body["radius_mm"]), body_colour(body))
    for x, y, _, is_on in sim.lamps.tolist():
        if is_on:
            sphere(meets, start, ray, (x, y, eye.LAMP_MM), eye.LAMP_RADIUS_MM, LAMPLIGHT, glows=True)
    return colour


def sphere(meets: Any, start: Any, ray: Any, middle: Any, radius: float, colour: Any, *, glows: bool = False) -> None:
    off = start - np.array(middle)
    b, c = float(off @ ray), float(off @ off) - radius**2
    if b * b > c:
        way = -b - math.sqrt(b * b - c)
        meets(way, colour, None if glows else float(-(off + way * ray) @ ray) / radius)


def upright(meets: Any, start: Any, ray: Any, place: Any, radius: float, colour: Any) -> None:
    off, flat = start[:2] - np.array(place), ray[:2] / math.hypot(*ray[:2])
    b, c = float(off @ flat), float(off @ off) - radius**2
    if b * b > c:
        way = (-b - math.sqrt(b * b - c)) / math.hypot(*ray[:2])
        if start[2] + way * ray[2] <= eye.UPRIGHT_MM:
            meets(way, colour, float(-(off + way * ray[:2]) @ flat) / radius)


@pytest.mark.parametrize("case", range(4))
def test_it_is_the_picture_of_rays_in_space(case: int) -> None:
    rng = np.random.default_rng(case)
    starts = ((150.0, 250.0, 0.35 * (case - 1.5)), (430.0, 260.0, 1.0), (520.0, 120.0, 2.0))
    things: dict[str, Any] = {
        "balls": (Ball(300.0 + 10 * case, 200.0), Ball(600.0, 350.0, 20.0)),
        "cylinders": (Cylinder(300.0, 330.0), Cylinder(560.0, 400.0, 30.0)),
        "lamps": (Lamp(500.0, 330.0), Lamp(400.0, 150.0, is_on=bool(case % 2)), Lamp(650.0, 200.0)),
        "zones": tuple(
            Zone(disc_mm=tuple(rng.uniform(50, 450, 2).tolist()), radius_mm=40, brightness=50 * k) for k in range(5)
        ),
    }
    sim = world(starts, **things)
    x, y, heading = starts[0]
    ahead, right = (
        np.array((math.cos(heading), math.sin(heading), 0.0)),
        np.array((math.sin(heading), -math.cos(heading), 0.0)),
    )
    start = np.array((x, y, 28.0)) + 30.0 * ahead
    expected = np.zeros((60, 80, 3))
    for row, column in np.ndindex(60, 80):
        u, v = COARSE.x + COARSE.zoom * column, COARSE.y + COARSE.zoom * row
        ray = ahead + right * ((u + 0.5 - 320) / FOCAL) - np.array((0, 0, (v + 0.5 - 240) / FOCAL))
        expected[row, column] = met_by(sim, start, ray / np.linalg.norm(ray))
    errors = np.abs(seen(sim) - expected).max(axis=-1)
    # A ray that grazes an edge may be on its other side.
    assert (errors > 1.0).mean() < 0.001
    assert len(np.unique(expected.reshape(-1, 3), axis=0)) > 100


# ---- laws ----


def test_a_mirrored_world_gives_the_mirrored_picture() -> None:
    def mirrored(places: Any) -> Any:
        return tuple(type(each)(each.x_mm, 500.0 - each.y_mm, *each[2:]) for each in places)

    things: dict[str, Any] = {
        "balls": (Ball(330.0, 180.0), Ball(600.0, 350.0, 20.0)),
        "cylinders": (Cylinder(400.0, 330.0),),
        "lamps": (Lamp(500.0, 330.0),),
    }
    sim = world(((150.0, 240.0, 0.2),), **things)
    other = world(((150.0, 260.0, -0.2),), **{name: mirrored(each) for name, each in things.items()})
    differs = (seen(sim, Window()) != seen(other, Window())[:, ::-1]).any(axis=-1)
    assert differs.mean() < 1e-4


@pytest.mark.parametrize("robot", [QUIET, NOISY])
def test_a_window_is_a_cut_of_the_whole_picture(robot: RobotSpec) -> None:
    sim = world(((150.0, 250.0, 0.0),), robot, balls=(Ball(300.0, 230.0),), lamps=(Lamp(500.0, 330.0),))
    whole = seen(sim, Window())
    for window in (
        Window.centred(40, 40, 8),
        Window.centred(52, 39, 4),
        Window(100, 200, 17, 9, 1),
        Window(0, 0, 160, 120, 4),
    ):
        cut = whole[window.y :: window.zoom, window.x :: window.zoom][: window.height, : window.width]
        np.testing.assert_array_equal(seen(sim, window), cut)


def test_the_sensor_goes_on_beyond_its_edges_as_there() -> None:
    sim = world(((150.0, 250.0, 0.0),), NOISY, balls=(Ball(300.0, 230.0),))
    whole, beyond = seen(sim, Window()), seen(sim, Window(-5, -3, SENSOR_WIDTH + 10, SENSOR_HEIGHT + 6, 1))
    np.testing.assert_array_equal(beyond, np.pad(whole, ((3, 3), (5, 5), (0, 0)), mode="edge"))
    assert seen(sim, Window(width=0, height=3)).shape == (3, 0, 3)


def test_the_same_instant_gives_the_same_bits_and_another_one_other_noise() -> None:
    sims = [world(((150.0, 250.0, 0.0),), robot) for robot in (NOISY, NOISY, NOISY.without_noise())]
    first, again, still = (seen(sim) for sim in sims)
    np.testing.assert_array_equal(first, again)
    sims[0].run(0.1)
    sims[2].run(0.1)
    assert (seen(sims[0]) != first).any(axis=-1).mean() > 0.9
    np.testing.assert_array_equal(seen(sims[2]), still)
    noise = first - still  # whose greys are rounded, too
    assert np.abs(noise).max() <= 0.015 * 255 + 1
    assert abs(noise.mean()) < 0.3


# ---- what people expect ----


def test_a_ball_ahead_is_in_the_middle_and_larger_when_it_is_nearer() -> None:
    widths = []
    for distance_mm in (100.0, 200.0, 400.0):
        sim = world(((100.0, 250.0, 0.0),), balls=(Ball(130.0 + distance_mm, 250.0),))
        found = is_like(seen(sim, Window()), ORANGE)
        columns = np.flatnonzero(found.any(axis=0))
        assert columns[0] + columns[-1] == SENSOR_WIDTH - 1
        widths.append(len(columns))
        assert widths[-1] == pytest.approx(2 * FOCAL * 32 / math.sqrt(distance_mm**2 - 32**2), abs=2)
    assert widths == sorted(widths, reverse=True)


def test_a_wall_is_seen_over_what_is_lower_and_hides_what_is_behind_it() -> None:
    barrier = np.zeros((500, 700), np.uint8)
    barrier[200:300, 400:410] = 80
    arena = Arena.from_array(barrier)
    sim = world(((100.0, 250.0, 0.0), (300.0, 250.0, 0.0), (500.0, 250.0, 0.0)), arena=arena)
    column = seen(sim, Window())[:, 320]
    assert column[20].tolist() == [round(part) for part in eye.ROOM]
    assert column[100].tolist() == [round(eye.WALL_SHARE * 80)] * 3
    assert is_like(column, robot_colour(1))[180:260].any()
    assert not is_like(seen(sim, Window()), robot_colour(2)).any()


def test_a_lamp_over_a_wall_stands_on_it_and_a_dark_one_is_not_seen() -> None:
    barrier = np.zeros((500, 700), np.uint8)
    barrier[200:300, 400:440] = 80
    arena = Arena.from_array(barrier)
    start = (100.0, 250.0, 0.0)
    lit, dark = (world((start,), arena=arena, lamps=(Lamp(420.0, 250.0, is_on=on),)) for on in (True, False))
    is_lamp = (seen(lit, Window()) == LAMPLIGHT).all(axis=-1)
    assert np.flatnonzero(is_lamp.any(axis=0)).mean() == pytest.approx(319.5)
    assert is_lamp[:, 320].any()
    row = int(np.flatnonzero(is_lamp[:, 320])[-1])  # above the edge of the wall
    assert seen(lit, Window())[row + 2, 320].tolist() in ([round(part) for part in eye.ROOM], [58] * 3)
    assert not (seen(dark, Window()) == LAMPLIGHT).all(axis=-1).any()


def test_stripes_of_a_robot_are_black_and_white() -> None:
    sim = world(((100.0, 250.0, 0.0), (250.0, 250.0, 0.5)), [QUIET, QUIET.with_changes(body__stripe_count=6)])
    row = seen(sim, Window())[240, 200:440]
    assert (row.max(axis=-1) < 2).any()
    assert (row.min(axis=-1) > 200).any()
    assert not is_like(row, robot_colour(1)).any()


def test_the_bits_of_a_picture() -> None:
    things: dict[str, Any] = {"balls": (Ball(330.0, 180.0),), "cylinders": (Cylinder(400.0, 330.0),)}
    sim = world(((150.0, 240.0, 0.2), (400.0, 240.0, 1.0)), NOISY, lamps=(Lamp(500.0, 330.0),), **things)
    assert hashlib.sha256(picture(sim.world, 0, Window()).tobytes()).hexdigest()[:16] == "760275022aa3b8fb"

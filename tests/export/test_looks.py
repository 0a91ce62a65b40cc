"""A kind of robot says how it looks: pictures, films and messages to browsers show that, and ask for no name."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageSequence

from kiks import Arena, Recording, RobotSpec, Simulation
from kiks.export.frames import describe_scene, pack_frame
from kiks.export.looks import LED_COLOURS, lit_leds, robot_looks
from kiks.export.pictures import Picture
from kiks.export.space import things
from kiks.firmware.khepera import kind
from kiks.firmware.robot_kind import RobotKind
from kiks.firmware.robot_looks import Led, RobotLooks, Slab, box, disc
from kiks.recording.moments import moments
from kiks.sim.colours import robot_colour

PLACES_MM = (22.0, 0.0), (0.0, 22.0), (-22.0, 0.0), (0.0, -22.0), (-15.0, 15.0)
LEDS = tuple(Led(name, *place, 20.0, "green") for name, place in zip("abcde", PLACES_MM, strict=True))
BLUE, VIOLET = "#1020f0", "#a010f0"


def toy_looks(_: object) -> RobotLooks:
    shapes = (box(-14.0, -14.0, 6.0, 6.0, VIOLET),)
    return RobotLooks(BLUE, shapes, (Slab(disc(25.0, BLUE), 5.0, 20.0),), LEDS, height_mm=20.0)


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> RobotKind:
    """A kind with five LEDs in place of the Khepera, and none of its shapes."""
    toy = replace(kind.KHEPERA, looks=toy_looks, lit=lambda records: records["registers"][:, :5])
    monkeypatch.setattr(kind, "KHEPERA", toy)
    return toy


@pytest.fixture
def sim(toy: RobotKind) -> Simulation:
    """Two such robots, of a size of their own: pictures keep the parts of a robot's kind."""
    spec = RobotSpec.load("khepera").with_changes(body__diameter_mm=61.0)
    sim = Simulation(Arena.box(300, 200), robot=spec, robots=2, seed=1)
    sim.place(1, 90, 100, math.pi / 2)
    sim.place(2, 210, 100, 0.0)
    light(sim, 1, (0, 3))
    return sim


def light(sim: Simulation, robot: int, leds: Sequence[int]) -> None:
    sim.world.state.robots["registers"][0, robot - 1, :5] = np.isin(np.arange(5), leds)


def rgb(colour: str) -> list[int]:
    return list(bytes.fromhex(colour[1:7]))


def lit_on(picture: np.ndarray, scale: float, x_mm: float, y_mm: float, turn_rad: float) -> list[int]:
    """Return which LEDs of a robot at a pose are lit in a picture of the arena."""
    seen = []
    for number, (ahead, left) in enumerate(PLACES_MM):
        x = x_mm + ahead * math.cos(turn_rad) - left * math.sin(turn_rad)
        y = y_mm + ahead * math.sin(turn_rad) + left * math.cos(turn_rad)
        colour = picture[len(picture) - 1 - round(y * scale), round(x * scale)]
        if np.abs(colour.astype(int) - rgb(LED_COLOURS["green"]["lit"])).max() < 12:
            seen.append(number)
    return seen


def test_a_picture_shows_a_kinds_shapes_and_the_leds_that_are_lit(sim: Simulation) -> None:
    picture = np.asarray(Picture.of_simulation(sim).image().convert("RGB"))
    assert picture.shape[:2] == (400, 600)
    assert lit_on(picture, 2.0, 90, 100, math.pi / 2) == [0, 3]
    assert lit_on(picture, 2.0, 210, 100, 0.0) == []
    assert picture[399 - 2 * 89, 2 * 199].tolist() == rgb(VIOLET)
    assert picture[399 - 2 * 116, 2 * 198].tolist() == rgb(BLUE)
    assert picture[399 - 2 * 106, 2 * 204].tolist() == list(robot_colour(1))


def test_browsers_learn_of_looks_once_and_of_leds_in_each_frame(sim: Simulation) -> None:
    scene = describe_scene(sim, 1)
    assert [robot["look"] for robot in scene["robots"]] == [0, 0]
    (look,) = scene["looks"]
    assert [led["name"] for led in look["leds"]] == list("abcde")
    assert [(led["x_mm"], led["y_mm"]) for led in look["leds"]] == list(PLACES_MM)
    assert [(slab["low_mm"], slab["high_mm"], slab["colour"]) for slab in look["slabs"]] == [(5.0, 20.0, BLUE)]
    assert VIOLET in [part["colour"] for part in look["parts"]]
    at = 32 + 4 * 7
    for robot, bits in ((0, 0b01001), (1, 0)):
        data = pack_frame(sim, scene=1)[at + 128 * robot :]
        assert int.from_bytes(data[:4], "little") >> 16 == bits


def test_robots_of_other_sizes_have_other_looks(sim: Simulation) -> None:
    mixed = Simulation(Arena.box(300, 200), robot=["khepera", "khepera_ii", "khepera"])
    scene = describe_scene(mixed, 1)
    assert [robot["look"] for robot in scene["robots"]] == [0, 1, 0]
    assert [look["radius_mm"] for look in scene["looks"]] == [27.5, 35.0]


@pytest.fixture
def recording(sim: Simulation, tmp_path: Path) -> Recording:
    """An LED of the second robot is lit after 0.4 s."""
    with sim.record(tmp_path / "run.mcap"):
        sim.run(0.4)
        light(sim, 2, (1,))
        sim.place(2, 210, 100, 0.0)
        sim.run(0.6)
    return Recording(tmp_path / "run.mcap")


def greens(picture: np.ndarray) -> int:
    return int((np.abs(picture[..., :3].astype(int) - rgb(LED_COLOURS["green"]["lit"])).max(axis=-1) < 12).sum())


def test_a_film_shows_the_leds_that_are_lit(recording: Recording, tmp_path: Path) -> None:
    recording.export(tmp_path / "film.webp", size=(600, 400), fps=5, is_plain=True)
    with Image.open(tmp_path / "film.webp") as image:
        first, *_, last = (np.asarray(each.convert("RGB")) for each in ImageSequence.Iterator(image))
    (left, right), (left_later, right_later) = (
        (greens(each[:, :300]), greens(each[:, 300:])) for each in (first, last)
    )
    assert left == left_later > 10
    assert right == 0 < right_later < left


def test_in_space_a_robot_has_its_leds_on_top_and_the_height_of_its_kind(recording: Recording) -> None:
    for moment, bits in zip(moments(recording.log, [0, 900_000_000]), ((9, 0), (9, 2)), strict=True):
        robots = list(things(moment))
        assert [thing.key for thing in robots] == [("robot", 0, bits[0]), ("robot", 1, bits[1])]
        for thing, lit in zip(robots, bits, strict=True):
            drum, *_, top = thing.solids
            assert drum.middle[2] + drum.size[2] / 2 == 20.0 == top.middle[2] - 0.5
            assert top.pixels is not None
            assert (greens(top.pixels) > 10) == (lit > 0)


def test_a_kind_without_looks_is_a_drum_without_leds() -> None:
    fields = {name: each for name, each in vars(kind.KHEPERA).items() if name not in ("looks", "lit")}
    plain, spec = RobotKind(**fields), RobotSpec.load("khepera")
    looks = plain.looks(spec.body)
    assert (looks.leds, looks.shapes, [slab.shape.radius_mm for slab in looks.slabs]) == ((), (), [27.5])
    assert plain.lit(np.zeros(3, [("led", "u1")])).shape == (3, 0)


def test_leds_belong_to_the_kind_of_each_robot(monkeypatch: pytest.MonkeyPatch, toy: RobotKind) -> None:
    monkeypatch.setattr("kiks.export.looks.robot_kind", {"khepera": toy, "other": replace(toy, lit=_all_lit)}.get)
    records = np.zeros(3, [("registers", "u1", (8,))])
    records["registers"][0, 2] = records["registers"][1, 1] = 1
    one, other = RobotSpec.load("khepera"), RobotSpec.load("khepera_ii")
    object.__setattr__(other, "kind", "other")
    assert lit_leds([one, other, one], records).tolist() == [0b100, 0b11, 0]
    assert lit_leds([one, other, one], records[:2]).tolist() == [0b100, 0b11]
    assert lit_leds([], records[:0]).tolist() == []


def _all_lit(records: np.ndarray) -> np.ndarray:
    return np.ones((len(records), 2))


def test_the_ring_of_an_epuck_goes_clockwise_from_ahead() -> None:
    """The places of epuck-protocol.md 6.3: 0 is ahead, 2 on the right, 4 behind, 6 on the left."""
    sim = Simulation(Arena.box(300, 200), robot="epuck")
    looks = robot_looks(sim.specs[0])
    places = [(led.ahead_mm, led.left_mm) for led in looks.leds[:8]]
    assert np.allclose(places[::2], [(33, 0), (0, -33), (-33, 0), (0, 33)])
    assert [math.hypot(*place) for place in places] == pytest.approx([33] * 8)
    assert [(led.name, led.colour) for led in looks.leds[7:]] == [("7", "red"), ("body", "green"), ("front", "red")]
    corners = [math.hypot(*point) + shape.radius_mm for shape in looks.shapes for point in shape.points]
    assert max(corners) < sim.specs[0].body.radius_mm
    for line, bits in ((b"L,2,1\n", 1 << 2), (b"B,1\n", 1 << 2 | 1 << 8), (b"F,1\n", 1 << 2 | 3 << 8)):
        sim.port(1).write(line)
        sim.run(0.1)
        assert lit_leds(sim.specs, sim.world.state.robots[0]).tolist() == [bits]

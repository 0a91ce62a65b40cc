"""The linear camera K213: its orders, its view, its blur, its instants, its noise."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import kiks
from kiks.firmware.k213 import K213, PERIODS_NS


def scene(
    *bars: tuple[int, int, int, int, int], wall: int = 255, size_mm: int = 600, at: float = 300.0, seed: int = 0
) -> kiks.Simulation:
    """A robot with a camera that looks up from the middle; bars are x, y, width, height [mm] and brightness."""
    ground = np.zeros((size_mm, size_mm), np.uint8)
    ground[:10], ground[-10:], ground[:, :10], ground[:, -10:] = wall, wall, wall, wall
    for x, y, width, height, brightness in bars:
        ground[size_mm - y - height : size_mm - y, x : x + width] = brightness
    sim = kiks.Simulation(kiks.Arena.from_array(ground), seed=seed)
    sim.place(1, size_mm / 2, at, math.pi / 2)
    sim.fit(1, "k213")
    return sim


SPECK = (0, 0, 1, 1, 1)
"""A dark pixel that no camera sees."""


def camera_of(sim: kiks.Simulation) -> K213:
    camera = sim.wires[0].firmware.turrets[2]
    assert isinstance(camera, K213)
    return camera


def run(sim: kiks.Simulation, seconds: float) -> None:
    """Let time pass up to this very instant."""
    sim.run(seconds)
    sim.sync()


def contrast(image: list[float]) -> float:
    """The steepest step between neighbours."""
    return float(np.abs(np.diff(image)).max())


def test_orders_give_parts_of_the_whole_image_and_others_are_a_protocol_error() -> None:
    pixels = [(37 * p + 11) % 256 for p in range(64)]
    camera = camera_of(scene())
    camera.take = lambda time_ns: (pixels, 1234)
    camera.look(0)
    for order, values, part in (
        ("N", (), pixels),
        ("S", (), pixels[::2]),
        ("T", (), pixels[::4]),
        ("Q", (3,), pixels[3:11]),
        ("R", (48,), pixels[48:]),
        ("Q", (63,), pixels[56:]),
        ("R", (2**62,), pixels[48:]),
        ("Q", (-(2**62),), pixels[:8]),
        ("L", (), (1234 // 256, 1234 % 256)),
        ("O", (), (int(np.argmax(pixels)),)),
        ("P", (), (int(np.argmin(pixels)),)),
    ):
        assert camera.order(order, values) == tuple(part)
    packed = camera.order("M", ())
    assert packed is not None
    halves = [half for byte in packed for half in (byte >> 4, byte & 15)]
    assert halves == [grey >> 4 for grey in pixels]
    robot = kiks.Khepera(scene().port(1))
    orders = "A C D Z N,1 L,0 Q R Q,1,2 U U,8 U,-1 U,1,1 U,99999999999999999999"
    assert {robot.send(f"T,2,{order}") for order in orders.split()} == {"z,Protocol error"}


def test_left_is_left_and_right_its_mirror_image() -> None:
    image = scene((200, 430, 95, 20, 1)).image(1)
    assert max(image[2:24]) < 70 < 200 < min(image[34:44])
    robot = kiks.Khepera(scene((305, 430, 95, 20, 1)).port(1))
    noisy = robot.image()
    assert np.mean(noisy[:28]) > np.mean(noisy[36:]) + 80
    assert robot.turret(2, "P")[0] > 32
    image = scene((240, 450, 30, 20, 60), (350, 480, 10, 10, 1)).image(1)
    mirrored = scene((330, 450, 30, 20, 60), (240, 480, 10, 10, 1)).image(1)
    assert image == pytest.approx(mirrored[::-1], abs=1e-6)


def test_the_view_spans_exactly_18_degrees_to_either_side_and_begins_50_mm_from_the_centre() -> None:
    """A dark bar whose edge is just inside or outside the outermost ray."""
    plain = scene(SPECK).image(1)
    for side, outermost in ((-1, 0), (1, 63)):
        for angle_deg, is_seen in ((17.6, True), (18.4, False)):
            edge = round(300 + side * 220 * math.tan(math.radians(angle_deg)))
            image = scene((edge if side > 0 else edge - 80, 520, 80, 1, 1)).image(1)
            assert (image[outermost] < plain[outermost] - 20) is is_seen
    post = (298, 335, 4, 4, 1)  # between the rim and the beginning of the view
    assert scene(post).image(1) == pytest.approx(scene(SPECK).image(1), abs=1e-6)
    assert min(scene((298, 352, 4, 4, 1)).image(1)) < 80
    # A wall nearer than that is seen all the same, with the brightness of its surface.
    nearby = scene((0, 335, 600, 5, 1), (0, 340, 600, 100, 255), (0, 100, 600, 5, 255))
    assert max(nearby.image(1)) - min(nearby.image(1)) == pytest.approx(92, abs=15)  # the fall-off alone
    high, _ = kiks.Khepera(nearby.port(1)).turret(2, "L")
    assert high >= 6  # dark


def test_the_exposure_makes_the_brightest_white_and_the_light_level_tells() -> None:
    dark, bright = scene(wall=1), scene(wall=255)
    assert dark.image(1)[32] == pytest.approx(bright.image(1)[32], abs=12)
    for sim, least, most in ((bright, 175, 330), (dark, 1500, 2000)):
        high, low = kiks.Khepera(sim.port(1)).turret(2, "L")
        assert least <= 256 * high + low <= most
    image = scene((0, 430, 600, 20, 255)).image(1)
    assert image[:32] == sorted(image[:32]), "edges are darker"
    assert (image[0], image[32]) == (pytest.approx(0.9 * 132 + 12.75, abs=3), pytest.approx(0.9 * 235 + 12.75, abs=3))


@pytest.mark.slow
def test_near_is_sharp_and_far_is_blurred() -> None:
    steps, sim = [], scene((1000, 1900, 990, 20, 1), (10, 1900, 990, 20, 255), size_mm=2000)
    for far in (100, 200, 250, 300, 400, 600, 900, 1700):
        sim.place(1, 1000, 1900 - far, math.pi / 2)
        sim.run(0.1)  # then its trail knows no other place
        steps.append(contrast(sim.image(1)))
    assert (steps[0], steps[1]) == (pytest.approx(steps[1], rel=0.01), pytest.approx(steps[2], rel=0.15))
    assert all(near >= far for near, far in pairwise(steps[1:]))
    assert 5 < steps[-1] < 0.2 * steps[0]  # it sees at any distance


EDGE = (230, 480, 70, 10, 1), (300, 480, 70, 10, 255)
STRIPE = (200, 480, 200, 10, 255), (280, 480, 40, 10, 1)


def moving(left: int, right: int, bars: Any = EDGE, y_mm: int = 300) -> list[float]:
    sim = scene(*bars, SPECK)
    kiks.Khepera(sim.port(1)).set_speed(left, right)
    sim.run(0.5)
    sim.place(1, 300, y_mm, math.pi / 2)
    sim.run(0.03)  # then the trail knows how it moves
    return sim.image(1)


def test_motion_smears_turning_smears_more_and_a_curve_less_on_its_side() -> None:
    still, driving, turning = moving(0, 0), moving(5, 5), moving(5, -5)
    assert contrast(turning) < contrast(driving) < contrast(still)
    assert contrast(turning) < 0.5 * contrast(still)
    assert contrast(moving(10, -10)) < contrast(turning)
    # Driving moves what is on the left to the left of the picture, and a left turn moves it back.
    to_left, to_right = (moving(*speeds, STRIPE, 400) for speeds in ((20, 24), (24, 20)))
    assert contrast(to_left[:32]) > 1.2 * contrast(to_left[32:])
    assert contrast(to_right[32:]) > 1.2 * contrast(to_right[:32])


def test_pictures_are_taken_at_whole_periods_however_often_one_looks() -> None:
    for code, period_ns in enumerate(PERIODS_NS):
        sim = scene(seed=3)
        firmware = sim.wires[0].firmware
        assert firmware.execute(f"T,2,U,{code}".encode(), 0) == b"t,2,u\r\n"
        before, changes = firmware.execute(b"T,2,N", 0), []
        for k in range(1, 31):
            run(sim, k * period_ns / 10e9 - sim.time_s)
            now = firmware.execute(b"T,2,N", sim.now_ns)
            if now != before:
                changes.append(k)
            before = now
        assert changes == [10, 20, 30]

    def drive(looks: int) -> tuple[list[int], str]:
        sim = scene((200, 480, 95, 20, 1), seed=8)
        robot = kiks.Khepera(sim.port(1))
        robot.set_speed(3, -2)
        for k in range(1, looks + 1):
            sim.run(0.1 + 1.234 * k / looks - sim.time_s)
            sim.pose(1)
        return robot.image(), sim.state_hash()

    assert drive(1) == drive(7) == drive(400)


def test_the_picture_shows_where_the_robot_was_at_that_instant() -> None:
    sim = scene((200, 480, 95, 20, 1))
    kiks.Khepera(sim.port(1)).set_speed(0, 0)
    sim.run(0.25 - sim.time_s)
    before = kiks.Khepera(sim.port(1)).image()
    sim.place(1, 300, 300, -math.pi / 2)
    sim.run(0.01)
    camera = camera_of(sim)
    assert camera.taken_ns % PERIODS_NS[0] == 0
    assert np.mean(before[2:24]) < 100
    run(sim, 0.2)
    assert np.mean(camera.pixels[10:24]) > 150


def pictures(sim: kiks.Simulation, *, first_order: bytes | None = None) -> tuple[list[bytes], str, int]:
    """Drive for 1.3 s and look at the picture 13 times."""
    firmware = sim.wires[0].firmware
    replies = [] if first_order is None else [firmware.execute(first_order, sim.now_ns)]
    for _ in range(13):
        replies += [firmware.execute(order, sim.now_ns) for order in (b"T,2,N", b"T,2,L")]
        run(sim, 0.1)
    return replies, sim.state_hash(), sim.now_ns


def test_a_change_of_period_takes_no_picture_of_the_past_and_a_restart_sets_that_of_the_power_on() -> None:
    sim = scene(seed=3)
    camera = camera_of(sim)
    run(sim, 0.47)
    assert camera.taken_ns == 400_000_000
    camera.order("U", (1,))
    run(sim, 0.02)
    assert camera.taken_ns == 400_000_000
    run(sim, 0.01)
    assert camera.taken_ns == 500_000_000
    camera.order("U", (7,))
    assert camera.period_ns == 5_000_000_000
    run(sim, 1.1 - sim.time_s)
    before = camera.taken_ns, camera.pixels
    assert before[0] == 500_000_000
    sim.wires[0].firmware.execute(b"restart", sim.now_ns)
    assert camera.period_ns == PERIODS_NS[0]
    assert (camera.taken_ns, camera.pixels) == before
    run(sim, 0.1)
    assert camera.taken_ns == 1_200_000_000
    assert camera.pixels != before[1]


def test_the_camera_is_part_of_the_state() -> None:
    sim = scene((200, 480, 95, 20, 1), seed=8)
    kiks.Khepera(sim.port(1)).set_speed(3, -2)
    sim.run(0.53 - sim.time_s)
    sim.wires[0].firmware.execute(b"T,2,U,1", sim.now_ns)
    run(sim, 0.3)
    snapshot, now_ns = sim.world.state.snapshot(), sim.now_ns
    straight_on = pictures(sim)
    assert len(set(straight_on[0])) > 20
    for detour in (None, b"T,2,U,6", None, b"D,-9,4", None, b"restart", None):
        sim.world.state.restore(snapshot)
        sim.world.now_ns = now_ns
        assert sim.state_hash() == snapshot.hash()
        assert (pictures(sim, first_order=detour) == straight_on) == (detour is None)


def test_noise_is_bounded_and_without_bias_and_repeats() -> None:
    sim = scene(seed=5)
    expected = np.array(sim.image(1))
    camera = camera_of(sim)
    rows = []
    for k in range(500):
        camera.look(k * 1000)
        rows.append(camera.pixels)
    noise = np.array(rows) - expected
    # 10 % of chance makes +-12.75, the converter +-9 at most, smeared over neighbours.
    assert np.abs(noise).max() <= 12.75 + 9 + 9 + 0.5
    assert np.abs(noise.mean(axis=0)).max() < 4
    assert 5 < noise.std() < 12
    for seed in (5, 6):
        camera = camera_of(scene(seed=seed))
        camera.look(499_000)
        assert (camera.pixels == rows[-1]) == (seed == 5)


@pytest.mark.slow
def test_no_place_is_too_narrow_or_too_wide() -> None:
    rng = np.random.default_rng(2)
    for arena in (kiks.Arena.box(100, 100, wall_mm=0), kiks.Arena.box(2000, 2000), kiks.Arena.default()):
        sim = kiks.Simulation(arena)
        sim.fit(1, "k213")
        for _ in range(100):
            x, y = rng.uniform(28, arena.width_mm - 28), rng.uniform(28, arena.height_mm - 28)
            if arena.free_for(x, y, 27.5):
                sim.place(1, x, y, rng.uniform(-10, 10))
                image = sim.image(1)
                assert all(0 <= grey <= 255 for grey in image)

"""Numbers from programs: what passes is finite and in range. The campaign `calls` tries all public calls."""

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.at_length import share
from tests.engine.checked_worlds import furnished
from tests.model.refusals import refused
from tools.campaigns.hostile import NUMBERS, OTHERS

import kiks
from kiks.engine.numbers import FARTHEST_RAD
from kiks.engine.scalar_math import sin_cos
from kiks.errors import KiksError
from kiks.model.arena import Arena
from kiks.model.array_checks import check_numbers
from kiks.model.checks import DEGREES_FROM, HEADING_KEPT_RAD, check_count, check_heading, check_number
from kiks.sim.drag import Drags
from kiks.sim.simulation import Simulation

ARENA = Arena.box(500, 500)

floats = st.one_of(st.floats(-60, 60), st.floats(allow_nan=False, allow_infinity=False))


def test_headings_are_wrapped_at_every_door_and_a_robot_can_be_put_back_after_many_turns() -> None:
    sim = Simulation(ARENA, seed=1)
    for heading_rad in (1e20, -1e20, 1e308, HEADING_KEPT_RAD + 1.0, 2.0**63):
        turn_rad = math.remainder(heading_rad, 2 * math.pi)
        sim.place(1, 250, 250, heading_rad)
        assert sim.pose(1) == (250, 250, turn_rad)
        assert kiks.Khepera(sim.port(1)).proximity() is not None
        hands = Drags(sim)
        hands.grab("a", "robot", 0)
        hands.turn("a", heading_rad)
        hands.keep()
        assert sim.pose(1)[2] == turn_rad
        batch = kiks.Batch(ARENA, 2, starts=(250, 250, heading_rad), seed=1)
        assert (batch.poses[:, 0, 2] == turn_rad).all()
        assert (batch.reset([1], starts=(250, 250, heading_rad)) >= 0).all()
    turned = Arena(ARENA.brightness, 1.0, "turned", starts=[(250, 250, 3e6)])  # type: ignore[arg-type]
    assert kiks.Batch(turned, 1).state_hash(0) == Simulation(turned).state_hash()
    sim = Simulation(ARENA, seed=1)
    robot = kiks.Khepera(sim.port(1))
    robot.set_speed(-40, 40)
    for _ in range(20):
        robot.pause(0.5)
        sim.place(1, *sim.pose(1))
    assert sim.pose(1)[2] > 3 * math.tau


@pytest.mark.parametrize(("width_mm", "height_mm"), [(600, 200), (200, 600)])
def test_a_lamp_that_is_dragged_out_of_the_arena_stays_at_its_edge(width_mm: int, height_mm: int) -> None:
    sim = Simulation(Arena.box(width_mm, height_mm), seed=1)
    sim.add_lamp(50, 50)
    hands = Drags(sim)
    hands.grab("a", "lamp", 0)
    for x_mm, y_mm in ((0, 0), (width_mm, 0), (0, height_mm), (width_mm, height_mm)):
        hands.move("a", 1e6 if x_mm else -1e6, 1e6 if y_mm else -1e6)
        assert sim.lamps[0, :2].tolist() == [x_mm, y_mm]


def test_a_heading_in_degrees_is_refused_at_every_door() -> None:
    sim, batch = Simulation(ARENA, seed=1), kiks.Batch(ARENA, 1)
    ball = sim.add_ball(100, 100)
    doors: list[Callable[[float], object]] = [
        lambda degrees: sim.place(1, 250, 250, degrees),
        lambda degrees: sim.move_body(ball, 100, 100, speed_mm_s=10, heading_rad=degrees),
        lambda degrees: sim.add_robot(pose=(400, 400, degrees)),
        lambda degrees: sim.proximity_at(1, np.array([[250, 250, degrees]])),
        lambda degrees: Arena(ARENA.brightness, 1.0, "turned", starts=((250, 250, degrees),)),  # type: ignore[arg-type]
        lambda degrees: kiks.Batch(ARENA, 1, starts=(250, 250, degrees)),
        lambda degrees: batch.reset(starts=[[(250, 250, degrees)]]),
    ]
    for degrees in (90, 90.0, -45, 100, 22.5, 180, 270, np.int64(360), np.float32(30)):
        for door in doors:
            refused(rf"heading_rad must be in radians.*math.radians\({degrees:g}\)", door, degrees)
    assert sim.robot_count == 1


@given(st.floats(allow_nan=True, allow_infinity=True))
def test_sine_and_cosine_of_anything_are_a_direction(angle_rad: float) -> None:
    sine, cosine = sin_cos(angle_rad)
    assert sine * sine + cosine * cosine == pytest.approx(1.0, abs=1e-12)
    if abs(angle_rad) <= FARTHEST_RAD:
        assert (sine, cosine) == pytest.approx((math.sin(angle_rad), math.cos(angle_rad)), abs=1e-6)


@given(st.one_of(st.floats(), st.integers(), st.text(), st.none(), st.booleans()))
@settings(max_examples=share(100, 300))
def test_a_number_that_passes_is_finite_and_in_range(number: Any) -> None:
    for check in (check_number, check_count):
        with suppress(KiksError):
            value = check("it", number, 0, 1000)  # type: ignore[operator]
            assert 0 <= value <= 1000
            assert value == number


@given(floats)
def test_a_heading_is_kept_or_wrapped_to_one_whose_sine_is_exact(heading_rad: float) -> None:
    if DEGREES_FROM <= abs(heading_rad) <= HEADING_KEPT_RAD and heading_rad % 0.5 == 0:
        return  # taken for degrees
    found = check_heading("it", heading_rad)
    assert abs(found) <= HEADING_KEPT_RAD
    if abs(heading_rad) <= HEADING_KEPT_RAD:
        assert (found, math.copysign(1.0, found)) == (heading_rad, math.copysign(1.0, heading_rad))


def test_numbers_that_pass_are_a_finite_array_of_their_own() -> None:
    for hostile in (*NUMBERS, *OTHERS):
        with suppress(KiksError):
            values = check_numbers("it", hostile)
            assert values.dtype == np.float64
            assert np.isfinite(values).all()
            assert not np.shares_memory(values, np.asarray(hostile))
    words = r"it must be finite numbers \[any, 4\], but it had the shape \[2, 3\]"
    refused(words, check_numbers, "it", np.zeros((2, 3)), (None, 4))


def test_a_lamp_beyond_everything_costs_no_time_and_a_checkpoint_cannot_be_written_to() -> None:
    sim = furnished()
    sim.lamps[0] = (9e8, 130.0, 1.0, 1.0)
    assert len(sim.ambient(1)) == 8
    saved = sim.checkpoint()
    with pytest.raises(ValueError, match="read-only"):
        saved.bodies["holder"] = 99
    sim.reset(saved)
    refused(r"checkpoint must be a kiks.Checkpoint, but it was 3", sim.reset, 3)

"""Laws: whatever a program hands over, it is told what is wrong, or all stays sane; nothing else is ever raised."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.engine.checked_worlds import furnished, sense_everything

import kiks
from kiks import controllers, measures
from kiks.engine.numbers import FARTHEST_RAD
from kiks.engine.scalar_math import sin_cos
from kiks.errors import SHOWN_MAX, KiksError
from kiks.model.arena import Arena
from kiks.model.array_checks import check_numbers
from kiks.model.checks import DEGREES_FROM, HEADING_KEPT_RAD, check_count, check_heading, check_number, wrapped
from kiks.sim.drag import Drags
from kiks.sim.simulation import Simulation

HOSTILE = (
    *(1e20, 1e308, -1e308, -0.0, 5e-324, 2**63, -(2**63), 2**64, 10**400, -(10**400), 10**5000),
    *(math.inf, -math.inf, math.nan, True, None, "x", "", b"x", 1j, 0, 1, -1, 1.5),
    *(np.float32(1e20), np.float64(1e308), np.float16(1), np.int8(-1), np.int64(2**62), np.uint64(2**63 + 1)),
    *(np.bool_(True), np.zeros(3), np.zeros(0), np.full((2, 2), np.nan), np.array([1, "a"], object), np.str_("a")),
    *([], [1, [2]], (), {}, {1: 2}, set(), object(), len, int, Arena, range(3), slice(None), ..., bytearray(3)),
)
"""Finite numbers beyond all sense, what is no number, and what is something else."""

NAMES = [f"{number}_{type(each).__name__}" for number, each in enumerate(HOSTILE)]

ARENA = Arena.box(500, 500)


def is_long(value: Any) -> bool:
    """Say whether a simulation would be busy with so many seconds for longer than a test may be."""
    return isinstance(value, int | float | np.number) and 1.5 < value < 1e10


def told_or_done(calls: dict[str, Callable[[], Any]]) -> None:
    """Make calls; each must do something, or raise an error of KiKS that is not longer than a few lines."""
    for name, call in calls.items():
        said = ""
        try:
            call()
        except KiksError as error:
            said = str(error)
        except Exception as error:
            raise AssertionError(f"{name} raised {error!r}") from error
        assert len(said) < 10 * SHOWN_MAX, name


def grab_and_keep(hands: Drags, index: Any) -> None:
    hands.grab("b", "robot", index)
    hands.move("b", 140, 130)
    hands.keep()


def of_simulation(sim: Simulation, h: Any) -> dict[str, Callable[[], Any]]:
    hands = Drags(sim)
    hands.grab("a", "robot", 1)
    return {
        "place x": lambda: sim.place(1, h, 130, 0),
        "place y": lambda: sim.place(1, 150, h, 0),
        "place heading": lambda: sim.place(1, 150, 130, h),
        "place robot": lambda: sim.place(h, 150, 130, 0),
        "pose": lambda: sim.pose(h),
        "port": lambda: sim.port(h),
        "fit robot": lambda: sim.fit(h, "radio"),
        "fit turret": lambda: sim.fit(2, h),
        "proximity": lambda: sim.proximity(h),
        "proximity noise": lambda: sim.proximity(1, noise=h),
        "ambient": lambda: sim.ambient(h),
        "rays": lambda: sim.rays(h),
        "explain": lambda: sim.explain(h, 0),
        "explain sensor": lambda: sim.explain(1, h),
        "explain light": lambda: sim.explain_light(1, h),
        "image": lambda: sim.image(h),
        "contacts": lambda: sim.contacts(h),
        "record paths": lambda: sim.record_paths(h),
        "set arena": lambda: sim.set_arena(h),
        "add robot": lambda: sim.add_robot(h),
        "add robot pose": lambda: Simulation(ARENA).add_robot(pose=h),
        "add robot heading": lambda: Simulation(ARENA).add_robot(pose=(150, 130, h)),
        "ball x": lambda: sim.add_ball(h, 130),
        "ball radius": lambda: sim.add_ball(150, 130, radius_mm=h),
        "ball friction": lambda: sim.add_ball(150, 130, friction_mm_s2=h),
        "ball brightness": lambda: sim.add_ball(150, 130, brightness=h),
        "cylinder": lambda: sim.add_cylinder(150, h),
        "lamp": lambda: sim.add_lamp(h, 1),
        "lamp power": lambda: sim.add_lamp(1, 1, h),
        "lamp switch": lambda: sim.add_lamp(1, 1, 1, is_on=h),
        "remove lamp": lambda: sim.remove_lamp(h),
        "move body": lambda: sim.move_body(h, 60, 60),
        "move body x": lambda: sim.move_body(1, h, 60),
        "move body speed": lambda: sim.move_body(1, 60, 60, speed_mm_s=h),
        "move body heading": lambda: sim.move_body(1, 60, 60, speed_mm_s=10, heading_rad=h),
        "reset": lambda: sim.reset(h),
        "lamps": lambda: setattr(sim, "lamps", h),
        "move": lambda: hands.move("a", h, 100),
        "turn": lambda: hands.turn("a", h),
        "grab": lambda: Drags(sim).grab("b", h, 0),
        "grab index": lambda: grab_and_keep(Drags(sim), h),
        "run": lambda: sim.run(0.1 if is_long(h) else h),
        "arena": lambda: Simulation(h),
        "seed": lambda: Simulation(ARENA, seed=h),
        "robots": lambda: Simulation(ARENA, robots=h),
        "kind": lambda: Simulation(ARENA, robot=h),
        "response": lambda: Simulation(ARENA, response=h),
        "thinking": lambda: Simulation(ARENA, thinking=h),
    }


@pytest.mark.slow
@pytest.mark.parametrize("hostile", HOSTILE, ids=NAMES)
def test_a_simulation_stays_sane(hostile: Any) -> None:
    sim = furnished()
    told_or_done(of_simulation(sim, hostile))
    sense_everything(sim)
    assert np.isfinite(sim.poses()).all()


def of_client(sim: Simulation, h: Any) -> dict[str, Callable[[], Any]]:
    robot, port = kiks.Khepera(sim.port(1)), sim.port(2)
    drives = controllers.linear()
    zeros = np.zeros(18)
    return {
        "speed": lambda: robot.set_speed(h, 1),
        "encoders": lambda: robot.set_encoders(h, h),
        "move to": lambda: robot.move_to(h, 0),
        "profile": lambda: robot.set_profile(h, h),
        "pwm": lambda: robot.set_pwm(h, 0),
        "speed gains": lambda: robot.set_speed_gains(h),
        "position gains": lambda: robot.set_position_gains(1, h),
        "analog": lambda: robot.analog(h),
        "led": lambda: robot.led(h, h),
        "read bus": lambda: robot.read_bus(h),
        "write bus": lambda: robot.write_bus(h, h),
        "turret": lambda: robot.turret(h, "N"),
        "turret order": lambda: robot.turret(2, h),
        "send": lambda: robot.send(h),
        "pause": lambda: robot.pause(0.1 if is_long(h) else h),
        "client": lambda: kiks.Khepera(h),
        "client baud": lambda: kiks.Khepera("kiks://no-such/1", baud=h),
        "time-out": lambda: setattr(port, "timeout", h),
        "read": lambda: port.readline(),
        "baud": lambda: setattr(port, "baudrate", h),
        "kopen": lambda: kiks.kopen(h),
        "kopen port": lambda: kiks.kopen([h]),
        "kclose": lambda: kiks.kclose(h),
        "ksend": lambda: kiks.ksend("N\n", h),
        "ktime": lambda: kiks.ktime(h),
        "drive": lambda: kiks.drive(h, drives, zeros, seconds=0),
        "drive controller": lambda: kiks.drive(port, h, seconds=0),
        "drive parameters": lambda: kiks.drive(port, drives, h, seconds=0),
        "drive seconds": lambda: kiks.drive(port, drives, zeros, seconds=0.1 if is_long(h) else h),
        "drive period": lambda: kiks.drive(port, drives, zeros, seconds=0.1, period_s=0.1 if is_long(h) else h),
    }


@pytest.mark.slow
@pytest.mark.parametrize("hostile", HOSTILE, ids=NAMES)
def test_a_client_stays_sane(hostile: Any) -> None:
    sim = furnished()
    told_or_done(of_client(sim, hostile))
    sense_everything(sim)
    assert np.isfinite(sim.poses()).all()


def of_batch(batch: kiks.Batch, h: Any) -> dict[str, Callable[[], Any]]:
    drives, zeros = controllers.linear(), np.zeros(18)
    return {
        "arena": lambda: kiks.Batch(h, 1),
        "worlds": lambda: kiks.Batch(ARENA, h),
        "robot": lambda: kiks.Batch(ARENA, 2, robot=h),
        "robot of each": lambda: kiks.Batch(ARENA, 2, robot=[h, h]),
        "robots": lambda: kiks.Batch(ARENA, 1, robots=h),
        "seed": lambda: kiks.Batch(ARENA, 2, seed=h),
        "seeds": lambda: kiks.Batch(ARENA, 2, seed=[h, h]),
        "starts": lambda: kiks.Batch(ARENA, 2, starts=h),
        "start heading": lambda: kiks.Batch(ARENA, 2, starts=(250, 250, h)),
        "senses": lambda: kiks.Batch(ARENA, 1, senses=h),
        "sense": lambda: kiks.Batch(ARENA, 1, senses=[h]),
        "measures": lambda: kiks.Batch(ARENA, 1, measures=h),
        "timing": lambda: kiks.Batch(ARENA, 1, timing=h),
        "threads": lambda: kiks.Batch(ARENA, 1, threads=h),
        "response": lambda: kiks.Batch(ARENA, 1, response=h),
        "period": lambda: kiks.Timing(h),
        "baud": lambda: kiks.Timing(0.1, h),
        "think": lambda: kiks.Timing(0.1, think_s=h),
        "run controller": lambda: batch.run(h, seconds=0.1),
        "run parameters": lambda: batch.run(drives, h, seconds=0.1),
        "run parameter": lambda: batch.run(drives, [h] * 18, seconds=0.1),
        "run seconds": lambda: batch.run(drives, zeros, seconds=0.1 if is_long(h) else h),
        "run measures": lambda: batch.run(drives, zeros, seconds=0.1, measures=h),
        "reset": lambda: batch.reset(h),
        "reset seeds": lambda: batch.reset([0], seeds=h),
        "reset starts": lambda: batch.reset([0], starts=h),
        "reset heading": lambda: batch.reset([0], starts=(250, 250, h)),
        "step": lambda: (batch.reset(), batch.step(h)),
        "step speeds": lambda: (batch.reset(), batch.step([[[h, h]]] * 2)),
        "hash": lambda: batch.state_hash(h),
        "lamps": lambda: setattr(batch, "lamps", h),
        "wall following": lambda: measures.wall_following(h),
        "wall counts": lambda: measures.wall_following(counts=h),
        "coverage": lambda: measures.coverage(h),
        "coverage square": lambda: measures.coverage(ARENA, square_mm=h),
        "goal": lambda: measures.goal_mm(h, h),
        "reached": lambda: measures.reached_s(0, 0, radius_mm=h),
        "closest": lambda: measures.closest_mm(h, 0),
        "near light": lambda: measures.near_light_share(h),
        "gathered": lambda: measures.gathered(0, h),
        "largest group": lambda: measures.largest_group(h),
        "measure": lambda: kiks.measure(h),
        "measure notes": lambda: kiks.measure(notes=h)(lambda moment, notes: None),
        "controller senses": lambda: controllers.linear(senses=h),
        "controller speed": lambda: controllers.linear(speed_limit=h),
        "hidden": lambda: controllers.mlp(hidden=h),
        "hidden units": lambda: controllers.mlp(hidden=[h]),
        "neurons": lambda: controllers.ctrnn(neurons=h),
        "units": lambda: controllers.gru(units=h),
        "units of elman": lambda: controllers.elman(units=h),
        "plastic neurons": lambda: controllers.plastic(neurons=h),
        "plastic per": lambda: controllers.plastic(per=h),
    }


@pytest.mark.slow
@pytest.mark.parametrize("hostile", HOSTILE, ids=NAMES)
def test_a_batch_stays_sane(hostile: Any) -> None:
    batch = kiks.Batch(ARENA, 2, seed=1)
    batch.reset()
    told_or_done(of_batch(batch, hostile))
    batch.reset()
    batch.step(np.full((2, 1, 2), 9.0))
    assert np.isfinite(batch.poses).all()


@pytest.mark.slow
@pytest.mark.parametrize("hostile", HOSTILE, ids=NAMES)
def test_environments_stay_sane(hostile: Any) -> None:
    from kiks.learn.gymnasium_envs import KheperaEnv, KheperaVectorEnv
    from kiks.learn.pettingzoo_env import KheperaTeam

    h = hostile
    env, many, team = KheperaEnv("Maze"), KheperaVectorEnv(2, "Maze"), KheperaTeam("Avoid", robots=2)
    for each in (env, many, team):
        each.reset(seed=1)
    told_or_done(
        {
            "lesson": lambda: KheperaEnv(h),
            "render mode": lambda: KheperaEnv("Maze", render_mode=h),
            "arenas": lambda: KheperaEnv("Maze", arenas=h),
            "timing": lambda: KheperaEnv("Maze", timing=h),
            "starts": lambda: KheperaEnv("Maze", starts=h),
            "seed": lambda: env.reset(seed=h),
            "options": lambda: env.reset(options=h),
            "action": lambda: env.step(h),
            "action of two": lambda: env.step([h, h]),  # type: ignore[arg-type]
            "worlds": lambda: KheperaVectorEnv(h, "Maze"),
            "limit": lambda: KheperaVectorEnv(1, "Maze", max_episode_steps=h),
            "autoreset": lambda: KheperaVectorEnv(1, "Maze", autoreset_mode=h),
            "seeds": lambda: many.reset(seed=[h, h]),
            "mask": lambda: many.reset(options={"reset_mask": h}),
            "actions": lambda: many.step(h),
            "actions of two": lambda: many.step([[h, h], [0, 0]]),  # type: ignore[arg-type]
            "cycles": lambda: KheperaTeam("Avoid", robots=2, max_cycles=h),
            "team seed": lambda: team.reset(seed=h),
            "team": lambda: team.step(h),
            "team action": lambda: team.step({"robot_1": h, "robot_2": [0, 0]}),  # type: ignore[dict-item]
        }
    )
    assert np.isfinite(env.reset(seed=1)[0]).all()


@pytest.mark.parametrize("heading_rad", [1e20, -1e20, 1e308, HEADING_KEPT_RAD + 1.0, 2.0**63])
def test_headings_are_wrapped_at_every_door(heading_rad: float) -> None:
    turn_rad = math.remainder(heading_rad, 2 * math.pi)
    sim = Simulation(ARENA, seed=1)
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


@pytest.mark.parametrize("degrees", [90, 90.0, -45, 100, 22.5, 180, 270, np.int64(360), np.float32(30)])
def test_a_heading_in_degrees_is_refused_at_every_door(degrees: float) -> None:
    sim = Simulation(ARENA, seed=1)
    ball = sim.add_ball(100, 100)
    batch = kiks.Batch(ARENA, 1)
    for door in (
        lambda: sim.place(1, 250, 250, degrees),
        lambda: sim.move_body(ball, 100, 100, speed_mm_s=10, heading_rad=degrees),
        lambda: sim.add_robot(pose=(400, 400, degrees)),
        lambda: sim.proximity_at(1, np.array([[250, 250, degrees]])),
        lambda: Arena(ARENA.brightness, 1.0, "turned", starts=((250, 250, degrees),)),  # type: ignore[arg-type]
        lambda: kiks.Batch(ARENA, 1, starts=(250, 250, degrees)),
        lambda: batch.reset(starts=[[(250, 250, degrees)]]),
    ):
        with pytest.raises(kiks.ParameterError, match=rf"heading_rad must be in radians.*math.radians\({degrees:g}\)"):
            door()
    assert sim.robot_count == 1


@given(st.floats(-30, 30), st.integers(-4, 4))
def test_a_heading_that_counts_turns_is_kept(heading_rad: float, turns: int) -> None:
    turned = heading_rad + turns * math.tau
    if abs(turned) < DEGREES_FROM or turned % 0.5:
        assert check_heading("it", turned) == turned


def test_a_robot_can_be_put_back_where_it_was_after_many_turns() -> None:
    sim = Simulation(ARENA, seed=1)
    robot = kiks.Khepera(sim.port(1))
    robot.set_speed(-40, 40)
    for _ in range(20):
        robot.pause(0.5)
        sim.place(1, *sim.pose(1))
    assert sim.pose(1)[2] > 3 * math.tau


def test_a_far_start_is_the_same_in_a_simulation_and_a_batch() -> None:
    turned = Arena(ARENA.brightness, 1.0, "turned", starts=[(250, 250, 3e6)])  # type: ignore[arg-type]
    assert kiks.Batch(turned, 1).state_hash(0) == Simulation(turned).state_hash()


@given(st.floats(-HEADING_KEPT_RAD, HEADING_KEPT_RAD))
def test_headings_in_use_stay_as_they_are(heading_rad: float) -> None:
    assert math.copysign(1.0, wrapped(heading_rad)) == math.copysign(1.0, heading_rad)
    assert wrapped(heading_rad) == heading_rad


@given(st.floats(allow_nan=True, allow_infinity=True))
def test_sine_and_cosine_of_anything_are_a_direction(angle_rad: float) -> None:
    sine, cosine = sin_cos(angle_rad)
    assert sine * sine + cosine * cosine == pytest.approx(1.0, abs=1e-12)
    if abs(angle_rad) <= FARTHEST_RAD:
        assert (sine, cosine) == pytest.approx((math.sin(angle_rad), math.cos(angle_rad)), abs=1e-6)


@given(st.one_of(st.floats(), st.integers(), st.text(), st.none(), st.booleans()))
@settings(max_examples=300)
def test_a_number_that_passes_is_finite_and_in_range(number: Any) -> None:
    for check in (check_number, check_count):
        try:
            value = check("it", number, 0, 1000)  # type: ignore[operator]
        except KiksError:
            continue
        assert 0 <= value <= 1000
        assert value == number


@given(
    st.floats(allow_nan=False, allow_infinity=False).filter(
        lambda heading_rad: heading_rad % 0.5 or not DEGREES_FROM <= abs(heading_rad) <= 1e6
    )
)
def test_a_heading_is_always_one_whose_sine_is_exact(heading_rad: float) -> None:
    assert abs(check_heading("it", heading_rad)) <= HEADING_KEPT_RAD


@pytest.mark.parametrize("hostile", HOSTILE, ids=NAMES)
def test_numbers_that_pass_are_a_finite_array_of_their_own(hostile: Any) -> None:
    try:
        values = check_numbers("it", hostile)
    except KiksError:
        return
    assert values.dtype == np.float64
    assert np.isfinite(values).all()
    assert not np.shares_memory(values, np.asarray(hostile))


def test_numbers_of_another_shape_are_named() -> None:
    with pytest.raises(KiksError, match=r"it must be finite numbers \[any, 4\], but it had the shape \[2, 3\]"):
        check_numbers("it", np.zeros((2, 3)), (None, 4))


def test_a_lamp_beyond_everything_costs_no_time() -> None:
    sim = furnished()
    sim.lamps[0] = (9e8, 130.0, 1.0, 1.0)
    assert len(sim.ambient(1)) == 8


def test_a_checkpoint_cannot_be_written_to() -> None:
    sim = furnished()
    saved = sim.checkpoint()
    with pytest.raises(ValueError, match="read-only"):
        saved.bodies["holder"] = 99
    sim.reset(saved)
    with pytest.raises(KiksError, match=r"checkpoint must be a kiks.Checkpoint, but it was 3"):
        sim.reset(3)  # type: ignore[arg-type]

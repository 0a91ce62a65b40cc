"""A batch: the same whatever the number of threads and the blocks; and clear words for what is wrong."""

import pickle
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from tests.learn.small import refused

import kiks
from kiks.batch.batch import LANES
from kiks.batch.initial_state import random_starts
from kiks.batch.loop import sort_commands
from kiks.batch.loop_timing import LENGTHS
from kiks.engine.compiling import callable_kernel
from kiks.model.arena_objects import Ball, Lamp
from kiks.model.family import family


@kiks.controller(parameters=2)
def vehicle(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Drive at a speed, and turn away from what is near."""
    near = sensors[0] + 2.0 * sensors[1] + 3.0 * sensors[2] - 3.0 * sensors[3] - 2.0 * sensors[4] - sensors[5]
    wheels[0] = parameters[0] + parameters[1] * near
    wheels[1] = parameters[0] - parameters[1] * near


def arenas() -> list[kiks.Arena]:
    walls = np.zeros((400, 400), np.uint8)
    walls[150:160, 100:300] = 200
    return [kiks.Arena.from_array(walls), kiks.Arena.box(500, 300, rounded_mm=80)]


def make(world_count: int = 37, **changes: Any) -> kiks.Batch:
    """Return worlds of two arenas with robots that differ."""
    robots = family(kiks.RobotSpec.load("khepera"), world_count, seed=4, dead_share=0.1)
    usual = {"arena": arenas(), "robot": robots, "seed": 21, "timing": kiks.Timing(0.05, 57600, 0.0013)}
    return kiks.Batch(worlds=world_count, **usual | changes)


def hashes(batch: kiks.Batch, seconds: float = 6.0) -> list[str]:
    parameters = np.column_stack([np.linspace(2, 15, batch.world_count), np.linspace(0.001, 0.02, batch.world_count)])
    batch.run(vehicle, parameters, seconds=seconds)
    return [batch.state_hash(world) for world in range(batch.world_count)]


def all_hashes() -> str:
    """Return the hashes of worlds of every kind: alone, with a ball, with each response, and what they read."""
    lines = hashes(make())
    ball = [kiks.Arena(each.brightness, 1.0, "b", balls=(Ball(330, 100),)) for each in arenas()]
    lines += hashes(kiks.Batch(ball, 5, robots=2, seed=1))
    for response in ("thesis", "fast"):
        batch = make(9, response=response)
        lines += hashes(batch)
        lines.append(batch.reset().tobytes().hex())
    lit = [kiks.Arena(each.brightness, 1.0, "l", lamps=(Lamp(200, 250, 2.0),)) for each in arenas()]
    lines.append(kiks.Batch(lit, 9, senses=("ambient", "proximity")).reset().tobytes().hex())
    return "\n".join(lines)


@pytest.fixture(scope="module")
def expected() -> list[str]:
    return hashes(make(threads=1))


@pytest.mark.slow
def test_threads_and_blocks_do_not_matter(expected: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    for threads, lanes in ((2, LANES), (5, LANES), (2, 8), (2, 24), (2, 1000)):
        monkeypatch.setattr("kiks.batch.batch.LANES", lanes)
        assert hashes(make(threads=threads)) == expected, (threads, lanes)


def test_threads_that_share_a_batch_take_turns():
    batch = kiks.Batch(kiks.Arena.box(600, 600), worlds=64, seed=1, threads=2)

    def drive(_number: int) -> Any:
        return batch.run(vehicle, [5.0, 0.01], seconds=2, measures=[kiks.measures.path_mm]).values.tolist()

    alone = drive(0)
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(drive, range(8))) == [alone] * 8

    def step(number: int) -> None:
        if number % 3:
            batch.step(np.full((64, 1, 2), number))
        else:
            batch.reset()

    batch.reset()
    with ThreadPoolExecutor(6) as pool:
        list(pool.map(step, range(60)))
    fresh = kiks.Batch(kiks.Arena.box(600, 600), worlds=1, seed=1)
    assert batch.reset()[0].tolist() == fresh.reset()[0].tolist()
    assert batch.state_hash(0) == fresh.state_hash(0)


def test_a_world_is_the_same_among_others_and_alone_and_in_a_second_run(expected: list[str]) -> None:
    robots = family(kiks.RobotSpec.load("khepera"), 37, seed=4, dead_share=0.1)
    for world in (0, 13, 36):
        alone = make(1, arena=arenas()[world % 2], robot=[robots[world]], seed=21 + world)
        alone.run(vehicle, [np.linspace(2, 15, 37)[world], np.linspace(0.001, 0.02, 37)[world]], seconds=6.0)
        assert alone.state_hash(0) == expected[world]
    batch = make(threads=1)
    hashes(batch, seconds=1.0)
    assert hashes(batch) == expected


def test_worlds_can_be_reset_one_by_one() -> None:
    batch = make(10)
    first = batch.reset()
    wheels = np.full((10, 1, 2), 8.0)
    for _ in range(5):
        batch.step(wheels)
    again = batch.reset([2, 7])
    np.testing.assert_array_equal(again[[2, 7]], first[[2, 7]])
    assert batch.times_s[2] == 0.0
    assert batch.times_s[3] > 0.2
    moved = batch.reset([4], seeds=[99], starts=[[[60.0, 60.0, 0.5]]])
    np.testing.assert_allclose(batch.poses[4, 0], [60.0, 60.0, 0.5])
    assert not np.array_equal(moved[4], first[4])


def test_lamps_can_be_moved_in_each_world() -> None:
    lit = kiks.Arena(arenas()[0].brightness, 1.0, "lit", lamps=(Lamp(200, 250, 2.0),))
    batch = kiks.Batch(lit, 3, senses="ambient", starts=(200, 60, 1.57))
    batch.lamps[1, 0, 3] = 0.0
    batch.lamps[2, 0, :2] = 200, 100
    dark = batch.reset()[:, 0].min(axis=1)
    assert dark[2] < dark[0] < dark[1]


def test_random_starts_of_several_robots_are_clear_of_each_other() -> None:
    arena = kiks.Arena.box(500, 500)
    starts = random_starts(arena, 50, seed=1, robots=8, clear_mm=4.0)
    assert starts.shape == (50, 8, 3)
    gaps = np.linalg.norm(starts[:, :, None, :2] - starts[:, None, :, :2], axis=3) - 55.0
    assert gaps[:, ~np.eye(8, dtype=bool)].min() > 4.0
    kiks.Batch(arena, 50, robots=8, starts=starts)  # accepts them
    np.testing.assert_array_equal(starts[:, 0], random_starts(arena, 50, seed=1, clear_mm=4.0))
    refused("must have room for 60 robots", random_starts, arena, 1, seed=1, robots=60)


def test_a_family_differs_and_repeats() -> None:
    robots = family(kiks.RobotSpec.load("khepera"), 20, seed=1, dead_share=0.5)
    assert robots == family(kiks.RobotSpec.load("khepera"), 20, seed=1, dead_share=0.5)
    assert len(set(robots)) == 20
    dead = np.mean([np.array(robot.proximity.gain) == 0.0 for robot in robots])
    assert 0.3 < dead < 0.7


def test_wrong_arguments_are_errors() -> None:
    for words, options in (
        ("worlds must be a whole number from 1", {"worlds": 0}),
        ("robots must be a whole number from 1", {"robots": 0}),
        ("threads must be", {"threads": 0}),
        ("seeds must be", {"seed": -1}),
        ("seeds must be 4 whole numbers", {"seed": [1, 2]}),
        ("start of robot 1 of world 0 must be free", {"starts": (10, 10, 0)}),
        ("starts must be poses", {"starts": [[1, 2]]}),
        ("starts must be finite numbers", {"starts": (np.nan, 10, 0)}),
        ("one for each of 4 worlds", {"robot": ["khepera"] * 3}),
        ("senses must be some of", {"senses": ("smell",)}),
    ):
        refused(words, kiks.Batch, arenas()[0], **{"worlds": 4} | options)
    with_ball = kiks.Arena(arenas()[0].brightness, 1.0, "b", balls=(Ball(330, 100),))
    refused("same number of balls and cylinders", kiks.Batch, [arenas()[0], with_ball], 2)


def test_an_arena_may_come_in_several_turns() -> None:
    one, other = arenas()
    batch = kiks.Batch([one, other, one, one], 7, seed=3)
    assert (batch.arenas, batch.arena_indices.tolist()) == ([one, other], [0, 1, 0, 0, 0, 1, 0])
    again = pickle.loads(pickle.dumps(batch))
    for each in (batch, again):
        each.run(kiks.controllers.linear(), [0.5] * 18, seconds=1)
        for world, index in enumerate(batch.arena_indices):
            alone = kiks.Batch(batch.arenas[index], 1, seed=3 + world)
            alone.run(kiks.controllers.linear(), [0.5] * 18, seconds=1)
            assert each.state_hash(world) == alone.state_hash(0)


@kiks.controller(senses=("ambient",))
def light_only(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Stand still."""


def test_runs_and_steps_reject_wrong_arguments() -> None:
    alone, pair = (kiks.Batch(kiks.Arena.box(400, 400), 4, robots=robots).run for robots in (1, 2))
    given = [1.0, 0.0]
    refused("must be given 2 parameters", alone, vehicle, [1.0], seconds=1.0)
    refused("must be finite", alone, vehicle, [[1.0, np.nan]], seconds=1.0)
    refused(r"parameters must be \[parameter\]", alone, vehicle, np.zeros((3, 2)), seconds=1.0)
    refused("seconds must be", alone, vehicle, given, seconds=-1)
    refused("controller must be a kiks.Controller", alone, 5, given, seconds=1.0)
    refused("each of measures must be a kiks.Measure", alone, vehicle, given, seconds=1.0, measures=[5])
    words = "or a list of 2, one for each robot of a world, but it was a list of 1"
    refused(words, pair, [vehicle], [given], seconds=1.0)
    refused("controller must be a kiks.Controller", pair, [vehicle, 5], [given] * 2, seconds=1.0)
    words = "'light_only' senses ambient where another senses proximity"
    refused(words, pair, [vehicle, light_only], [given, []], seconds=1.0)
    refused("a list with those of each of the 2 controllers", pair, [vehicle] * 2, [1.0, 0.0, 2.0], seconds=1.0)
    refused("must be given 2 parameters", pair, [vehicle] * 2, [given, [1.0]], seconds=1.0)
    words = r"those of robot 2 had the shape \(3, 2\)"
    refused(words, pair, [vehicle] * 2, [given, np.zeros((3, 2))], seconds=1.0)
    batch = make(2)
    refused(r"reset\(\) must be called", batch.step, np.zeros((2, 1, 2)))
    batch.reset()
    refused("wheels must be", batch.step, np.zeros((2, 2)))
    refused("world must be a whole number from 0 to 1", batch.state_hash, 2)


def test_the_same_controller_for_each_robot_is_one_for_all() -> None:
    batch, given = kiks.Batch(kiks.Arena.box(400, 400), 3, robots=2, seed=1), np.random.default_rng(1).random((3, 2))
    batch.run(vehicle, given, seconds=3.0)
    expected = [batch.state_hash(world) for world in range(3)]
    batch.run([vehicle, vehicle], [given, given], seconds=3.0)
    assert [batch.state_hash(world) for world in range(3)] == expected


def counts(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    wheels[0] = len(sensors) + 10 * len(memory) + len(parameters) + parameters[-1]


@kiks.measure(notes=4, result=lambda notes: notes, names=("error", "next_mm", "own_mm", "left"))
def seen(moment: Any, notes: Any) -> None:
    """How far what it sees of itself and of its number of robots is wrong, summed up; two places and a speed."""
    own = moment.poses[moment.robot]
    notes[0] += abs(own[0] - moment.x_mm) + abs(own[1] - moment.y_mm) + abs(own[2] - moment.heading_rad)
    notes[0] += abs(len(moment.poses) - 3)
    notes[1] = moment.poses[(moment.robot + 1) % 3, 0]
    notes[2] = moment.x_mm
    notes[3] = moment.wheels[0]


def test_controllers_get_their_own_counts_of_numbers_and_measures_see_all_robots() -> None:
    large = kiks.controller(senses=("proximity", "ambient"), memory=3, parameters=1)(counts)
    small = kiks.controller(memory=1)(counts)
    batch = kiks.Batch(kiks.Arena.box(400, 400), 1, robots=3)
    rollouts = batch.run([small, large, small], [[1, 2.0], [-1.0], [1, 2, 3]], seconds=0.1, measures=[seen])
    assert rollouts.values[0, :, 3].tolist() == [8 + 10 + 2 + 2, 16 + 30 + 1 - 1, 8 + 10 + 3 + 3]
    batch = kiks.Batch(kiks.Arena.box(500, 500), 10, robots=3, seed=2, measures=[seen])
    values = batch.run(vehicle, [1.0, 0.01], seconds=2.0).values  # the measures of the batch
    assert batch.run(vehicle, [1.0, 0.01], seconds=0.1, measures=[]).measures == ()
    assert (values[..., 0] == 0.0).all()
    assert np.array_equal(values[..., 1], np.roll(values[..., 2], -1, axis=1))


def test_commands_act_in_the_order_of_their_lengths() -> None:
    """The counting sort is that of Python: by length, and by number where lengths are equal."""
    wheels = np.random.default_rng(1).choice([-127.0, -10.0, -9.0, 0.0, 7.0, 55.0, 127.0], (2, 300, 2))
    turns = np.zeros((2, 300), np.int64)
    line = kiks.Timing().line(kiks.RobotSpec.load("khepera"))
    callable_kernel(sort_commands.py_func)(line, wheels, 1, turns)
    lengths = [len(f"D,{left:.0f},{right:.0f}\n") for left, right in wheels[1]]
    assert max(lengths) == len("D,-127,-127\n") < LENGTHS
    assert turns[1].tolist() == sorted(range(300), key=lambda robot: lengths[robot])
    assert not turns[0].any()

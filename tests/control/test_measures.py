"""Measures that come with KiKS against plain NumPy over all that they saw."""

import pickle
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.at_length import at_length
from tests.learn.small import refused, small

import kiks
from kiks.control.measure import Moment
from kiks.engine.state import BODY
from kiks.learn.environments import nearer_to_light
from kiks.model.arena import Cylinder, Lamp
from kiks.model.arena_objects import LampSwitch

WORLDS, STEPS, COLUMNS = 4, 150, 16

FULL = kiks.controllers.mlp(hidden=(), feedback=True)

PLACE_MM, RADIUS_MM = (250.0, 200.0), 120.0

WAYS = [kiks.measures.trajectory(seconds=15, points=points) for points in (1, 7, 30)]

CORNER = kiks.measures.trajectory(
    seconds=15, points=7, describe=lambda ways: ways[..., :2].max(axis=-2), names=["right_mm", "top_mm"]
)


def arena() -> kiks.Arena:
    box = kiks.Arena.box(500, 400)
    return replace(box, cylinders=(Cylinder(150, 100), Cylinder(300, 300), Cylinder(350, 150)), lamps=(Lamp(100, 350),))


class Trace:
    """All moments of a run, one array for each thing seen, [world, step, ...]; and what all measures say of it."""

    def __init__(self) -> None:
        kept: list[Any] = []

        @kiks.measure(notes=1 + COLUMNS * STEPS, result=lambda notes: (kept.append(notes.copy()), notes[..., 0])[1])
        def record(moment: Any, notes: Any) -> None:
            first = 1 + COLUMNS * int(notes[0])
            notes[0] += 1.0
            notes[first : first + 8] = moment.sensors
            notes[first + 8] = moment.wheels[0]
            notes[first + 9] = moment.wheels[1]
            notes[first + 10], notes[first + 11] = moment.x_mm, moment.y_mm
            notes[first + 12], notes[first + 13] = moment.time_s, moment.path_mm
            notes[first + 14] = 1.0 if moment.is_touching else 0.0
            notes[first + 15] = moment.period_s

        each = kiks.measures
        measures = [
            *(each.path_mm, each.net_mm, each.straightness, each.speed_pulses, each.turned_pulses),
            *(each.final_x_mm, each.final_y_mm, each.avoidance, each.touching_share, each.contacts, each.light_mm),
            *(each.beside_wall_share("right", counts=200), each.near_light_share(RADIUS_MM), each.light_approach),
            *(each.light_stay_s(RADIUS_MM), each.goal_mm(*PLACE_MM), each.closest_mm(*PLACE_MM), each.spread_mm),
            *(
                each.reached_s(*PLACE_MM, radius_mm=RADIUS_MM, missed_s=99),
                each.gathered(*PLACE_MM, radius_mm=RADIUS_MM),
            ),
        ]
        self.batch = kiks.Batch(arena(), worlds=WORLDS, seed=4)
        parameters = kiks.controllers.random_parameters(FULL, WORLDS, seed=5)
        parameters[:, :2] = 1.0
        self.starts_mm = self.batch.poses[:, 0, :2].copy()
        watching = [record, *measures, *WAYS, CORNER]
        values = self.batch.run(FULL, parameters, seconds=15.0, measures=watching).values[:, 0].T
        ends = np.cumsum([len(measure.value_names) for measure in watching])
        self.of = {measure.name: value[0] for measure, value in zip(watching, np.split(values, ends), strict=False)}
        self.ways = np.split(values, ends)[-1 - len(WAYS) - 1 : -1]
        assert (kept[0][:, 0, 0] == STEPS).all()
        steps = kept[0][:, 0, 1:].reshape(WORLDS, STEPS, COLUMNS)
        self.sensors, self.wheels, self.places_mm = steps[..., :8], steps[..., 8:10], steps[..., 10:12]
        self.times_s, self.paths_mm, self.is_touching, self.periods_s = np.moveaxis(steps[..., 12:], -1, 0)

    def far_mm(self, x_mm: float, y_mm: float) -> Any:
        return np.hypot(self.places_mm[..., 0] - x_mm, self.places_mm[..., 1] - y_mm)


@pytest.fixture(scope="module")
def trace() -> Trace:
    return Trace()


@pytest.mark.slow
def test_distance_measures(trace: Trace) -> None:
    found, last = trace.of, trace.places_mm[:, -1]
    net_mm = np.hypot(*(last - trace.starts_mm).T)
    np.testing.assert_array_equal(found["path_mm"], trace.paths_mm[:, -1])
    np.testing.assert_array_equal([found["final_x_mm"], found["final_y_mm"]], last.T)
    np.testing.assert_allclose(found["net_mm"], net_mm)
    np.testing.assert_allclose(found["straightness"], net_mm / trace.paths_mm[:, -1])
    np.testing.assert_allclose(found["speed_pulses"], trace.wheels.mean(axis=(1, 2)))
    turned = (abs(trace.wheels).sum(axis=2) * trace.periods_s / 0.01).sum(axis=1)
    np.testing.assert_allclose(found["turned_pulses"], turned)
    np.testing.assert_allclose(trace.periods_s.sum(axis=1), trace.times_s[:, -1])


@pytest.mark.slow
def test_scores_of_drives(trace: Trace) -> None:
    shares = trace.wheels / 10.0
    straight = 1 - np.sqrt(abs(shares[..., 0] - shares[..., 1]) / 2)
    highest = trace.sensors.max(axis=2) / 1023
    scores = (np.maximum(shares.mean(axis=2), 0) * straight * (1 - highest)).mean(axis=1)
    np.testing.assert_allclose(trace.of["avoidance"], scores, atol=1e-12)
    np.testing.assert_allclose(trace.of["beside_wall_share"], (trace.sensors[..., 5] >= 200).mean(axis=1))
    np.testing.assert_allclose(trace.of["touching_share"], trace.is_touching.mean(axis=1))
    assert trace.of["touching_share"].max() > 0
    np.testing.assert_array_equal(trace.of["contacts"], trace.batch.state.robots["contact_count"][:, 0])


@pytest.mark.slow
def test_place_measures(trace: Trace) -> None:
    far_mm = trace.far_mm(*PLACE_MM)
    np.testing.assert_allclose(trace.of["goal_mm"], far_mm[:, -1])
    np.testing.assert_allclose(trace.of["closest_mm"], far_mm.min(axis=1))
    for world in range(WORLDS):
        arrived = np.flatnonzero(far_mm[world] <= RADIUS_MM)
        assert trace.of["reached_s"][world] == (trace.times_s[world, arrived[0]] if len(arrived) else 99)
    lamp_mm = trace.far_mm(100, 350)
    np.testing.assert_allclose(trace.of["light_mm"], lamp_mm[:, -1])
    np.testing.assert_allclose(trace.of["near_light_share"], (lamp_mm <= RADIUS_MM).mean(axis=1))
    start_mm = np.hypot(*(trace.starts_mm - (100, 350)).T)
    made = np.maximum(1 - lamp_mm / start_mm[:, None], 0)
    np.testing.assert_allclose(trace.of["light_approach"], made.mean(axis=1))
    assert trace.of["light_approach"].max() > 0
    last_away = [np.flatnonzero(np.append(True, each > RADIUS_MM))[-1] for each in lamp_mm]
    stays_s = [trace.periods_s[world, first:].sum() for world, first in enumerate(last_away)]
    np.testing.assert_allclose(trace.of["light_stay_s"], stays_s)
    # Nothing has moved the cylinders since the last step, or next to nothing.
    places_mm = np.stack([trace.batch.state.bodies["x_mm"], trace.batch.state.bodies["y_mm"]], axis=-1)
    within = (np.hypot(*np.moveaxis(places_mm - PLACE_MM, -1, 0)) <= RADIUS_MM).sum(axis=1)
    np.testing.assert_array_equal(trace.of["gathered"], within)
    spread_mm = np.sqrt(((places_mm - places_mm.mean(axis=1, keepdims=True)) ** 2).sum(axis=2).mean(axis=1))
    np.testing.assert_allclose(trace.of["spread_mm"], spread_mm, atol=5.0)


def moment(**given: Any) -> Any:
    """Return a moment of a robot that stands in the middle of nowhere, of the types that a batch compiles for."""
    usual = dict.fromkeys(Moment._fields, 0.0) | {
        "sensors": np.zeros(8),
        "wheels": np.zeros(2),
        "is_touching": False,
        "bodies": np.zeros(0, BODY),
        "lamps": np.zeros((0, 4)),
        "robot": 0,
        "poses": np.zeros((1, 3)),
    }
    return Moment(**(usual | given))


def after(measure: kiks.Measure, *moments: Any) -> float:
    """Return what a measure says after some moments."""
    notes = np.zeros(measure.note_count)
    for each in moments:
        measure.kernel(each, notes)
    return float(measure.result(notes[None])[0])


@given(st.lists(st.tuples(st.floats(0, 499), st.floats(0, 299)), max_size=80))
def test_coverage_counts_each_square_once(places_mm: list[tuple[float, float]]) -> None:
    coverage = kiks.measures.coverage(kiks.Arena.box(500, 300), square_mm=25)
    squares = {(int(x_mm // 25), int(y_mm // 25)) for x_mm, y_mm in places_mm}
    assert after(coverage, *(moment(x_mm=x_mm, y_mm=y_mm) for x_mm, y_mm in places_mm)) == len(squares) / 240


@given(
    st.tuples(st.integers(-127, 127), st.integers(-127, 127)), st.lists(st.integers(0, 1023), min_size=8, max_size=8)
)
def test_scores_lie_between_none_and_one(wheels: tuple[int, int], sensors: list[int]) -> None:
    now = moment(wheels=np.array(wheels, float), sensors=np.array(sensors, float))
    for measure in (kiks.measures.avoidance, kiks.measures.wall_following("left")):
        assert 0.0 <= after(measure, now, now) <= 1.0


def along_wall(seconds: float, counts: Callable[[float], float], x_mm: Callable[[float], float]) -> list[Any]:
    """Return the moments of a robot, ten a second, with counts of the left sensor and a place at each time."""
    moments = []
    for step in range(1, round(10 * seconds) + 1):
        sensors = np.zeros(8)
        sensors[0] = counts(0.1 * step)
        moments.append(moment(time_s=0.1 * step, period_s=0.1, sensors=sensors, x_mm=x_mm(0.1 * step)))
    return moments


def test_shuttling_or_spinning_is_not_roaming() -> None:
    """Ahead at 64 mm/s for half a minute, the same to and fro, and around on the spot."""
    ways = (lambda s: 64.0 * s), (lambda s: 64.0 * abs((s + 0.2) % 0.4 - 0.2)), (lambda s: 0.0)
    ahead, shuttling, spinning = (after(kiks.measures.roaming, *along_wall(30, lambda s: 0.0, way)) for way in ways)
    assert 0.7 < ahead < 0.8
    assert shuttling < 0.1
    assert spinning < 0.01


def test_following_a_wall_scores_and_standing_shuttling_or_leaving_it_does_not() -> None:
    following = kiks.measures.wall_following("left")
    ahead, wall = (lambda s: 50.0 * s), (lambda s: 300.0)
    kept = after(following, *along_wall(60, wall, ahead))
    # The first ten seconds count half.
    assert kept == pytest.approx(55 / 60, abs=0.02)
    assert after(kiks.measures.wall_following("right"), *along_wall(60, wall, ahead)) == 0.0
    assert after(following, *along_wall(60, lambda s: 40.0, ahead)) == 0.0
    assert after(following, *along_wall(60, wall, lambda s: 0.0)) == 0.0
    assert after(following, *along_wall(60, wall, lambda s: 10.0 * (s % 1.0))) < 0.15
    # A wall end takes a second of six, a way across the room three of six: then a wall is never kept for long.
    ends = after(following, *along_wall(60, lambda s: 300.0 * (s % 6 < 5), ahead))
    crossing = after(following, *along_wall(60, lambda s: 300.0 * (s % 6 < 3), ahead))
    assert 0.7 < ends < kept
    assert crossing < 0.1


def test_lamps_that_do_not_burn_are_none_and_measures_of_a_drive_without_steps_zero() -> None:
    lamps = np.array([[10.0, 0.0, 1.0, 0.0], [30.0, 40.0, 1.0, 1.0]])
    assert after(kiks.measures.light_mm, moment(lamps=lamps)) == 50.0
    assert after(kiks.measures.light_mm, moment(lamps=lamps[:1])) == np.inf
    assert after(kiks.measures.light_approach, moment(lamps=lamps[:1])) == 0.0
    assert after(kiks.measures.light_stay_s(RADIUS_MM), moment(lamps=lamps[:1])) == 0.0
    for measure in (kiks.measures.avoidance, kiks.measures.straightness, kiks.measures.touching_share):
        assert after(measure) == 0.0
    assert after(kiks.measures.spread_mm, moment()) == 0.0


@given(st.lists(st.tuples(st.floats(-500, 500), st.floats(-500, 500)), max_size=8), st.sampled_from((60.0, 150.0)))
def test_groups_and_closeness_follow_from_the_distances_of_pairs(places_mm: Any, radius_mm: float) -> None:
    bodies = np.zeros(len(places_mm), BODY)
    bodies["x_mm"], bodies["y_mm"] = np.reshape(places_mm, (-1, 2)).T
    squares_mm2 = (bodies["x_mm"] - bodies["x_mm"][:, None]) ** 2 + (bodies["y_mm"] - bodies["y_mm"][:, None]) ** 2
    counts = (squares_mm2 <= radius_mm**2).sum(axis=1)
    assert after(kiks.measures.largest_group(radius_mm), moment(bodies=bodies)) == counts.max(initial=0)
    pairs = squares_mm2[np.tril_indices(len(places_mm), -1)]
    wanted = (1 / (1 + pairs / 1e4)).mean() if len(pairs) else 0.0
    assert after(kiks.measures.closeness, moment(bodies=bodies)) == pytest.approx(wanted)


def test_a_measure_is_the_same_under_another_name_which_a_table_needs_if_it_is_there_twice() -> None:
    goal_mm, names = kiks.measures.goal_mm, ("goal_mm", "near_mm", "far_mm", "end_x_mm_1", "end_y_mm_1")
    given = [goal_mm(60, 200), goal_mm(60, 200).named("near_mm"), goal_mm(440, 200).named("far_mm")]
    given.append(pickle.loads(pickle.dumps(WAYS[0].named("first").named("end"))))
    batch, still = kiks.Batch(arena(), worlds=2, seed=1), np.zeros(FULL.parameter_count)
    rollouts = batch.run(FULL, still, seconds=0.3, measures=given)
    assert rollouts.measures == (*names, "end_heading_rad_1")
    one, same, other, *end = np.moveaxis(rollouts.values[:, 0], -1, 0)
    assert one.tolist() == same.tolist() != other.tolist()
    assert end[0].tolist() == batch.poses[:, 0, 0].tolist()
    refused("name must", given[0].named, "")
    for measures in (given[:1] * 2, [given[0].named("seconds")], [given[0].named("fitness")]):
        refused(r"must have different names, .* measure\.named\(", small, measures=measures)

    @kiks.measure
    def beyond(moment: Any, notes: Any) -> None:
        notes[1] = moment.x_mm

    refused("'mine' must stay .*notes=2", batch.run, FULL, still, seconds=1, measures=[beyond.named("mine")])


@at_length
def test_ready_measures_are_finite_where_nothing_is_about_but_lamps_that_a_task_misses() -> None:
    room = kiks.Arena.box(400, 400)
    needs: dict[str, tuple[Any, ...]] = dict.fromkeys(("goal_mm", "closest_mm", "reached_s", "gathered"), (9, 9))
    needs["coverage"] = (room,)
    watching: list[Any] = [WAYS[0], nearer_to_light]
    for name in set(kiks.measures.__all__) - {"trajectory"}:
        found = getattr(kiks.measures, name)
        watching.append(found if isinstance(found, kiks.Measure) else found(*needs.get(name, ())))
    switches = (LampSwitch(0.2, lamp=1, is_on=False), LampSwitch(0.6, lamp=1, is_on=True), LampSwitch(0.8, 1, False))
    unlit = replace(room, lamps=(Lamp(100, 350),), lamp_switches=switches)
    ahead = np.full(FULL.parameter_count, 0.1)
    for world in (room, unlit):
        values = kiks.Batch(world, 2, seed=1).run(FULL, ahead, seconds=1, measures=watching)
        broken = {name for k, name in enumerate(values.measures) if not np.isfinite(values.values[..., k]).all()}
        assert broken == {"light_mm", "reached_s"}
        task = small(arenas=world, measures=[kiks.measures.light_mm], axes=())
        refused("'light_mm' was inf. No lamp burned", task.evaluate, np.zeros((1, 18)), np.zeros(1, np.int64), 1)


def test_the_same_arguments_make_the_same_measure() -> None:
    measures = kiks.measures
    assert measures.coverage(kiks.Arena.box(500, 300)) is measures.coverage(kiks.Arena.box(450, 250), square_mm=100)
    assert measures.gathered(1, 2, radius_mm=3) is measures.gathered(y_mm=2.0, x_mm=1.0, radius_mm=3.0)
    assert measures.largest_group(100) is measures.largest_group()
    assert measures.wall_following() is measures.wall_following("left", counts=50)
    assert measures.beside_wall_share() is measures.beside_wall_share("left", counts=50)
    assert measures.reached_s(1, 2) is not measures.reached_s(1, 3)


def test_arguments_out_of_range_and_what_is_not_sensed_are_refused() -> None:
    measures = kiks.measures
    refused("side must be 'left' or 'right', but it was 'top'", measures.wall_following, "top")
    refused("at most 1000000 squares, but 1 mm", measures.coverage, kiks.Arena.box(2000, 2000), square_mm=1)
    refused("x_mm must be a number, but it was 'here'", measures.goal_mm, "here", 0)
    refused("radius_mm must be at least 0", measures.largest_group, -1)
    batch = kiks.Batch(kiks.Arena.box(300, 300), worlds=1)
    controller = kiks.controllers.linear(senses=("ambient", "proximity"))
    with pytest.raises(kiks.ParameterError, match=r"'avoidance' must find proximity first .* 'linear' senses ambient"):
        batch.run(controller, np.zeros(34), seconds=1, measures=[kiks.measures.avoidance])


def test_a_trajectory_is_the_last_pose_of_each_interval_and_stays_where_a_trial_has_ended(trace: Trace) -> None:
    for way, values in zip(WAYS, trace.ways, strict=False):
        assert len(way.value_names) == len(values)
        ways = values.reshape(-1, 3, WORLDS)
        assert (ways[-1, 0] == trace.of["final_x_mm"]).all()
        for k in range(len(ways)):
            ends_s = 15.0 * (k + 1) / len(ways)
            for world in range(WORLDS):
                step = np.flatnonzero((trace.times_s[world] < ends_s) | (k == len(ways) - 1)).max()
                assert (ways[k, :2, world] == trace.places_mm[world, step]).all()
    parameters = np.zeros(FULL.parameter_count)
    parameters[:2] = 0.5
    rollouts = kiks.Batch(arena(), worlds=2, seed=1).run(FULL, parameters, seconds=2, measures=[WAYS[2]])
    ways = rollouts.values.reshape(2, 30, 3)
    assert (ways[:, 4:] == ways[:, 3:4]).all()
    assert (ways[:, 2] != ways[:, 3]).any()


def test_what_describes_a_way_has_a_name_for_each_number(trace: Trace) -> None:
    assert (trace.ways[3] == trace.ways[1].reshape(7, 3, WORLDS)[:, :2].max(axis=0)).all()
    refused("names must be given with describe", kiks.measures.trajectory, seconds=1, names=["a"])
    short = kiks.measures.trajectory(seconds=15, describe=lambda ways: ways[..., 0, :1], names=["a", "b"])
    refused("the named values for each world and robot", short.value, np.zeros((WORLDS, 1, short.note_count)))


def test_a_task_describes_behaviours_with_several_values_of_a_measure() -> None:
    axes = kiks.Axis("right_mm", 0, 1000), kiks.Axis("top_mm", 0, 1000)
    task = small(measures=(*small().measures, CORNER), axes=axes)
    champion = kiks.Evolution(task, "map-elites:cells=20", seed=1, population=8).run(generations=2)
    assert {"right_mm", "top_mm"} < set(champion.measures)

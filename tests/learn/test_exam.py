"""Exams: their starts are those of the wire."""

from dataclasses import replace

import numpy as np
import pytest
from tests.learn.small import ahead, refused, small

import kiks
from kiks.learn.exam import EXAM_SEED, IMPERFECT, PASS_SHARE, ExamResult, imperfect_robots
from kiks.model.arena import Pose

ROOM = kiks.Arena.box(500, 500)


SLOW = kiks.Champion(ahead, (1, 1))


def exam_of(solved="path_mm > 100", **changes):
    return kiks.Exam(
        [ROOM], [kiks.measures.path_mm, kiks.measures.contacts], solved, **{"worlds": 4, "seconds": 5} | changes
    )


def test_a_start_is_what_happens_on_a_serial_line():
    champion = kiks.Champion(kiks.controllers.linear(speed_limit=8.0), tuple(np.linspace(-3, 3, 18).tolist()))
    exam = exam_of(seconds=20)
    examined = exam.examine(champion)
    poses = exam.random_starts(EXAM_SEED, robots=1, radius_mm=27.5)[:, 0]
    for start, pose in enumerate(poses.tolist()):
        sim, ports = champion.simulation(replace(ROOM, starts=(Pose(*pose),)), seed=EXAM_SEED + start)
        champion.drive(ports, seconds=exam.seconds)
        path_mm, contacts = examined.values[start].tolist()
        # The measure sees the robot when the last command takes effect, the wire a loop later.
        assert 0.0 <= sim.travelled_mm(1) - path_mm < 0.1 * 8.0 * 10.0
        assert contacts == sim.contacts(1)


def test_starts_take_the_arenas_in_turn():
    far_mm = kiks.measures.final_x_mm
    arenas = [kiks.Arena.box(200, 200), kiks.Arena.box(2000, 200)]
    exam = kiks.Exam(arenas, [far_mm], "final_x_mm > 200", worlds=40, seconds=0.1)
    solved = exam.examine(SLOW).solved
    assert not solved[::2].any()
    assert solved[1::2].sum() > 10


@pytest.mark.parametrize(("solved", "word"), [(18, "solved"), (17, "not solved")])
def test_the_text_says_whether_the_exam_is_passed(solved, word):
    result = ExamResult(np.arange(20) < solved, np.zeros((20, 1)), ("path_mm",), "went far")
    assert result.is_passed == (solved >= PASS_SHARE * 20)
    assert str(result) == f"Exam: {word}, {solved} of 20 starts (went far)"


def test_wrong_exams_are_errors():
    refused("worlds must be", exam_of, worlds=0)
    refused("a multiple of the", kiks.Exam, [ROOM, ROOM], [kiks.measures.path_mm], "True", worlds=3)
    refused("solved must be .*Such as 'contacts == 0", exam_of, lambda values: values["path_mm"] > 100)
    refused("solved must be a formula, but 'path_mm >' is none", exam_of, "path_mm >")
    refused("solved must use the measures of the exam.*Did you mean 'contacts'", exam_of, "contact < 1")
    refused("solved must be a number, but .* has none in start 0: .*division", exam_of("1 / contacts").examine, SLOW)
    refused("champion must be a kiks.Champion", exam_of().examine, "me")
    refused("exam must be", kiks.tasks.avoid, exam=ROOM)


def test_an_exam_with_imperfect_robots_is_that_with_each_of_them():
    robots = imperfect_robots(SLOW)
    assert len(robots) == IMPERFECT == len(set(robots))
    assert robots == imperfect_robots(SLOW)
    result = exam_of().examine(SLOW, kinds=robots)
    assert result.solved.shape == (4 * IMPERFECT,)
    for number, robot in enumerate(robots):
        alone = exam_of().examine(replace(SLOW, robot=robot))
        assert (result.values[4 * number : 4 * number + 4] == alone.values).all()


@kiks.measure
def is_late(moment, notes):
    notes[0] = moment.time_s > 0.95


@kiks.measure
def last_s(moment, notes):
    notes[0] = moment.time_s


def test_tasks_and_exams_end_a_trial_by_the_same_measure():
    task = small(measures=[last_s], fitness=None, seconds=5.0, axes=(), until=is_late)
    candidates, seeds = np.ones((2, task.parameter_count)), np.zeros(2, np.int64)
    ends_s = task.evaluate(candidates, seeds, 1)[:, 1]
    assert (ends_s > 0.95).all()
    assert (ends_s < 1.1).all()
    exam = kiks.Exam(task.arenas[:4], [last_s], "last_s < 2", seconds=5, worlds=4)
    champion = kiks.Champion(task.controller, tuple(candidates[0]))
    assert not exam.examine(champion).solved.any()
    assert exam.with_changes(until=is_late).examine(champion).solved.all()

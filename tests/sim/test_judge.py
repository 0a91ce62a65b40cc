"""The judge of a run: what each name of a formula is, when a run ends, and what is kept of its result."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests import forked

import kiks
from kiks import ParameterError, Simulation
from kiks.model.arena import Arena, Cylinder, Lamp, Pose
from kiks.model.goal import Goal
from kiks.model.project import Project
from kiks.sim.judge import LOOK_S, Judge, Judgement
from kiks.sim.supervision import Supervision

PLACE_MM, LAMP_MM = (250.0, 200.0), (100.0, 350.0)

TURNS = {0: (6, 5), 25: (-3, 4), 40: (9, 9), 80: (2, -8), 100: (7, 8)}
"""Speeds of robot 1 by the look after which they are sent."""


def world() -> Simulation:
    cylinders = Cylinder(150, 100), Cylinder(300, 300), Cylinder(350, 150)
    lamps, starts = (Lamp(*LAMP_MM), Lamp(400, 50, 1.0, False)), (Pose(200, 150, 0.3), Pose(80, 330, 2.0))
    arena = replace(Arena.box(500, 400), cylinders=cylinders, lamps=lamps, starts=starts)
    return Simulation(arena, robots=2, seed=4)


def looked(sim: Simulation, wheels: tuple[int, int]) -> SimpleNamespace:
    """Return what a person sees of robot 1 at an instant."""
    x_mm, y_mm, _ = sim.pose(1)
    return SimpleNamespace(
        time_s=sim.time_s,
        x_mm=x_mm,
        y_mm=y_mm,
        path_mm=sim.travelled_mm(1),
        contacts=sim.contacts(1),
        is_touching=bool(sim.world.state.robots[0, 0]["is_touching"] > 0),
        wheels=wheels,
        proximity=sim.proximity(1),
        bodies_mm=np.column_stack([sim.bodies()["x_mm"], sim.bodies()["y_mm"]]),
        other_mm=sim.poses()[1, :2],
    )


Looks = list[SimpleNamespace]


def away_mm(looks: Looks, x_mm: float, y_mm: float) -> Any:
    return np.hypot([each.x_mm - x_mm for each in looks], [each.y_mm - y_mm for each in looks])


def last_run_s(holds: Any) -> float:
    return LOOK_S * next((k for k, each in enumerate(reversed(list(holds))) if not each), len(holds))


def near_others(looks: Looks, radius_mm: float) -> Any:
    bodies = looks[-1].bodies_mm
    return (np.hypot(*(bodies[:, None] - bodies[None]).transpose(2, 0, 1)) <= radius_mm).sum(axis=1)


EXPECTED: dict[str, Callable[[Looks], float]] = {
    "time_s": lambda looks: looks[-1].time_s,
    "path_mm": lambda looks: looks[-1].path_mm,
    "net_mm": lambda looks: away_mm(looks, 200, 150)[-1],
    "contacts": lambda looks: looks[-1].contacts,
    "touching_share": lambda looks: np.mean([each.is_touching for each in looks]),
    "final_x_mm": lambda looks: looks[-1].x_mm,
    "final_y_mm": lambda looks: looks[-1].y_mm,
    "speed_pulses": lambda looks: np.mean([each.wheels for each in looks]),
    "turned_pulses": lambda looks: sum(100 * LOOK_S * (abs(a) + abs(b)) for a, b in (each.wheels for each in looks)),
    "light_mm": lambda looks: away_mm(looks, *LAMP_MM)[-1],
    "goal_mm(250, 200)": lambda looks: away_mm(looks, *PLACE_MM)[-1],
    "closest_mm(250, 200)": lambda looks: away_mm(looks, *PLACE_MM).min(),
    "reached_s(250, 200, missed_s=99)": lambda looks: LOOK_S * (1 + np.argmax(away_mm(looks, *PLACE_MM) <= 50)),
    "near_light_share(200)": lambda looks: np.mean(away_mm(looks, *LAMP_MM) <= 200),
    "light_stay_s(300)": lambda looks: last_run_s(away_mm(looks, *LAMP_MM) <= 300),
    "coverage": lambda looks: len({(each.x_mm // 100, each.y_mm // 100) for each in looks}) / 20,
    "coverage(square_mm=50)": lambda looks: len({(each.x_mm // 50, each.y_mm // 50) for each in looks}) / 80,
    "beside_wall_share('right', counts=30)": lambda looks: np.mean([each.proximity[5] >= 30 for each in looks]),
    "gathered(300, 250, radius_mm=80)": lambda looks: (np.hypot(*(looks[-1].bodies_mm - (300, 250)).T) <= 80).sum(),
    "largest_group(170)": lambda looks: near_others(looks, 170).max(),
    "neighbour_mm": lambda looks: away_mm(looks, *looks[-1].other_mm)[-1],
    "contacts(robot=2)": lambda looks: 0,
    "goal_mm(250, 200, robot=2)": lambda looks: np.hypot(*(looks[-1].other_mm - PLACE_MM)),
    "held_s(light_mm < 300)": lambda looks: last_run_s(away_mm(looks, *LAMP_MM) < 300),
    "total_s(goal_mm(250, 200) < 90)": lambda looks: LOOK_S * (away_mm(looks, *PLACE_MM) < 90).sum(),
    "total_s(held_s(path_mm > 50) > 1)": lambda looks: LOOK_S * max(sum(each.path_mm > 50 for each in looks) - 10, 0),
    "wall_mm": lambda looks: min(looks[-1].x_mm, 500 - looks[-1].x_mm, looks[-1].y_mm, 400 - looks[-1].y_mm) - 37.5,
    'score("laps") + score(2)': lambda looks: 10,
    "is_solved + 1": lambda looks: 1,
}  # fmt: skip


@pytest.fixture(scope="module")
def run() -> tuple[Simulation, Looks, dict[str, float]]:
    """Return a run with what was seen of it, and what a judge has counted of each formula."""
    sim = world()
    sim.set_score("laps", 7)
    sim.set_score(2, 3)
    judges = {text: Judge(sim, Goal(points=text)) for text in EXPECTED}
    watching = [judge.supervise(sim) for judge in judges.values()]
    for each in watching:
        next(each)
    looks, wheels = [], (0, 0)
    for number in range(130):
        if number in TURNS:
            wheels = TURNS[number]
            sim.port(1).write("D,{},{}\n".format(*wheels).encode())
        sim.run(LOOK_S)
        looks.append(looked(sim, wheels))
        for each in watching:
            next(each)
    assert looks[-1].contacts > 0
    assert 0 < sum(each.is_touching for each in looks) < len(looks)
    return sim, looks, {text: judge.end().points for text, judge in judges.items()}


@pytest.mark.parametrize("text", EXPECTED)
def test_each_name_of_a_formula_is_what_a_person_sees(text: str, run: Any) -> None:
    _, looks, points = run
    assert points[text] == pytest.approx(EXPECTED[text](looks), abs=0.051 if text == "wall_mm" else 6e-4)


def test_every_measure_of_one_value_can_be_judged() -> None:
    sim, tried = world(), {text.split("(")[0] for text in EXPECTED}
    with pytest.raises(ParameterError, match="must use trajectory as its reference says"):
        Judge(sim, Goal(points="trajectory(1, 2)"))
    for name in {*kiks.measures.__all__} - tried - {"trajectory"}:
        assert np.isfinite(Judge(sim, Goal(points=name)).end().points)


def test_a_run_of_a_controller_is_judged_by_what_a_batch_measures() -> None:
    arena = replace(Arena.box(500, 500), starts=(Pose(250, 250, 0.5),))
    controller, parameters = kiks.controllers.linear(), [0.8, 0.8] + [0.0] * 16
    names = ("contacts", "path_mm", "final_x_mm", "final_y_mm")
    batch = kiks.Batch(arena, 1, seed=3)
    measures = [getattr(kiks.measures, name) for name in names]
    values = batch.run(controller, parameters, seconds=10, measures=measures).values[0, 0]
    sim = Simulation(arena, seed=3)
    kiks.drive(sim.port(1), controller, parameters, seconds=10)
    # The batch has measured at its last step, at most a tenth of a second before the end; the robot stands at a wall.
    found = [Judge(sim, Goal(points=name)).end().points for name in names]
    np.testing.assert_allclose(found, values, atol=0.1)


# ---- how a run ends ----

ABSENT = dict.fromkeys(("neighbour_mm", "escaped_share"), "another robot") | dict.fromkeys(
    ("spread_mm", "closeness", "largest_group", "gathered(9, 9)", "taken_out"), "a ball or a cylinder"
)
ABSENT |= dict.fromkeys(("light_approach", "light_stay_s(9)", "near_light_share"), "a lamp")

COUNTS_LAPS = """
def supervise(sim):
    while True:
        yield 0.5
        sim.set_score("laps", 2 * sim.time_s)
"""


def supervised(goal: Goal, tmp_path: Path, referee: str = "") -> tuple[Simulation, Supervision, list[str]]:
    file = tmp_path / "referee.py"
    file.write_text(referee)
    sim = Simulation(Arena.box(500, 500), seed=1)
    supervision, said = Supervision(sim, file if referee else None, goal), []
    supervision.end = lambda code, message: said.append(f"{code}: {message}")
    sim.port(1).write(b"D,10,10\n")
    return sim, supervision, said


def test_a_run_ends_at_the_first_look_at_which_it_is_solved(tmp_path: Path) -> None:
    sim, supervision, said = supervised(Goal(solved="path_mm >= 60", points="50 - time_s"), tmp_path)
    sim.run(0.7)
    assert said == []
    sim.run(2)
    assert supervision.judge.judgement == Judgement(True, False, 49.2, 0.8)
    assert said == ["0: "]
    assert dict(sim.score) == {"points": 49.2, "result": "solved after 0.8 s"}
    assert supervision.decide() == "Goal solved after 0.8 s, 49.2 points."


def test_a_run_is_judged_by_its_goal_and_what_a_judge_in_python_counts(tmp_path: Path) -> None:
    for goal, run_s, decision in (
        ({"failed": "contacts > 0", "points": "round(path_mm / 100)"}, 10, "failed after 2.8 s, 2 points."),
        ({"solved": "time_s >= 1"}, 3, "solved after 1.0 s, 1 point."),
        ({"solved": 'score("laps") >= 3', "points": 'score("laps")'}, 4, "solved after 1.5 s, 3 points."),
        ({"solved": "is_over"}, 1, "solved after 1.0 s, 1 point."),  # what must hold to the end
        ({"solved": "is_over", "failed": "time_s >= 1"}, 1, "failed after 1.0 s, 0 points."),
    ):
        sim, supervision, said = supervised(Goal(**goal), tmp_path, COUNTS_LAPS)
        sim.run(run_s)
        assert len(said) == (goal != {"solved": "is_over"})
        assert supervision.decide() == f"Goal {decision}"


def test_a_run_that_ends_before_is_judged_as_it_is(tmp_path: Path) -> None:
    sim, supervision, said = supervised(Goal(points="round(held_s(path_mm >= 0), 3)"), tmp_path)
    sim.run(1.234)
    supervision.close()
    assert said == []
    for _ in range(2):
        # The time since the last look counts as it is, and not as a whole tenth of a second.
        assert supervision.decide() == "Goal not solved after 1.2 s, 1.234 points."
        sim.run(5)


def test_people_see_the_points_as_they_come(tmp_path: Path) -> None:
    sim, _, _ = supervised(Goal(points="10 * time_s"), tmp_path)
    for points in (1, 1, 11, 11):
        sim.run(0.5)
        assert sim.score["points"] == points


def test_a_formula_without_a_value_ends_the_run_in_one_line(tmp_path: Path) -> None:
    sim, _, said = supervised(Goal(solved="1 / (time_s < 2) > 5"), tmp_path)
    sim.run(4)
    assert said == [
        "1: the judge has failed: the goal's solved must be a number, but '1 / (time_s < 2) > 5' has none at 2.0 s: "
        "division by zero."
    ]


def test_what_is_wrong_is_said_before_the_run_in_one_line() -> None:
    for text, message in (
        ("measure > 0", "must name measures, but 'measure' is none"),
        ("contacts(3) > 0", "must use contacts without arguments, but it was 'contacts(3)'"),
        (
            "goal_mm(1) < 3",
            "must use goal_mm as its reference says, but 'goal_mm(1)': goal_mm() missing a required argument",
        ),
        ("goal_mm('a', 1) < 3", "the goal's solved x_mm must be a number, but it was 'a'"),
        ("goal_mm(" + "9" * 900 + ", 1) < 3", "the goal's solved x_mm must be"),
        ("wall_following('up') > 1", "side must be 'left' or 'right', but it was 'up'"),
        ("contacts(robot=3) > 0", "robot must be the number of an existing robot, but it was 3"),
        ("contacts(robot='a') > 0", "robot must be the number of an existing robot, but it was 'a'"),
        ("score(1.5) > 1", "must use score as in 'score(\"laps\")', but it was 'score(1.5)'"),
        ("score", "must use score as in"),
        ("score('laps') > 3", "the goal must use numbers of the score, but 'laps' is 'many'"),
        ("wall_mm(3) < 5", "must use wall_mm as in 'wall_mm', but it was 'wall_mm(3)'"),
        ("held_s(time) > 3", "must name measures, but 'time' is none. Did you mean 'time_s'?"),
        ("1 / contacts > 2", "must be a number, but '1 / contacts > 2' has none at 0.0 s: float division by zero"),
        ("min() > 2", "must be a number, but 'min() > 2' has none at 0.0 s"),
        ("60 - reached_s(9, 9)", "has none at 0.0 s: it is -inf, as what is not reached is infinite."),
        ("light_mm - light_mm", "has none at 0.0 s: it is nan, as what is not reached is infinite. Add 'if is_solved"),
        ("round(light_mm - light_mm, light_mm)", "the goal's solved must be a number"),
        *(
            (f"{name} < 9", f"must ask for what is there, but '{name}' is about {each}")
            for name, each in ABSENT.items()
        ),
    ):
        unlit = () if text.split()[0] in ABSENT else (Lamp(*LAMP_MM, is_on=False),)
        sim = Simulation(replace(Arena.box(500, 500), lamps=unlit), seed=1)
        sim.set_score("laps", "many")
        with pytest.raises(ParameterError) as caught:
            Judge(sim, Goal(solved=text))
        assert message in str(caught.value)
        assert "\n" not in str(caught.value)
        assert len(str(caught.value)) < 500


def test_what_was_never_reached_is_infinite_and_what_holds_before_anything_moved_is_doubted() -> None:
    """A robot that stands still beside a lamp that does not burn solves nothing that a sentence says."""
    arena = replace(Arena.box(500, 400), lamps=(Lamp(60, 60, is_on=False),), starts=(Pose(60, 60, 0.0),))
    for text, is_true_at_once in (
        ("reached_s(400, 300) < 30", False),
        ("reached_s(400, 300) < 30 or reached_s(400, 300, radius_mm=20) < 30", False),
        ("max(reached_s(400, 300), reached_s(60, 60)) < 30", False),
        ("light_mm < 80", False),
        ("time_s - reached_s(400, 300) > 5", False),
        ("held_s(reached_s(400, 300) < 30) > 1", False),
        ("reached_s(400, 300, missed_s=9) < 30", True),
        ("reached_s(60, 60) < 30", True),
        ("contacts == 0", True),
    ):
        for name in ("solved", "failed"):
            sim = Simulation(arena, seed=1)
            supervision = Supervision(sim, goal=Goal(**{name: text}))
            sentence = f"the goal's {name}, {text!r}, is true before anything has moved."
            assert supervision.doubts == (sentence,) * is_true_at_once
            sim.run(3)
            assert (supervision.judge.judgement is not None) is is_true_at_once, text


def test_a_goal_may_ask_for_what_its_supervisor_puts_in_and_counts(tmp_path: Path) -> None:
    goal = Goal(solved="spread_mm < 9 and held_s(score('laps') > 3) > 1")
    with pytest.raises(ParameterError, match=r"score\('laps'\) is counted by none\. Name the supervisor"):
        supervised(goal, tmp_path)
    supervised(goal, tmp_path, COUNTS_LAPS.replace("while", "sim.add_ball(99, 99)\n    while"))
    with pytest.raises(ParameterError, match="'spread_mm' is about a ball or a cylinder"):
        supervised(goal, tmp_path, COUNTS_LAPS)


def test_measures_are_the_same_for_each_kind_of_robot_and_sensors_are_its_own() -> None:
    """An e-puck drives 8 mm/s with 62.1 steps/s, and has 3600 counts of light where a Khepera has 450."""
    sim = Simulation(Arena.box(500, 500), robot=["epuck", "khepera"], robots=2, seed=1)
    kiks.EPuck(sim.port(1)).set_speed(310.5, 310.5)
    kiks.Khepera(sim.port(2)).set_speed(5, 5)
    for robot, counts in ((1, 3000), (2, 400)):
        formula = f"light(0) > {counts} and abs(speed_pulses - 5) < 0.1 and time_s > 1"
        judge = Judge(sim, Goal(robot=robot, solved=formula))
        for wait_s in judge.supervise(sim):
            sim.run(wait_s)
            assert sim.time_s < 3
        assert str(judge.judgement).startswith("solved")


def test_a_robot_that_is_asked_for_more_than_it_can_do_counts_as_fast_as_it_can() -> None:
    """An e-puck clamps 32,767 steps/s to 1000, which are 16.1 of a Khepera's pulses/10 ms."""
    sim = Simulation(Arena.box(1000, 1000), robot="epuck", seed=1)
    kiks.EPuck(sim.port(1)).set_speed(32767, 32767)
    judge = Judge(sim, Goal(solved="time_s > 0.5", points="speed_pulses"))
    for wait_s in judge.supervise(sim):
        sim.run(wait_s)
    assert 15.0 < judge.judgement.points < 16.2


# ---- what a run leaves ----

GAME = """
kiks = 1
seconds = 8.0
[goal]
text = "Drive 200 mm"
solved = "path_mm > 200"
points = "10 if is_solved else round(path_mm / 20, 1)"
[[start]]
at_mm = [100, 250]
heading_deg = 0
[walls]
size_mm = [500, 500]
"""

DRIVES = """
import serial, sys, time
port = serial.Serial("/dev/ttyUSB0", 9600)
port.write(b"D,%s,%s\\n" % (sys.argv[1].encode(), sys.argv[1].encode()))
time.sleep(float(sys.argv[2]))
"""


def test_kiks_run_tells_and_records_the_same_judgement(tmp_path: Path) -> None:
    (tmp_path / "game.kiks").write_text(GAME)
    (tmp_path / "drives.py").write_text(DRIVES)
    for words, goal in (
        (("10", "60"), {"is_solved": True, "is_failed": False, "points": 10, "time_s": 2.6}),
        (("1", "60"), {"is_solved": False, "is_failed": False, "points": 3.2, "time_s": 8.0}),
        (("1", "2"), {"is_solved": False, "is_failed": False, "points": 0.8, "time_s": 2.0}),
    ):
        result = forked.run("run", "--json", "--record", "run.mcap", "game.kiks", "drives.py", *words, cwd=tmp_path)
        assert result.returncode == 0, result.stderr
        told = json.loads(result.stdout)["goal"]
        assert told == pytest.approx(goal, abs=0.06)
        line = f"Goal {'solved' if goal['is_solved'] else 'not solved'} after {told['time_s']:.1f} s"
        assert line in result.stderr
        with kiks.Recording(tmp_path / "run.mcap") as recording:
            end = recording.world_at(recording.duration_s)
            assert end.score["points"] == told["points"]
            assert str(end.score["result"]).endswith(f"solved after {told['time_s']:.1f} s")
            # Another judge sees the same when the run is made again.
            replay = recording.replay(0)
            judge = Judge(replay.sim, Project.load(tmp_path / "game.kiks").goal)
            for wait_s in judge.supervise(replay.sim):
                if replay.sim.time_s + wait_s > recording.duration_s:
                    break
                replay.go_to(round(1e9 * (replay.sim.time_s + wait_s)))
            assert vars(judge.end()) == pytest.approx(told, abs=0.1)

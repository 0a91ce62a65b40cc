"""A page judges a run as Python does, by the measures of the engine in its memory."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.at_length import share
from tests.desk.worlds_in_node import ask_about, image_of, node, random_simulation

from kiks import Simulation
from kiks.control.observed_measures import LOOKED_AT, NOTE_COUNT
from kiks.model.formula import Formula
from kiks.model.goal import Goal
from kiks.sim.judge import LOOK_S, Judge

JUDGE = """
import { Judge, LOOK_S } from "./judge.js";

printEach((world, { goals, measures, look_count }) => {
  const judges = goals.map((goal) => new Judge(world, world.scene, goal, measures)), points = [];
  for (let k = 0; k < look_count; k++) {
    const time_ns = world.time_ns + 1e9 * LOOK_S, begun = Math.ceil(time_ns / 1e7);
    engine.call("advance", world.record, world.tick, begun - world.tick);
    Object.assign(world, { time_ns, tick: begun });
    judges.filter(({ judgement }) => !judgement).forEach((judge) => judge.look(world));
    points.push(judges.map((judge) => (judge.judgement ?? judge).points));
  }
  judges.forEach((judge) => judge.end(world));
  return [judges.map(({ judgement, unknown }) => [judgement, unknown]), points];
});
"""

COMPUTE = """
import { readFileSync } from "node:fs";
import { valueOf } from "./judge.js";

const { formulas, values } = JSON.parse(readFileSync("formulas.json", "utf-8"));
console.log(JSON.stringify(formulas.map((formula) => Number(valueOf(formula, (k) => values[k])))));
"""

MEASURES = {"names": [each.name for each in LOOKED_AT], "note_count": NOTE_COUNT}


def goals_of(sim: Simulation, rng: np.random.Generator) -> list[Goal]:
    """Return goals that name each measure, sensor and timer that a page knows, if the world has what it is about."""
    robot = int(rng.integers(sim.robot_count)) + 1
    has = {
        "another robot": sim.robot_count > 1,
        "a ball or a cylinder": len(sim.bodies()) > 0,
        "a lamp": len(sim.lamps),
    }
    names = [each.name for each in LOOKED_AT if has.get(each.needs, True)]
    points = [
        *names,
        "wall_mm",
        "proximity(2)",
        "light(5)",
        "held_s(contacts == 0)",
        "total_s(path_mm > 20 or wall_mm < 9)",
    ]
    counted = [Goal(points=f"min({name}, 1e9)", robot=robot) for name in points]
    return [
        *counted,
        Goal(solved="path_mm(robot=1) > 60", points="20 - time_s if is_solved else 0", robot=robot),
        Goal(solved="is_over and held_s(wall_mm < 60) > 0.5", failed="contacts > 1", points="10 * is_solved + is_over"),
    ]


@pytest.mark.slow
def test_the_page_judges_as_python_does(tmp_path: Path) -> None:
    worlds, expected, rng, look_count = [], [], np.random.default_rng(2), 30
    for _ in range(share(6, 30)):
        sim = random_simulation(rng)
        goals = goals_of(sim, rng)
        asked = {"goals": [goal.as_lists() for goal in goals], "measures": MEASURES, "look_count": look_count}
        worlds.append(image_of(sim) | {"asked": asked})
        judges = [Judge(sim, goal) for goal in goals]
        looks = [judge.supervise(sim) for judge in judges]
        points: list[Any] = []
        for look in looks:
            next(look)
        for _ in range(look_count):
            sim.run(LOOK_S)
            for look in looks:
                next(look, None)
            points.append([it.points if (it := judge.judgement) else judge._number("points") for judge in judges])
        made = [judge.end() for judge in judges]
        expected.append(
            [
                [
                    [{"isSolved": it.is_solved, "isFailed": it.is_failed, "points": it.points, "time_s": it.time_s}, []]
                    for it in made
                ],
                points,
            ]
        )
    assert ask_about(worlds, JUDGE, tmp_path) == expected


def test_a_page_says_what_it_does_not_know(tmp_path: Path) -> None:
    sim = random_simulation(np.random.default_rng(1))
    goal = Goal(solved="goal_mm(80, 90) < 50 and held_s(score('laps') > 2) > 1", points="coverage() + proximity(2)")
    asked = {"goals": [goal.as_lists()], "measures": MEASURES, "look_count": 0}
    ((((_, unknown),), _),) = ask_about(
        [image_of(sim) | {"asked": asked}], JUDGE.replace("judge.end(world)", "0"), tmp_path
    )
    assert sorted(unknown) == ["coverage", "goal_mm(80, 90)", "score('laps')"]


def test_a_page_computes_formulas_as_python_does(tmp_path: Path) -> None:
    values, rng = [0.0, 2.5, -3.0, 7.0, 0.125], np.random.default_rng(4)
    names = ["a", "b", "c", "d", "e"]

    def text(depth: int) -> str:
        if depth == 0:
            return str(rng.choice([*names, "2", "0.5", "True", "1e3"]))
        one, two, three = (text(depth - 1) for _ in range(3))
        forms = [
            *("({0} + {1})", "({0} - {1})", "({0} * {1})", "({0} / (1 + {1} * {1}))", "(not {0})", "(-{0})", "(+{0})"),
            *(
                "({0} and {1})",
                "({0} or {1} or {2})",
                "({0} < {1} <= {2})",
                "({0} == {1})",
                "({0} != {1})",
                "({0} >= {1} > {2})",
            ),
            *(
                "({0} if {1} else {2})",
                "min({0}, {1}, {2})",
                "max({0}, {1})",
                "abs({0})",
                "round({0})",
                "round({0}, 2)",
            ),
        ]
        return str(rng.choice(forms)).format(one, two, three)

    formulas = [Formula(text(int(rng.integers(1, 4)))) for _ in range(500)]
    terms = Formula(" + ".join(names)).terms
    wanted = [float(each.value([values[terms.index(term)] for term in each.terms])) for each in formulas]
    lists = [each.as_lists(terms) for each in formulas]
    (tmp_path / "formulas.json").write_text(json.dumps({"formulas": lists, "values": values}), "utf-8")
    assert node(COMPUTE, tmp_path) == wanted

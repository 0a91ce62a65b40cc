"""Floreano and Mondada (1996): a robot learns to come back to a charging zone.

The figure: fitness, a life of the best robot with its battery, and what its hidden units do where.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from findings import AMOUNT, SHARE, Finding, command, draw_generations, evolved

import kiks
from kiks.export.figures import column_figure, draw_paths
from kiks.model.ranges import seeds_in

TASK = kiks.tasks.floreano_mondada_1996()
ACTIONS, CHARGES = TASK.measures[1:3]
ACTION_S, LIFE_ACTIONS, FULL_ACTIONS = TASK.timings[0].period_s, 150, 50  # of the longest life, of a full battery
HIDDEN, USED = 5, 5  # hidden units; where the controller's memory has what the battery has lost

LIVES = 32
FRESH_SEED = 1_000_000  # of these lives; evolutions do not come near it
HEADINGS_DEG, LOST = (0, 90, 180, 270), {"full battery": 0.0, "a tenth left": 0.9}
GRID_MM, SETTLED = 17, 8  # step of the map, and actions after which the context has settled


def lives(champion: Any, arena: Any) -> Any:
    """Return actions and charges of fresh lives, float64 [life, 2]."""
    batch = kiks.Batch(arena, LIVES, seed=FRESH_SEED, timing=champion.timing)
    ends = {"seconds": LIFE_ACTIONS * ACTION_S, "until": TASK.until}
    return batch.run(champion.controller, champion.parameters, measures=[ACTIONS, CHARGES], **ends).values[:, 0]


def life(champion: Any, arena: Any, seed: int) -> tuple[Any, Any]:
    """Return the path of a robot in a life, float64 [action, 3], and the charge after each action as a share."""
    decide, parameters = champion.controller, np.array(champion.parameters)
    batch = kiks.Batch(arena, 1, seed=seed, timing=champion.timing, senses=decide.senses)
    memory, wheels, readings = np.zeros(decide.memory_count), np.zeros(2), batch.reset()
    path, charge = [batch.poses[0, 0]], [1.0]
    while len(charge) <= LIFE_ACTIONS and charge[-1] > 1e-9:
        decide(readings[0, 0], memory, parameters, wheels)
        readings = batch.step(wheels[None, None])
        path.append(batch.poses[0, 0])
        charge.append(1.0 - memory[USED])
    return np.array(path), np.array(charge)


def activations(champion: Any, arena: Any) -> Any:
    """Return the hidden units everywhere, float64 [battery, unit, heading, row, column]; NaN in walls."""
    x_mm, y_mm = (np.arange(50, side_mm - 49, GRID_MM) for side_mm in (arena.width_mm, arena.height_mm))
    poses = np.array([(x, y, np.radians(turn)) for turn in HEADINGS_DEG for y in y_mm for x in x_mm])
    decide, parameters = champion.controller, np.array(champion.parameters)
    robot = kiks.RobotSpec.load("khepera").without_noise()
    batch = kiks.Batch(arena, len(poses), robot=robot, starts=poses[:, None], senses=decide.senses)
    found = np.zeros((len(LOST), len(poses), HIDDEN))
    for place, readings in enumerate(batch.reset()[:, 0]):
        for number, lost in enumerate(LOST.values()):
            memory = np.zeros(decide.memory_count)
            for _ in range(SETTLED):
                memory[USED] = lost - 1.0 / FULL_ACTIONS
                decide(readings, memory, parameters, np.zeros(2))
            found[number, place] = memory[:HIDDEN]
    shape = len(LOST), len(HEADINGS_DEG), len(y_mm), len(x_mm), HIDDEN
    return np.moveaxis(found.reshape(shape), -1, 1)


def draw_activations(axes: Any, maps: Any) -> None:
    """Draw a row for each hidden unit: four headings with a full battery, and four with an empty one."""
    batteries, units, headings, rows, columns = maps.shape
    gap, apart = 3, 8
    high, wide = rows + gap, columns + gap
    sheet = np.full((units * high, batteries * (headings * wide + apart)), np.nan)
    middles = []
    for unit in range(units):
        for battery in range(batteries):
            for heading in range(headings):
                left, low = battery * (headings * wide + apart) + heading * wide, (units - 1 - unit) * high
                sheet[low : low + rows, left : left + columns] = maps[battery, unit, heading]
                middles += [left + columns / 2] if unit == 0 else []
    shown = axes.imshow(sheet, origin="lower", cmap="RdBu_r", vmin=-1, vmax=1, aspect="equal")
    axes.set_yticks([(units - 1 - unit) * high + rows / 2 for unit in range(units)], range(1, units + 1))
    axes.set_xticks(middles, list("\N{RIGHTWARDS ARROW}\N{UPWARDS ARROW}\N{LEFTWARDS ARROW}\N{DOWNWARDS ARROW}") * 2)
    for number, name in enumerate(LOST):
        axes.text((number + 0.5) * (headings * wide + apart) - apart, units * high, name, ha="center", va="bottom")
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set(xlabel="heading", ylabel="hidden unit")
    axes.figure.colorbar(shown, ax=axes, ticks=(-1, 0, 1), shrink=0.6, aspect=14, pad=0.02)


def main(
    seeds: str = "1-10",
    out: Path = Path("floreano_mondada_1996.pdf"),
    generations: int = 240,
    population: int = 100,
) -> list[Finding]:
    """Evolve robots that recharge for several seeds, draw what the best one does, and compare with the paper."""
    evolutions = evolved(TASK, seeds_in(seeds), generations=generations, population=population)
    return found(evolutions, out)


def found(evolutions: Any, out: Path) -> list[Finding]:
    """Draw the figure of some evolutions, and return what comes out."""
    arena = evolutions[0].task.arenas[0]
    champions = [each.champion for each in evolutions]
    lit, dark = ([lives(each, place) for each in champions] for place in (arena, replace(arena, lamps=())))
    best = champions[int(np.argmax([each[:, 0].mean() + each[:, 1].mean() for each in lit]))]
    path, charge = life(best, arena, FRESH_SEED + LIVES)
    arrivals = [_left_on_arrival(each, arena) for each in champions]

    rows = [1.0, 1.6, 0.6, 1.5]
    with column_figure(out, 200, nrows=4, height_ratios=rows) as (above, way, level, maps):
        draw_generations(above, evolutions)
        above.set(ylim=(0, 1.25 * above.get_ylim()[1]))
        above.legend(loc="upper left", ncols=2)
        draw_paths(way, arena, [path])
        way.set_title(f"a life of the best robot: {len(charge) - 1} actions")
        level.plot(ACTION_S * np.arange(len(charge)), charge)
        level.set(xlabel="time [s]", ylabel="charge", ylim=(0, 1.05), xlim=(0, ACTION_S * LIFE_ACTIONS))
        draw_activations(maps, activations(best, arena))

    last = [each.generations[-1].fitness for each in evolutions]
    full = [float((each[:, 0] >= LIFE_ACTIONS - 1).mean()) for each in lit]
    return [
        Finding("parameters", "102 (secondary)", str(evolutions[0].task.parameter_count)),
        Finding("fitness of the last generation, best", "not recovered", [each.max() for each in last], 3),
        Finding("fitness of the last generation, mean", "not recovered", [each.mean() for each in last], 3),
        Finding("actions in a fresh life, of 150", "", [each[:, 0].mean() for each in lit], 1, (0, LIFE_ACTIONS)),
        Finding("share of fresh lives that last to the end", "", full, within=SHARE),
        Finding(
            "visits of the zone in a life",
            "returns repeatedly (usually quoted)",
            [each[:, 1].mean() for each in lit],
            within=AMOUNT,
        ),
        Finding("charge left on arrival", "usually quoted as about 0.1", arrivals, within=SHARE),
        Finding(
            "visits with the lamp off",
            "misses it (usually quoted)",
            [each[:, 1].mean() for each in dark],
            within=AMOUNT,
        ),
    ]


def _left_on_arrival(champion: Any, arena: Any) -> float:
    """Return the mean charge when a robot comes to the zone; that at the end of its lives if it never does."""
    left = []
    for seed in range(4):
        charge = life(champion, arena, FRESH_SEED + seed)[1]
        came = np.flatnonzero((charge[1:] == 1.0) & (charge[:-1] < 1.0))
        left += charge[came].tolist() or [charge[-1]]
    return float(np.mean(left))


if __name__ == "__main__":
    command(main)

"""Learn to avoid obstacles or to follow walls by reward, take the exam of the task, and drive on a serial line.

pip install 'kiks[learn]'
python examples/learning/pgpe.py Avoid --seed 1
python examples/learning/pgpe.py Follow --seed 1

PGPE (policy gradients with parameter-based exploration: Sehnke et al., Parameter-exploring policy gradients, Neural
Networks 23, 2010) draws policies around a mean, always two opposite ones, and lets each pair drive the same episode.
The differences of their returns say where the mean goes. Policies explore without noise in their actions, as in the
exam, and what counts is the return of a whole episode. So neither the memory of a policy nor that of a reward is in the
way, and no network has to estimate returns.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import kiks
from kiks.learn.environments import exploring, find_environment, without_contacts
from kiks.learn.gymnasium_envs import KheperaVectorEnv

Floats = NDArray[np.float64]

PAIRS, GENERATIONS = 64, {"Avoid": 80, "Follow": 160}
"""Pairs of opposite policies in a generation, and generations."""

EPISODE_S = 60.0
"""Time of an episode [s], unless a contact ends it before."""

REWARDS = {"Avoid": exploring, "Follow": kiks.measures.wall_following("left")}
CONTACT_COST = 20.0
"""What is rewarded, and what the contact takes off that ends an episode."""

DEVIATIONS = {"Avoid": (0.8, 0.15), "Follow": (0.5, 0.15)}
"""Standard deviation of the policies around their mean in the first generation, and in the last one."""

STEP = 0.25
"""Length of a step of the mean in each parameter, as a share of the deviation, if all steps so far agree."""

SENSOR_GAIN = 4.0
"""How much more the weights of sensors differ than others: most readings are small shares of 1023."""

TRACE_S = 2.0
"""Time after which a trace has forgotten most of what a sensor has shown [s]."""

SENSORS, WHEELS = 8, 2
INPUTS = 1 + 2 * SENSORS + WHEELS
"""A one, the sensors, their traces, and the last outputs."""

USED = {"Avoid": INPUTS - WHEELS, "Follow": INPUTS}
"""How many of the inputs have weights that are learnt; those of the others are 0."""

CHECK_EVERY, STARTS_PER_ARENA = 10, 20
"""Generations from one trial exam to the next, and its starts in each arena of training."""

ATTEMPTS, GOOD_SHARE = {"Avoid": 1, "Follow": 3}, 0.9
"""Most attempts from new policies, and the share of trial starts that one must have solved after half of its time."""


@kiks.controller(memory=SENSORS + WHEELS, parameters=2 + WHEELS * INPUTS)
def tracing(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Drive by weighted sums of the sensors, their traces and the last outputs: memory of when a wall was there.

    Parameters: the speed of an output of 1 [pulses/10 ms], the share of a trace that a step renews, then the weights,
    [input, wheel].
    """
    for wheel in range(WHEELS):
        total = parameters[2 + wheel]
        for k in range(SENSORS):
            total += parameters[4 + 2 * k + wheel] * (sensors[k] / 1023)
            total += parameters[4 + 2 * (SENSORS + k) + wheel] * memory[k]
        for k in range(WHEELS):
            total += parameters[4 + 2 * (2 * SENSORS + k) + wheel] * memory[SENSORS + k]
        wheels[wheel] = total
    for wheel in range(WHEELS):
        memory[SENSORS + wheel] = np.tanh(wheels[wheel])
        wheels[wheel] = parameters[0] * memory[SENSORS + wheel]
    for k in range(SENSORS):
        memory[k] += parameters[1] * (sensors[k] / 1023 - memory[k])


def acting(weights: Floats, share: float) -> Callable[[NDArray[np.float32]], Floats]:
    """Return what `tracing` does in many worlds: observations [world, sensor] become actions [world, wheel].

    Args:
        weights: The weights of the first inputs of each world, [world, input, wheel].
        share: The share of a trace that a step renews.
    """
    world_count, used, _ = weights.shape
    ones = np.ones((world_count, 1))
    traces, actions = np.zeros((world_count, SENSORS)), np.zeros((world_count, WHEELS))

    def act(seen: NDArray[np.float32]) -> Floats:
        nonlocal traces, actions
        inputs = np.concatenate([ones, seen, traces, actions], axis=1)[:, :used]
        traces = traces + share * (seen - traces)
        actions = np.tanh(np.matmul(inputs[:, None], weights)[:, 0])
        return actions

    return act


def returns_of(envs: KheperaVectorEnv, weights: Floats, seeds: list[int], share: float) -> Floats:
    """Return the sum of rewards of an episode of each world, float64 [world]."""
    act = acting(weights, share)
    seen, _ = envs.reset(seed=seeds)
    returns, is_over = np.zeros(len(seeds)), np.zeros(len(seeds), np.bool_)
    for _ in range(round(EPISODE_S / envs.episodes.task.timings[0].period_s)):
        seen, rewards, terminations, _, _ = envs.step(act(seen).astype(np.float32))
        returns += np.where(is_over, 0.0, rewards)
        is_over |= terminations
        if is_over.all():
            break
    return returns


def learn(name: str, seed: int, generations: int, pairs: int = PAIRS) -> kiks.Champion:
    """Return the policy that did best in trial exams, as a champion.

    Args:
        name: 'Avoid' or 'Follow'.
        seed: Seed of the policies and of the episodes.
        generations: Number of generations.
        pairs: Number of pairs of policies in each.
    """
    task = find_environment(name)
    task = task.with_changes(
        reward=without_contacts(REWARDS[name], CONTACT_COST),
        until=kiks.measures.contacts,
    )
    envs = KheperaVectorEnv(2 * pairs, task)
    share = task.timings[0].period_s / TRACE_S
    used = USED[name]
    gains = np.ones((used, 1))
    gains[1 : 1 + 2 * SENSORS] = SENSOR_GAIN
    rng = np.random.default_rng(seed)
    first, last = DEVIATIONS[name]
    assert task.exam is not None
    trial = task.exam.with_changes(arenas=task.arenas, worlds=STARTS_PER_ARENA * len(task.arenas))
    best, best_score = None, (-1, 0.0)
    for attempt in range(ATTEMPTS[name]):
        mean, slope, square = (np.zeros((used, WHEELS)) for _ in range(3))
        for generation in range(generations):
            deviation = first * (last / first) ** (generation / max(generations - 1, 1))
            drawn = deviation * rng.standard_normal((pairs, used, WHEELS))
            seeds = rng.integers(2**40, size=pairs).tolist()
            returns = returns_of(envs, gains * np.concatenate([mean + drawn, mean - drawn]), 2 * seeds, share)
            gained = returns[:pairs] - returns[pairs:]
            gained /= np.sqrt(np.mean(gained**2)) + 1e-9
            # The step is that of Adam (Kingma and Ba, Adam: a method for stochastic optimization, 2015, algorithm 1).
            gradient = np.tensordot(gained, drawn, axes=1) / (deviation * np.sqrt(pairs))
            slope, square = 0.8 * slope + 0.2 * gradient, 0.98 * square + 0.02 * gradient**2
            done = generation + 1
            step = slope / (1 - 0.8**done) / (np.sqrt(square / (1 - 0.98**done)) + 1e-8)
            mean += STEP * deviation * step
            if done % CHECK_EVERY == 0 or done == generations:
                weights = np.zeros((INPUTS, WHEELS))
                weights[:used] = gains * mean
                parameters = (task.speed_limit, share, *weights.ravel().tolist())
                champion = kiks.Champion(tracing, parameters, task=name, timing=task.timings[0], algorithm="PGPE")
                result = trial.examine(champion)
                contacts = result.values[:, result.measures.index("contacts")].mean()
                score = int(result.solved.sum()), -float(contacts)
                solved = f"trial starts solved: {score[0]} of {trial.worlds}"
                print(f"generation {done}: return {returns.mean():.1f}, {solved}", flush=True)
                if score >= best_score:
                    best, best_score = champion, score
            is_poor = done == generations // 2 and best_score[0] < GOOD_SHARE * trial.worlds
            if is_poor and attempt + 1 < ATTEMPTS[name]:
                print("begin again", flush=True)
                break
        else:
            break
    assert best is not None
    return best


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("task", choices=tuple(DEVIATIONS), help="what to learn")
    options.add_argument("--seed", type=int, default=1, help="seed of the policies and of the episodes")
    options.add_argument("--generations", type=int, help="number of generations; left out, 80 or 160")
    options.add_argument("--save", help="name of the champion's file; left out, that of the task")
    options.add_argument("--port", help="drive the robot on this serial port for a minute, for example /dev/ttyUSB0")
    given = options.parse_args()

    begin_s = time.process_time()
    champion = learn(given.task, given.seed, given.generations or GENERATIONS[given.task])
    task = find_environment(given.task)
    assert task.exam is not None
    print(f"{time.process_time() - begin_s:.0f} s of processor time")
    print(task.exam.examine(champion))
    champion.save(given.save or f"{given.task.lower()}.toml")
    sim, ports = champion.simulation(task.arenas[0], seed=1)
    loops = champion.drive(given.port or ports, seconds=60)
    print(f"on the wire: {loops} loops" + ("" if given.port else f", state {sim.state_hash()}"))


if __name__ == "__main__":
    main()

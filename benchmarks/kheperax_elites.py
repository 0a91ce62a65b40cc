"""MAP-Elites in Kheperax's own maze, for `benchmarks/evolve.py`: in an environment of its own, prints a JSON object.

The settings are those of its example `examples/main/me_training.py` (Kheperax 0.2.0): 250 steps, three lasers, a
network with eight hidden units, and QDax's variation with a deviation of 0.2 in all directions and none along lines.
Population, number of evaluations and cells are given. Run: python kheperax_elites.py SEED POPULATION EVALUATIONS CELLS
"""

from __future__ import annotations

import functools
import json
import sys
import time

import jax
import jax.numpy as jnp
from kheperax.tasks.config import KheperaxConfig
from kheperax.tasks.main import KheperaxTask
from qdax.core.containers.mapelites_repertoire import compute_euclidean_centroids
from qdax.core.emitters.mutation_operators import isoline_variation
from qdax.core.emitters.standard_emitters import MixingEmitter
from qdax.core.map_elites import MAPElites
from qdax.utils.metrics import default_qd_metrics

STEPS = 250


def main(seed: int, population: int, evaluations: int, cells: int) -> None:
    key, task_key, first_key = jax.random.split(jax.random.PRNGKey(seed), 3)
    config = KheperaxConfig.get_default()
    config.episode_length = STEPS
    config.robot = config.robot.replace(lasers_return_minus_one_if_out_of_range=True)
    environment, policy, score = KheperaxTask.create_default_task(config, random_key=task_key)
    keys = jax.random.split(first_key, population)
    first = jax.vmap(policy.init)(keys, jnp.zeros((population, environment.observation_size)))
    emitter = MixingEmitter(
        mutation_fn=lambda x, y: (x, y),
        variation_fn=functools.partial(isoline_variation, iso_sigma=0.2, line_sigma=0.0),
        variation_percentage=1.0,
        batch_size=population,
    )
    metrics = functools.partial(default_qd_metrics, qd_offset=0.0)
    elites = MAPElites(scoring_function=score, emitter=emitter, metrics_function=metrics)
    low, high = environment.behavior_descriptor_limits
    centroids = compute_euclidean_centroids(grid_shape=(cells, cells), minval=low, maxval=high)
    repertoire, state, key = elites.init(first, centroids, key)
    update = jax.jit(elites.update)
    evaluated, cpu_s = population, time.process_time()
    while evaluated < evaluations:
        repertoire, state, _, key = update(repertoire, state, key)
        evaluated += population
    filled = int((repertoire.fitnesses > -jnp.inf).sum())
    cpu_s = time.process_time() - cpu_s
    print(json.dumps({"coverage": filled / cells**2, "evaluations": evaluated, "cpu_s": cpu_s}))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))

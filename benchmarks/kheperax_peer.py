"""How fast Kheperax steps, for `benchmarks/batch.py`: run in an environment of its own, prints one JSON object.

The workload is W2: its standard maze, 8 lasers, its own MLP policy with 8 hidden units and random weights, 250 steps
from the default start; resets and compilation are not timed. Run: python kheperax_peer.py WORLDS
"""

from __future__ import annotations

import json
import statistics
import sys
import time

import jax
import jax.numpy as jnp
from kheperax.simu.robot import Robot
from kheperax.tasks.config import KheperaxConfig
from kheperax.tasks.main import KheperaxTask

STEPS, WINDOWS = 250, 7
LASER_ANGLES = (1.5708, 0.7854, 0.1745, -0.1745, -0.7854, -1.5708, -2.9671, 2.9671)


def main(world_count: int) -> None:
    config = KheperaxConfig.get_default()
    config.robot = Robot.create_default_robot().replace(laser_angles=jnp.array(LASER_ANGLES))
    environment, policy, _ = KheperaxTask.create_default_task(config, jax.random.PRNGKey(0))
    keys = jax.random.split(jax.random.PRNGKey(7), world_count)
    weights = jax.vmap(policy.init, (0, None))(keys, jnp.zeros(environment.observation_size))
    states = jax.jit(jax.vmap(environment.reset))(jax.random.split(jax.random.PRNGKey(3), world_count))

    def roll_out(state, weight):
        def step(state, _):
            state = environment.step(state, policy.apply(weight, state.obs))
            return state, state.reward

        state, rewards = jax.lax.scan(step, state, None, STEPS)
        return state.robot.posture, rewards.sum()

    run = jax.jit(jax.vmap(roll_out))
    jax.block_until_ready(run(states, weights))
    rates, wall_rates = [], []
    for _ in range(WINDOWS):
        cpu_s, wall_s = time.process_time(), time.perf_counter()
        jax.block_until_ready(run(states, weights))
        cpu_s, wall_s = time.process_time() - cpu_s, time.perf_counter() - wall_s
        rates.append(world_count * STEPS / cpu_s)
        wall_rates.append(world_count * STEPS / wall_s)
    print(
        json.dumps(
            {
                "steps_per_cpu_s": statistics.median(rates),
                "steps_per_s": statistics.median(wall_rates),
                "jax": jax.__version__,
            }
        )
    )


if __name__ == "__main__":
    main(int(sys.argv[1]))

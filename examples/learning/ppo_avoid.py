"""Learn to avoid obstacles by PPO in 96 worlds at once, then drive a robot on a serial line with the policy.

pip install 'kiks[learn]' stable-baselines3
python examples/learning/ppo_avoid.py

The policy learns in the arenas of the task `avoid` and takes its exam in others. Its network becomes a champion that
needs no PyTorch: in a batch, in a simulation and on a real robot.
"""

from __future__ import annotations

import argparse
from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv

import kiks
import kiks.learn.gymnasium_envs
from kiks.learn.environments import without_contacts

HIDDEN = (16, 16)
WORLDS = 96
EPISODE_STEPS = 300

SPEED_LIMIT = 8.0
"""Highest speed [pulses/10 ms]: 64 mm/s, as in the task."""

CONTACT_COST = 20.0
"""What a contact takes off the reward: the exam allows none, and the reward of Floreano and Mondada counts none."""


class Sb3VecEnv(VecEnv):
    """Adapts a vector environment of Gymnasium to Stable-Baselines3, which clips the actions.

    Args:
        envs: The environment; its worlds must reset in the step in which they end (`SAME_STEP`).
    """

    def __init__(self, envs: gymnasium.vector.VectorEnv) -> None:
        self.envs = envs
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def reset(self) -> Any:
        return self.envs.reset(seed=self._seeds[0])[0]

    def step_async(self, actions: Any) -> None:
        self.actions = actions

    def step_wait(self) -> Any:
        seen, rewards, terminations, truncations, infos = self.envs.step(self.actions)
        step_infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for k in np.flatnonzero(infos.get("_final_obs", ())):
            step_infos[k] = {
                "terminal_observation": infos["final_obs"][k],
                "TimeLimit.truncated": bool(truncations[k] and not terminations[k]),
            }
        return seen, rewards.astype(np.float32), terminations | truncations, step_infos

    def close(self) -> None:
        self.envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [getattr(self.envs, attr_name)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        setattr(self.envs, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        raise NotImplementedError("the worlds are one object: they have no methods of their own")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        return [False] * self.num_envs


def main() -> None:
    torch.set_num_threads(1)  # the networks are small: more threads are slower
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--steps", type=int, default=900_000, help="steps of all worlds together")
    options.add_argument("--seed", type=int, default=1, help="seed of weights, exploration and episodes")
    options.add_argument("--save", default="ppo_avoid", help="name of the files, without suffix")
    options.add_argument("--port", help="drive the robot on this serial port for a minute, for example /dev/ttyUSB0")
    given = options.parse_args()

    task = kiks.tasks.avoid()
    envs = gymnasium.make_vec(
        "kiks/Avoid-v0",
        num_envs=WORLDS,
        max_episode_steps=EPISODE_STEPS,
        autoreset_mode="SameStep",
        arenas=task.arenas,
        reward=without_contacts(kiks.measures.avoidance, CONTACT_COST),
        controller=kiks.controllers.linear(speed_limit=SPEED_LIMIT),
    )
    model = PPO(
        "MlpPolicy",
        Sb3VecEnv(envs),
        n_steps=64,
        batch_size=1536,
        n_epochs=10,
        learning_rate=lambda share_left: 1.5e-3 * share_left,
        gamma=0.97,
        policy_kwargs={"net_arch": {"pi": HIDDEN, "vf": (64, 64)}, "log_std_init": -0.5},
        seed=given.seed,
        device="cpu",
    )
    environment = envs.unwrapped.episodes.task
    assert task.exam is not None
    print("before:", task.exam.examine(kiks.champion_of_policy(model, environment)))
    model.learn(given.steps)
    champion = kiks.champion_of_policy(model, environment)
    print("after:", task.exam.examine(champion))

    model.save(f"{given.save}.zip")
    champion.save(f"{given.save}.toml")
    sim, ports = champion.simulation(task.arenas[0], seed=1)
    loops = champion.drive(given.port or ports, seconds=60)
    print(f"on the wire: {loops} loops" + ("" if given.port else f", state {sim.state_hash()}"))


if __name__ == "__main__":
    main()

"""Learn to avoid obstacles by PPO in 64 worlds at once, then drive a robot on a serial line with the policy.

pip install '.[learn]' stable-baselines3
python examples/learning/ppo_avoid.py

The policy's network has the shape of `kiks.controllers.mlp`, so its weights become a controller that needs no
PyTorch: in a batch, in a simulation and on a real robot.
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
from kiks.batch.initial_state import random_starts

HIDDEN = (16, 16)
WORLDS = 64
EPISODE_STEPS = 300
RAW_LIMIT = 3.0
"""The policy's actions are clipped to +-3, then tanh maps them to speeds, as the last layer of the controller does."""


class Sb3VecEnv(VecEnv):
    """Adapts a vector environment of Gymnasium to Stable-Baselines3, with tanh before the wheels.

    Args:
        envs: The environment; its worlds must reset in the step in which they end (`SAME_STEP`).
    """

    def __init__(self, envs: gymnasium.vector.VectorEnv) -> None:
        self.envs = envs
        actions = gymnasium.spaces.Box(-RAW_LIMIT, RAW_LIMIT, envs.single_action_space.shape, np.float32)
        super().__init__(envs.num_envs, envs.single_observation_space, actions)

    def reset(self) -> Any:
        return self.envs.reset(seed=self._seeds[0])[0]

    def step_async(self, actions: Any) -> None:
        self.actions = np.tanh(actions)

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


def parameters_of(model: PPO) -> np.ndarray:
    """Return the weights of the policy's mean action as parameters of `kiks.controllers.mlp`."""
    layers = [layer for layer in model.policy.mlp_extractor.policy_net if hasattr(layer, "weight")]
    parts = []
    for layer in (*layers, model.policy.action_net):
        parts += [layer.bias.detach().numpy(), layer.weight.detach().numpy().T.ravel()]
    return np.concatenate(parts).astype(np.float64)


def report(title: str, controller: kiks.Controller, parameters: np.ndarray, arena: kiks.Arena) -> None:
    """Print the mean performance of a controller over 100 starts, a minute each."""
    batch = kiks.Batch(arena, 100, seed=1000, starts=random_starts(arena, 100, seed=1)[:, None])
    measures = [kiks.measures.avoidance, kiks.measures.contacts, kiks.measures.path_mm]
    rollouts = batch.run(controller, parameters, seconds=60, measures=measures)
    reward, contacts, path_mm = rollouts.values[:, 0].mean(axis=0)
    print(f"{title}: reward {reward:.3f} a step, {contacts:.2f} contacts and {path_mm:.0f} mm in a minute")


def main() -> None:
    torch.set_num_threads(1)  # the networks are small: more threads are slower
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--steps", type=int, default=400_000, help="steps of all worlds together")
    options.add_argument("--save", default="ppo_avoid", help="name of the files, without suffix")
    options.add_argument("--port", help="drive the robot on this serial port for a minute, for example /dev/ttyUSB0")
    given = options.parse_args()

    envs = gymnasium.make_vec(
        "kiks/Avoid-v0", num_envs=WORLDS, max_episode_steps=EPISODE_STEPS, autoreset_mode="SameStep"
    )
    vec_env = Sb3VecEnv(envs)
    model = PPO(
        "MlpPolicy",
        vec_env,
        n_steps=64,
        batch_size=1024,
        n_epochs=10,
        learning_rate=1e-3,
        gamma=0.95,
        policy_kwargs={"net_arch": {"pi": HIDDEN, "vf": (64, 64)}, "log_std_init": -0.5},
        seed=1,
        device="cpu",
    )
    spec = envs.unwrapped.episodes.spec
    arena, controller = spec.arenas[0], kiks.controllers.mlp(hidden=HIDDEN, speed_limit=spec.speed_limit)
    report("before", controller, parameters_of(model), arena)
    model.learn(given.steps)
    parameters = parameters_of(model)
    report("after", controller, parameters, arena)

    model.save(f"{given.save}.zip")
    np.save(f"{given.save}.npy", parameters)
    sim = kiks.Simulation(arena, seed=1)
    loops = kiks.drive(given.port or sim.port(1), controller, parameters, seconds=60, period_s=0.1)
    print(f"on the wire: {loops} loops" + ("" if given.port else f", state {sim.state_hash()}"))


if __name__ == "__main__":
    main()

"""Gymnasium environments: one robot, or thousands of worlds with a robot each; importing this registers them.

    import gymnasium
    import kiks.learn.gymnasium_envs

    env = gymnasium.make("kiks/Avoid-v0")
    envs = gymnasium.make_vec("kiks/Avoid-v0", num_envs=1000)

`kiks.learn.environments` defines the environments. With the same seed, a single environment and a world of a vector
environment have the same episodes, to the bit (`kiks.learn.episode_batch`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.batch.initial_state import WORLDS_LIMIT
from kiks.batch.loop_timing import Timing
from kiks.errors import ParameterError, installing, shown
from kiks.learn.environments import ENVIRONMENTS, PERIODS_S, find_environment, step_limit
from kiks.learn.episode_batch import SEED_LIMIT, Episodes, checked_action
from kiks.learn.task import Task
from kiks.meant import nearest
from kiks.model.checks import check_count

try:
    import gymnasium
    from gymnasium.spaces import Box
    from gymnasium.vector import AutoresetMode
    from gymnasium.vector.utils import batch_space
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        f"environments must have Gymnasium, but it is not installed. {installing('learn')}.", name="gymnasium"
    ) from error

Floats32 = NDArray[np.float32]

CHANGES = ("arenas", "controller", "reward", "until", "starts", "apart_mm", "robot", "timing", "response", "threads")
"""What of an environment can be changed; the other arguments of a task have no effect here."""

FASTEST_FPS = 20.0
"""Pictures a second of an environment whose loops follow each other at once: about what 9600 bit/s let through."""


def robot_spaces(task: Task) -> tuple[Any, Any]:
    """Return the observation space and the action space of one robot, two `gymnasium.spaces.Box`."""
    return Box(0.0, 1.0, (task.controller.sensor_count,), np.float32), Box(-1.0, 1.0, (2,), np.float32)


def with_frame_rate(task: Task, known: dict[str, Any]) -> dict[str, Any]:
    """Return metadata with the number of pictures a second that shows an environment in real time."""
    period_s = task.timings[0].period_s
    return {**known, "render_fps": 1.0 / period_s if period_s else FASTEST_FPS}


class KheperaEnv(gymnasium.Env[Floats32, Floats32]):
    """One robot.

    Args:
        task: The environment: a task with a reward, or the name of one of `kiks.learn.environments`.
        render_mode: 'rgb_array' for pictures from above, None for none.
        **changes: Changed arguments of the task: `arenas`, `controller`, `reward`, `until`, `starts`, `apart_mm`,
            `robot` or `timing`; `response` and `threads` as for `kiks.Batch`.

    Example:
        >>> import numpy as np
        >>> from kiks.learn.gymnasium_envs import KheperaEnv
        >>> env = KheperaEnv("Avoid", render_mode="rgb_array")
        >>> seen, info = env.reset(seed=1)
        >>> seen, reward, terminated, truncated, info = env.step(np.array([0.5, 0.5], np.float32))
        >>> seen.shape, terminated, truncated
        ((8,), False, False)
        >>> env.render().shape
        (480, 480, 3)
    """

    metadata = {"render_modes": ["rgb_array"]}  # noqa: RUF012  (a class attribute in Gymnasium)

    def __init__(self, task: str | Task, *, render_mode: str | None = None, **changes: Any) -> None:
        self.render_mode = checked_mode(render_mode)
        self.episodes = new_episodes(task, 1, {"threads": 1} | changes)
        self.metadata = with_frame_rate(self.episodes.task, self.metadata)
        self.observation_space, self.action_space = robot_spaces(self.episodes.task)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats32, dict[str, Any]]:
        """Begin an episode; the same seed gives the same episode.

        Returns:
            The observation, float32 [sensor], and what Gymnasium calls info.
        """
        super().reset(seed=checked_seed(seed))
        self.episodes.begin([0], [seed])
        return self.episodes.observations()[0, 0], self._info()

    def step(self, action: Floats32) -> tuple[Floats32, float, bool, bool, dict[str, Any]]:
        """Set the wheels' speeds, wait for the next loop, and sense.

        Args:
            action: Speeds of the wheels from -1 to 1, shares of the speed limit, float32 [2].

        Returns:
            Observation, float32 [sensor]; reward; whether the episode has reached its end; whether it was truncated;
            and what Gymnasium calls info.
        """
        reward = self.episodes.step(checked_action(action, (2,))[None, None])[0, 0]
        is_over = bool(self.episodes.terminations()[0])
        return self.episodes.observations()[0, 0], float(reward), is_over, False, self._info()

    def render(self) -> Any:
        """Return a picture from above, uint8 [row, column, 3]; None without a render mode."""
        return None if self.render_mode is None else self.episodes.picture(0)

    def _info(self) -> dict[str, Any]:
        return {name: float(values[0, 0]) for name, values in self.episodes.infos().items()}


class KheperaVectorEnv(gymnasium.vector.VectorEnv[Floats32, Floats32, NDArray[Any]]):
    """Many worlds with one robot each, in one batch. A world that has ended resets in the next step.

    Args:
        num_envs: Number of worlds.
        task: The environment: a task with a reward, or the name of one of `kiks.learn.environments`.
        max_episode_steps: Number of steps after which an episode is truncated; None for no limit.
        render_mode: 'rgb_array' for pictures from above, None for none.
        threads: Number of threads; the number of cores if left out. Results do not depend on it.
        **changes: As for `KheperaEnv`.

    Example:
        >>> import numpy as np
        >>> from kiks.learn.gymnasium_envs import KheperaVectorEnv
        >>> envs = KheperaVectorEnv(4, "Avoid", render_mode="rgb_array")
        >>> seen, info = envs.reset(seed=1)
        >>> seen, rewards, *_ = envs.step(np.full((4, 2), 0.5, np.float32))
        >>> seen.shape, rewards.shape, len(envs.render())
        ((4, 8), (4,), 4)
    """

    metadata = {**KheperaEnv.metadata, "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(
        self,
        num_envs: int,
        task: str | Task,
        *,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        threads: int | None = None,
        **changes: Any,
    ) -> None:
        self.render_mode = checked_mode(render_mode)
        self.num_envs = num_envs = check_count("num_envs", num_envs, 1, WORLDS_LIMIT)
        self.max_episode_steps = max_episode_steps
        if max_episode_steps is not None:
            check_count("max_episode_steps", max_episode_steps, 1, SEED_LIMIT)
        self.episodes = new_episodes(task, num_envs, changes | {"threads": threads})
        self.metadata = with_frame_rate(self.episodes.task, self.metadata)
        self.single_observation_space, self.single_action_space = robot_spaces(self.episodes.task)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._done = np.zeros(num_envs, np.bool_)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats32, dict[str, Any]]:
        """Begin episodes in all worlds.

        Args:
            seed: World k gets `seed` + k; or a list with a seed for each. Without one, each world continues its random
                numbers.
            options: None is known.

        Returns:
            Observations, float32 [world, sensor], and what Gymnasium calls info.
        """
        if isinstance(options, dict) and "reset_mask" in options:
            raise ParameterError("reset() begins episodes in all worlds, but it was given a reset_mask. Leave it out.")
        self.episodes.begin(np.arange(self.num_envs), self._seeds(seed))
        self._done[:] = False
        return self.episodes.observations()[:, 0], self._infos()

    def step(self, actions: Floats32) -> tuple[Floats32, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Let all robots act and read their sensors; worlds that ended in the last step reset, and ignore their action.

        Args:
            actions: Speeds of the wheels from -1 to 1, shares of the speed limit, float32 [world, 2].

        Returns:
            Observations, float32 [world, sensor]; rewards [world]; whether each world has reached its end [world], and
            whether it was truncated [world]; and what Gymnasium calls info.
        """
        given = checked_action(actions, (self.num_envs, 2), "the actions")[:, None]
        rewards = self.episodes.step(given, ignored=self._done)[:, 0]
        terminations = self.episodes.terminations()
        truncations = self.episodes.step_counts >= (self.max_episode_steps or np.inf)
        resetting, self._done = self._done, terminations | truncations
        if resetting.any():
            for each in (rewards, terminations, truncations, self._done):
                each[resetting] = 0
            self.episodes.begin(np.flatnonzero(resetting))
        return self.episodes.observations()[:, 0], rewards, terminations, truncations, self._infos()

    def render(self) -> tuple[Any, ...] | None:
        """Return a picture of each world, uint8 [row, column, 3]; None without a render mode."""
        return None if self.render_mode is None else tuple(map(self.episodes.picture, range(self.num_envs)))

    # ---- inside ----

    def _seeds(self, seed: int | Sequence[int | None] | None) -> Sequence[int | None]:
        """Return a seed for each world; None where it continues its random numbers."""
        if seed is None:
            return [None] * self.num_envs
        given: Any = seed
        if isinstance(given, list | tuple) or (isinstance(given, np.ndarray) and given.ndim == 1):
            if len(given) != self.num_envs:
                raise ParameterError(
                    f"seed must be one number, or one for each of {self.num_envs} worlds, but there were {len(given)}."
                )
            return [checked_seed(each) for each in given]
        first = check_count("seed", seed, 0, SEED_LIMIT - self.num_envs)
        return range(first, first + self.num_envs)

    def _infos(self) -> dict[str, Any]:
        infos: dict[str, Any] = {}
        for name, values in self.episodes.infos().items():
            infos[name], infos[f"_{name}"] = values[:, 0], np.ones(self.num_envs, np.bool_)
        return infos


def new_episodes(task: str | Task, worlds: int, changes: dict[str, Any], robots: int | None = None) -> Episodes:
    """Return episodes of so many robots, one if left out; changes are some of `CHANGES`."""
    for name, value in changes.items():
        if name not in CHANGES:
            raise ParameterError(
                f"changes of an environment must be some of {', '.join(CHANGES)}, but {name} was among them, "
                f"{shown(value)}.{nearest(name, CHANGES)}"
            )
    of_episodes = {name: changes.pop(name) for name in ("response", "threads") if name in changes}
    if (arenas := changes.get("arenas")) is not None:
        changes["worlds"] = len(arenas) if isinstance(arenas, Sequence) else 1
    task = find_environment(task)
    if robots is None and task.robots > 1:
        raise ParameterError(f"the task must have one robot, but has {task.robots}. KheperaTeam takes several.")
    changes["robots"] = 1 if robots is None else robots
    return Episodes(task.with_changes(**changes), worlds, **of_episodes)


def checked_seed(seed: int | None) -> int | None:
    """Return a checked seed, or None."""
    return None if seed is None else check_count("seed", seed, 0, SEED_LIMIT)


def checked_mode(render_mode: str | None) -> str | None:
    """Return a checked render mode."""
    if not isinstance(render_mode, str | None) or render_mode not in (None, "rgb_array"):
        raise ParameterError(f"render_mode must be 'rgb_array' or None, but it was {shown(render_mode)}.")
    return render_mode


for _name in ENVIRONMENTS:
    gymnasium.register(
        f"kiks/{_name}-v0",
        entry_point="kiks.learn.gymnasium_envs:KheperaEnv",
        vector_entry_point="kiks.learn.gymnasium_envs:KheperaVectorEnv",
        max_episode_steps=step_limit(PERIODS_S.get(_name, Timing().period_s)),
        kwargs={"task": _name},
    )

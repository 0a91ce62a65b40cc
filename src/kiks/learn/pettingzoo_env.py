"""A PettingZoo environment: several robots in one world, each an agent."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError, installing, shown
from kiks.learn.environments import find_environment, step_limit
from kiks.learn.episode_batch import SEED_LIMIT, checked_action
from kiks.learn.gymnasium_envs import checked_mode, checked_seed, new_episodes, robot_spaces, with_frame_rate
from kiks.learn.task import Task
from kiks.model.checks import check_count

try:
    from pettingzoo import ParallelEnv
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        f"teams must have PettingZoo, but it is not installed. {installing('learn')}.", name="pettingzoo"
    ) from error

Floats32 = NDArray[np.float32]


TEAM = 3
"""Usual number of robots."""


class KheperaTeam(ParallelEnv[str, Floats32, Floats32]):  # type: ignore[misc, unused-ignore]
    """Robots that act at the same time; each gets the reward of its own measure. An episode ends for all at once.

    Args:
        task: The environment: a task with a reward, or the name of one of `kiks.learn.environments`.
        robots: Number of robots; of a task with several, theirs if left out, else 3.
        max_cycles: Number of steps after which an episode is truncated; a minute if left out.
        render_mode: 'rgb_array' for pictures from above, None for none.
        **changes: As for `kiks.learn.gymnasium_envs.KheperaEnv`.

    Example:
        >>> import numpy as np
        >>> from kiks.learn.pettingzoo_env import KheperaTeam
        >>> team = KheperaTeam("Gather", robots=3, render_mode="rgb_array")
        >>> seen, infos = team.reset(seed=1)
        >>> actions = {agent: np.array([0.5, 0.5], np.float32) for agent in team.agents}
        >>> seen, rewards, *_ = team.step(actions)
        >>> sorted(rewards)
        ['robot_1', 'robot_2', 'robot_3']
        >>> team.observation_space("robot_1").shape, team.action_space("robot_1").shape, team.render().ndim
        ((8,), (2,), 3)
    """

    metadata: dict[str, Any] = {"name": "kiks_team_v0", "render_modes": ["rgb_array"]}  # noqa: RUF012

    def __init__(
        self,
        task: str | Task = "Gather",
        *,
        robots: int | None = None,
        max_cycles: int | None = None,
        render_mode: str | None = None,
        **changes: Any,
    ) -> None:
        self.render_mode, task = checked_mode(render_mode), find_environment(task)
        if robots is None:
            robots = task.robots if task.robots > 1 else TEAM
        self.episodes = new_episodes(task, 1, {"threads": 1} | changes, robots)
        self.metadata = with_frame_rate(self.episodes.task, self.metadata)
        steps = step_limit(self.episodes.task.timings[0].period_s) if max_cycles is None else max_cycles
        self.max_cycles = check_count("max_cycles", steps, 1, SEED_LIMIT)
        self.possible_agents = [f"robot_{number + 1}" for number in range(robots)]
        self.agents: list[str] = []
        spaces = {agent: robot_spaces(self.episodes.task) for agent in self.possible_agents}
        self.observation_spaces = {agent: observations for agent, (observations, _) in spaces.items()}
        self.action_spaces = {agent: actions for agent, (_, actions) in spaces.items()}

    def observation_space(self, agent: str) -> Any:
        """Return the observation space of a robot."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Any:
        """Return the action space of a robot."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Floats32], dict[str, dict[str, Any]]]:
        """Begin an episode; the same seed gives the same episode.

        Returns:
            For each robot its observation, float32 [sensor], and what PettingZoo calls info.
        """
        self.episodes.begin([0], [checked_seed(seed)])
        self.agents = list(self.possible_agents)
        return self._by_agent(self.episodes.observations()[0]), self._infos()

    def step(
        self, actions: dict[str, Floats32]
    ) -> tuple[dict[str, Floats32], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Let all robots act, then read their sensors.

        Args:
            actions: For each robot the speeds of its wheels from -1 to 1, shares of the speed limit, float32 [2].

        Returns:
            For each robot: observation, float32 [sensor]; reward; whether the episode has reached its end; whether it
            was truncated; and what PettingZoo calls info.
        """
        if not self.agents or not isinstance(actions, dict) or set(actions) != set(self.agents):
            raise ParameterError(
                f"actions must be given for {', '.join(self.agents) or 'no robot: the episode is over, call reset()'}, "
                f"but they were for {shown(list(actions) if isinstance(actions, dict) else actions)}."
            )
        given = [checked_action(actions[agent], (2,), f"the action of {agent}") for agent in self.agents]
        rewards = self.episodes.step(np.array([given]))[0]
        is_terminated = bool(self.episodes.terminations()[0])
        is_truncated = bool(self.episodes.step_counts[0] >= self.max_cycles)
        result = (
            self._by_agent(self.episodes.observations()[0]),
            self._by_agent(rewards.tolist()),
            dict.fromkeys(self.agents, is_terminated),
            dict.fromkeys(self.agents, is_truncated),
            self._infos(),
        )
        if is_terminated or is_truncated:
            self.agents = []
        return result

    def render(self) -> Any:
        """Return a picture from above, uint8 [row, column, 3]; None without a render mode."""
        return None if self.render_mode is None else self.episodes.picture(0)

    def _by_agent(self, values: Any) -> dict[str, Any]:
        return dict(zip(self.agents, values, strict=True))

    def _infos(self) -> dict[str, dict[str, Any]]:
        infos = self.episodes.infos()
        return {
            agent: {name: float(values[0, k]) for name, values in infos.items()} for k, agent in enumerate(self.agents)
        }

"""A soccer match: two programs, each in a process of its own, in one world with a referee.

The programs know only what their robots tell them. The referee sees everything. It counts the goals, and after each
goal drops the ball near the middle mark; it does the same when the ball has not moved for long. It never moves a robot
and tells the players nothing: a player notices that the ball is gone, as a real one would.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from kiks.engine.scalar_math import uniform
from kiks.errors import ParameterError, shown
from kiks.model import pitch
from kiks.model.robot import RobotSpec
from kiks.ports.program_process import Command
from kiks.ports.programs import Programs
from kiks.sim.simulation import Simulation
from kiks.units import ns_from_s

LOOK_S = 0.1
"""Simulated time between two looks of the referee [s]: a ball moves 30 mm at most."""

STILL_MM, STILL_S = 40.0, 10.0
"""The referee drops a ball that has come no farther than this distance in this time."""

DROP_MM = 40.0, 120.0
"""Largest distance from the middle mark at which the ball drops, along the pitch and across it [mm]."""

ATTEMPTS = 100
"""Places tried for a drop."""

STREAM_REFEREE = 101
"""Random stream of these places."""


class FullTime(Exception):  # noqa: N818 - nothing went wrong
    """The match is over."""


@dataclass(frozen=True)
class Goal:
    """A goal.

    Attributes:
        time_s: Simulated time [s].
        side: The side that scored, 'left' or 'right'.
    """

    time_s: float
    side: str


@dataclass
class Report:
    """The record of a match.

    Attributes:
        goals: The goals, in their order.
        drops_s: Times at which the referee dropped a ball that lay still [s].
        trail: Places of robots and ball at each look: left x, y, right x, y, ball x, y [mm].
    """

    goals: list[Goal] = field(default_factory=list)
    drops_s: list[float] = field(default_factory=list)
    trail: list[tuple[float, ...]] = field(default_factory=list)

    def score(self) -> tuple[int, int]:
        """Return the goals of the left and of the right side."""
        left = sum(goal.side == "left" for goal in self.goals)
        return left, len(self.goals) - left


class Match(Simulation):
    """A pitch with two robots on their marks, a ball, and a referee that looks at fixed instants.

    Args:
        seconds: Length of the match [s of simulated time].
        seed: Seed of all random numbers.
        on_goal: Called after each goal.

    Attributes:
        report: The record of the match so far.
        next_ns: When the referee looks next [ns].
    """

    def __init__(
        self, seconds: float = 300.0, seed: int = 0, on_goal: Callable[[Report], None] = lambda report: None
    ) -> None:
        if not (math.isfinite(seconds) and seconds >= LOOK_S):
            raise ParameterError(
                f"seconds must be a number of at least {LOOK_S}, but it was {shown(seconds)}. Take 300."
            )
        jersey = RobotSpec.load("khepera").with_changes(body__brightness=pitch.JERSEY)
        self._period_ns, self._end_ns = ns_from_s(LOOK_S), ns_from_s(seconds)
        self.next_ns = 0
        super().__init__(pitch.arena(), robots=2, seed=seed, robot=jersey)
        self.ball = self.add_ball(
            pitch.MIDDLE_X_MM, pitch.MIDDLE_Y_MM, brightness=pitch.BALL, friction_mm_s2=pitch.FRICTION_MM_S2
        )
        for robot in (1, 2):
            self.fit(robot, "k213")
        self.report = Report()
        self._on_goal = on_goal
        self._rest, self._rest_s = (pitch.MIDDLE_X_MM, pitch.MIDDLE_Y_MM), 0.0
        self._drop()
        self.loop.supervisor = self

    def act(self) -> None:
        """Let the referee look; the event loop calls this at `next_ns`.

        Raises:
            FullTime: At the end.
        """
        if self.next_ns % self._period_ns == 0:
            self._look()
        if self.next_ns == self._end_ns:
            raise FullTime
        self.next_ns = min(self.next_ns + self._period_ns, self._end_ns)

    def finish(self) -> None:
        """Let time pass to the end.

        Raises:
            FullTime: Always.
        """
        self.advance_to(self._end_ns)

    # ---- the referee ----

    def _look(self) -> None:
        """Note all places, count a goal, drop the ball after a goal or when it lies still."""
        self.sync()
        ball = self.world.state.bodies[0, 0]
        x_mm, y_mm, radius_mm = float(ball["x_mm"]), float(ball["y_mm"]), float(ball["radius_mm"])
        robots = self.world.state.robots[0]
        places = [float(robots[axis][index]) for index in (0, 1) for axis in ("x_mm", "y_mm")]
        self.report.trail.append((*places, x_mm, y_mm))
        side = scorer(x_mm, radius_mm)
        if side is not None:
            self.report.goals.append(Goal(self.time_s, side))
            self._on_goal(self.report)
            self._drop()
        elif math.hypot(x_mm - self._rest[0], y_mm - self._rest[1]) > STILL_MM:
            self._rest, self._rest_s = (x_mm, y_mm), self.time_s
        elif self.time_s - self._rest_s > STILL_S:
            self.report.drops_s.append(self.time_s)
            self._drop()

    def _drop(self) -> None:
        """Drop the ball near the middle mark, a little to one side, and not onto a robot."""
        for attempt in range(ATTEMPTS):
            x_share, y_share = (
                uniform(self.seed, 0, 0, STREAM_REFEREE, self.now_ns + attempt, axis) for axis in (0, 1)
            )
            x_mm = pitch.MIDDLE_X_MM + DROP_MM[0] * (2.0 * x_share - 1.0)
            y_mm = pitch.MIDDLE_Y_MM + DROP_MM[1] * (2.0 * y_share - 1.0)
            try:
                self.move_body(self.ball, x_mm, y_mm)
            except ParameterError:
                continue  # a robot stands there
            self._rest, self._rest_s = (x_mm, y_mm), self.time_s
            return

    def trail(self) -> NDArray[np.float64]:
        """Return the places at each look, float64 [look, left, right or ball, x or y] [mm]."""
        return np.array(self.report.trail, np.float64).reshape(-1, 3, 2)


def scorer(x_mm: float, radius_mm: float) -> str | None:
    """Return the side that scores with a ball at x: all of the ball must be behind the line."""
    return {1: "left", -1: "right"}.get(pitch.goal_at(x_mm, radius_mm))


def play(match: Match, players: Sequence[Command], say: Callable[[str], None] = lambda text: None) -> str:
    """Let two programs play to the end.

    Args:
        match: The match.
        players: The program of the left and of the right side.
        say: Called with a line of text if a program ends early.

    Returns:
        Why the match might not repeat; empty if it does.
    """
    programs = Programs(match, players, when_silent="wait", say=say)
    try:
        programs.run()
        if not programs.doubt:
            match.finish()  # both programs have ended, but the ball may still roll
    except FullTime:
        pass
    return programs.doubt

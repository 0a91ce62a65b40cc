"""A tournament: programs meet in a match, each on each side and with several seeds, and get a table with ratings.

The order of the games follows from the players' names and the results of earlier rounds alone, and so do the ratings:
the table is the same on every machine, and after a kill.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

from kiks.errors import ParameterError, counted, library, shown
from kiks.model.project import Project, ProjectRobot, project_file
from kiks.ports.program_command import ProgramCommand, project_supervisor
from kiks.trials.runner import run_trials
from kiks.trials.submissions import Submission, cut_to_bytes
from kiks.trials.trial import Outcome, ProgramEnd, Trial, limit_of

GAMES_MAX = 20_000
"""Most games of a tournament."""

INTERVAL_SIGMAS = 2.0
"""Half the width of the interval in which a rating lies, in standard deviations: it holds in 95 of 100 cases."""


@dataclass(frozen=True)
class Game:
    """A run of a match.

    Attributes:
        round: Its round, from 1.
        players: The numbers of the players, that of robot 1 first.
        seed: The seed.
    """

    round: int
    players: tuple[int, ...]
    seed: int


@dataclass(frozen=True)
class Played:
    """A game with its outcome.

    Attributes:
        game: The game.
        names: The players' names, that of robot 1 first.
        outcome: What has come out.
    """

    game: Game
    names: tuple[str, ...]
    outcome: Outcome

    @cached_property
    def score(self) -> tuple[float, ...]:
        """What the supervisor has counted for each robot."""
        found = [self.outcome.score.get(str(robot), 0) for robot in range(1, len(self.names) + 1)]
        return tuple(value if isinstance(value, int | float) else 0 for value in found)

    @cached_property
    def failures(self) -> tuple[ProgramEnd | None, ...]:
        """How each program has failed; None if it has not."""
        ends = {end.robot: end for end in self.outcome.ends if end.has_failed}
        return tuple(ends.get(robot) for robot in range(1, len(self.names) + 1))

    @cached_property
    def shares(self) -> tuple[float, ...]:
        """The share of the others that each player has beaten; a draw counts half, and one that has failed has lost."""
        keys = [-math.inf if failed else score for score, failed in zip(self.score, self.failures, strict=True)]
        others = len(keys) - 1
        return tuple(
            sum(1.0 if own > other else 0.5 if own == other > -math.inf else 0.0 for other in keys[:k] + keys[k + 1 :])
            / others
            for k, own in enumerate(keys)
        )

    @property
    def number(self) -> int:
        """Its number in the order in which the games were drawn, from 1."""
        return int(self.outcome.name.partition("-")[0])

    @property
    def text(self) -> str:
        """The score for people, such as '4 : 2'."""
        return " : ".join(f"{value:g}" for value in self.score)

    @property
    def notes(self) -> list[str]:
        """A line for each player that has failed."""
        return [f"{name} {end}" for name, end in zip(self.names, self.failures, strict=True) if end is not None]


@dataclass(frozen=True)
class Standing:
    """A player in the table.

    Attributes:
        name: Its name.
        played: Number of its games.
        won: How many of them it has won.
        drawn: How many were drawn.
        lost: How many it has lost.
        scored: The sum of its scores.
        conceded: The sum of its opponents' scores.
        share: The share of all opponents that it has beaten.
        rating: Its rating.
        interval: The rating is so much higher or lower at most.
        failed: In how many games it has crashed, hung or been stopped.
    """

    name: str
    played: int
    won: int
    drawn: int
    lost: int
    scored: float
    conceded: float
    share: float
    rating: float
    interval: float
    failed: int


@dataclass(frozen=True)
class Tournament:
    """What has come out of a tournament, perhaps so far.

    Attributes:
        title: The match's name.
        players: The players' names.
        played: The games, in the order in which they were drawn.
    """

    title: str
    players: tuple[str, ...]
    played: tuple[Played, ...]

    @cached_property
    def table(self) -> list[Standing]:
        """The players, the best first: by the share of beaten opponents, then by rating."""
        ratings = self._ratings()
        found = []
        for number, name in enumerate(self.players):
            own = [(each, each.game.players.index(number)) for each in self.played if number in each.game.players]
            shares = [each.shares[place] for each, place in own]
            count, won, lost = len(own), shares.count(1), shares.count(0)
            drawn = count - won - lost
            scored = math.fsum(each.score[place] for each, place in own)
            conceded = math.fsum(sum(each.score) for each, _ in own) - scored
            failed = sum(each.failures[place] is not None for each, place in own)
            mu, sigma = ratings[number]
            share = round(sum(shares) / count, 4) if count else 0.0
            interval = round(INTERVAL_SIGMAS * sigma, 2)
            sums = (round(scored, 3), round(conceded, 3))
            found.append(Standing(name, count, won, drawn, lost, *sums, share, round(mu, 2), interval, failed))
        return sorted(found, key=lambda each: (-each.share, -each.rating, each.name))

    def _ratings(self) -> list[tuple[float, float]]:
        """Return mean and standard deviation of each player's rating after all games."""
        model = _models().PlackettLuce()
        ratings = [model.rating() for _ in self.players]
        for each in self.played:
            teams = [[ratings[player]] for player in each.game.players]
            # The more opponents a player has beaten, the lower its rank.
            for player, (rated,) in zip(
                each.game.players, model.rate(teams, ranks=[-s for s in each.shares]), strict=True
            ):
                ratings[player] = rated
        return [(rating.mu, rating.sigma) for rating in ratings]

    def between(self, name: str, other: str) -> tuple[float, float] | None:
        """Return what two players have won against each other, a draw counting half; None if they have not met."""
        met = [each for each in self.played if {name, other} <= set(each.names)]
        own, others = (sum(each.shares[each.names.index(who)] for each in met) for who in (name, other))
        return (own, others) if met else None


@dataclass(frozen=True)
class Match:
    """A project in which players meet, each driving a robot.

    Attributes:
        title: Its name.
        project: The project: its supervisor counts a score for each robot.
        folder: Where it lies.
    """

    title: str
    project: Project
    folder: Path

    @classmethod
    def load(cls, path: Path) -> Match:
        """Read a match.

        Raises:
            ParameterError: If the project is none: it needs two robots, a supervisor and a time limit.
        """
        project = Project.load(path)
        folder = project_file(path).parent
        what = f"a match must be a project with a supervisor that counts the score, but {path.name!r}"
        if len(project.robots) < 2:
            raise ParameterError(
                f"{what} has {counted(len(project.robots), 'robot')}. It needs a robot for each player."
            )
        if project_supervisor(project, folder) is None:
            raise ParameterError(f'{what} names none. Write supervisor = "referee.py".')
        limit_of(project, "a match", shown(path.name))
        return cls(path.stem, project, folder)

    @property
    def sides(self) -> int:
        """How many players meet."""
        return len(self.project.robots)

    def trial(self, number: int, game: Game, players: Sequence[Submission], *, is_trusted: bool) -> Trial:
        """Return the trial of a game."""
        own = [players[player] for player in game.players]
        robots = tuple(
            replace(robot, name=player.name, program=None, arguments=())
            for robot, player in zip(self.project.robots, own, strict=True)
        )
        commands = tuple(_driving(player, robot) for player, robot in zip(own, self.project.robots, strict=True))
        project = replace(self.project, robots=robots, seed=game.seed, speed=None)
        name = cut_to_bytes(f"{number:04}-{'-'.join(player.id for player in own)}")
        return Trial(name, project, self.folder, commands, is_trusted=is_trusted)


def _driving(player: Submission, robot: ProjectRobot) -> ProgramCommand:
    """Return the program of a player with the arguments that the match has for its robot."""
    assert player.command is not None
    return replace(player.command, arguments=list(robot.arguments))


def _models() -> Any:
    """Return the models of ratings."""
    return library("openskill.models", "tournament")


def in_order(players: Sequence[Submission]) -> list[Submission]:
    """Return players in the order in which they are numbered, with names that differ."""
    ordered = sorted(players, key=lambda each: each.id)
    if len({each.name for each in ordered}) < len(ordered):
        return [replace(each, name=each.id) for each in ordered]
    return ordered


def play(
    match: Match,
    players: Sequence[Submission],
    out: Path,
    *,
    rounds: int | None = None,
    seeds: Sequence[int] = (0,),
    is_trusted: bool = False,
    workers: int | None = None,
    on_played: Callable[[Played, int], object] = lambda played, count: None,
) -> Tournament:
    """Play a tournament, and return what has come out. A second call goes on where one ended.

    Args:
        match: The match.
        players: The players.
        out: The folder of outcomes and recordings.
        rounds: Rounds of the Swiss system; round robin if left out.
        seeds: Seeds with which the same players meet, once on each side.
        is_trusted: Whether players run without a sandbox.
        workers: How many games at once; one for each core if left out.
        on_played: Called with each game as it is played, and with the number of games that are known so far.
    """
    _models()  # that it is missing is said before the games
    ordered = in_order(players)
    names = tuple(each.name for each in ordered)
    if len(ordered) < match.sides:
        raise ParameterError(
            f"PLAYERS must be at least {match.sides}, for so many meet, but there are {len(ordered)}. Add another one."
        )
    games: list[Game] = []
    found = Tournament(match.title, names, ())
    drawn: Iterable[tuple[int, list[tuple[int, ...]]]]
    for number in range(1, (rounds or 1) + 1):
        if rounds is None:
            drawn = enumerate(round_robin(len(ordered), match.sides), 1)
        else:
            drawn = [(number, _next_groups(found, match.sides))]
        games += [game for turn, groups in drawn for group in groups for game in _games(turn, group, seeds)]
        if len(games) > GAMES_MAX:
            raise ParameterError(
                f"games must be at most {GAMES_MAX}, but there are more. Take --rounds, or fewer seeds."
            )
        trials = [match.trial(k, game, ordered, is_trusted=is_trusted) for k, game in enumerate(games, 1)]
        found = _outcome(found, games, trials, out, workers, on_played)
    return found


def _outcome(
    before: Tournament,
    games: Sequence[Game],
    trials: Sequence[Trial],
    out: Path,
    workers: int | None,
    on_played: Callable[[Played, int], object],
) -> Tournament:
    """Play games, and return what has come out of all: those of earlier rounds are among them, and known."""
    by_name = {
        trial.name: (game, tuple(before.players[player] for player in game.players))
        for trial, game in zip(trials, games, strict=True)
    }
    known = {each.outcome.name for each in before.played}

    def note(outcome: Outcome, _: int) -> None:
        if outcome.name not in known:
            on_played(Played(*by_name[outcome.name], outcome), len(games))

    outcomes = run_trials(trials, out, workers=workers, on_outcome=note)
    return replace(before, played=tuple(Played(*by_name[each.name], each) for each in outcomes))


def _next_groups(found: Tournament, sides: int) -> list[tuple[int, ...]]:
    """Return who meet in the next round of the Swiss system."""
    met: dict[frozenset[int], int] = {}
    for each in found.played:
        for pair in combinations(each.game.players, 2):
            met[frozenset(pair)] = met.get(frozenset(pair), 0) + 1
    # If not all can play, those rest that have played most, of these the last in the table.
    table = [(each.played, place, found.players.index(each.name)) for place, each in enumerate(found.table)]
    resting = sorted(table)[len(table) - len(table) % sides :]
    return swiss([each[-1] for each in table if each not in resting], sides, met)


def _games(number: int, group: Sequence[int], seeds: Sequence[int]) -> Iterator[Game]:
    """Yield the games of a group of players: with each seed, each on each side."""
    for seed in seeds:
        for turn in range(len(group)):
            yield Game(number, (*group[turn:], *group[:turn]), seed)


def round_robin(count: int, sides: int) -> list[list[tuple[int, ...]]]:
    """Return the rounds in which each player meets each other one: the groups of players of each round.

    Args:
        count: Number of players.
        sides: How many meet in a game. Of two, each plays once in a round, or not at all if the number is odd.

    Example:
        >>> round_robin(4, 2)
        [[(0, 3), (1, 2)], [(0, 2), (3, 1)], [(0, 1), (2, 3)]]
    """
    rounds: list[list[tuple[int, ...]]] = [[group] for group in combinations(range(count), sides)]
    if sides > 2:
        return rounds
    # The circle method: the first stays, the others move on by a place.
    ring: list[int | None] = [*range(count), *([None] * (count % 2))]
    rounds = []
    for _ in range(len(ring) - 1):
        half = len(ring) // 2
        pairs = zip(ring[:half], reversed(ring[half:]), strict=True)
        rounds.append([(one, other) for one, other in pairs if one is not None and other is not None])
        ring = [ring[0], ring[-1], *ring[1:-1]]
    return rounds


def swiss(ranked: Sequence[int], sides: int, met: dict[frozenset[int], int]) -> list[tuple[int, ...]]:
    """Return the groups of a round of the Swiss system: neighbours in the table that have met least.

    Args:
        ranked: The players, the best first.
        sides: How many meet in a game.
        met: How often two players have met.

    Example:
        >>> swiss([2, 0, 1, 3], 2, {frozenset((0, 2)): 1})
        [(2, 1), (0, 3)]
    """
    left, groups = list(ranked), []
    while left:
        group = [left.pop(0)]
        while len(group) < sides:
            best = min(left, key=lambda player: sum(met.get(frozenset((player, each)), 0) for each in group))
            left.remove(best)
            group.append(best)
        groups.append(tuple(group))
    return groups

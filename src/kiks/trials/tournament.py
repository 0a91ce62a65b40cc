"""A tournament: programs meet in a match, each on each side and with several seeds, and get a table with ratings.

The order of the games follows from the players' names and the results of earlier rounds alone, and so do the ratings:
the table is the same on every machine, and after a kill.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

from kiks.errors import ParameterError, counted, library, shown
from kiks.model.project import Project, project_file
from kiks.ports.program_command import project_supervisor
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
        names: The players' names, that of robot 1 first.
        seed: The seed.
    """

    round: int
    names: tuple[str, ...]
    seed: int


@dataclass(frozen=True)
class Played(Game):
    """A game with its outcome."""

    outcome: Outcome

    @cached_property
    def score(self) -> tuple[float, ...]:
        """What the supervisor has counted for each robot."""
        found = [self.outcome.score.get(str(robot), 0) for robot in range(1, len(self.names) + 1)]
        return tuple(value if isinstance(value, int | float) else 0 for value in found)

    @cached_property
    def failures(self) -> tuple[ProgramEnd | None, ...]:
        """How each program has failed; None if it has not."""
        failures = self.outcome.failures
        return tuple(failures.get(robot) for robot in range(1, len(self.names) + 1))

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
    def standings(self) -> list[dict[str, Any]]:
        """The players, the best first: by `share`, the share of beaten opponents, then by `rating`.

        `scored` and `conceded` are the sums of a player's scores and of its opponents' ones, the rating is by
        `interval` higher or lower at most, and `failed` counts the games in which the player crashed, hung or was
        stopped. The names are those of the columns of `tournament.csv`.
        """
        ratings = self._ratings()
        found = []
        for name in self.players:
            own = [(each, each.names.index(name)) for each in self.played if name in each.names]
            shares = [each.shares[place] for each, place in own]
            count, won, lost = len(own), shares.count(1), shares.count(0)
            scored = math.fsum(each.score[place] for each, place in own)
            found.append(
                {
                    "name": name,
                    "played": count,
                    "won": won,
                    "drawn": count - won - lost,
                    "lost": lost,
                    "scored": round(scored, 3),
                    "conceded": round(math.fsum(sum(each.score) for each, _ in own) - scored, 3),
                    "share": round(sum(shares) / count, 4) if count else 0.0,
                    "rating": round(ratings[name].mu, 2),
                    "interval": round(INTERVAL_SIGMAS * ratings[name].sigma, 2),
                    "failed": sum(each.failures[place] is not None for each, place in own),
                }
            )
        return sorted(found, key=lambda each: (-each["share"], -each["rating"], each["name"]))

    def _ratings(self) -> dict[str, Any]:
        """Return each player's rating after all games, with its mean `mu` and standard deviation `sigma`."""
        model = _models().PlackettLuce()
        ratings = {name: model.rating() for name in self.players}
        for each in self.played:
            # The more opponents a player has beaten, the lower its rank.
            rated = model.rate([[ratings[name]] for name in each.names], ranks=[-share for share in each.shares])
            ratings |= {name: rating for name, (rating,) in zip(each.names, rated, strict=True)}
        return ratings

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

    def trial(self, number: int, game: Game, players: Mapping[str, Submission], *, is_trusted: bool) -> Trial:
        """Return the trial of a game; each player gets the arguments that the match has for its robot."""
        own = [players[name] for name in game.names]
        robots, commands = [], []
        for player, robot in zip(own, self.project.robots, strict=True):
            assert player.command is not None
            commands.append(replace(player.command, arguments=list(robot.arguments)))
            robots.append(replace(robot, name=player.name, program=None, arguments=()))
        project = replace(self.project, robots=tuple(robots), seed=game.seed, speed=None)
        name = cut_to_bytes(f"{number:04}-{'-'.join(player.id for player in own)}")
        return Trial(name, project, self.folder, tuple(commands), is_trusted=is_trusted)


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
    by_name = {each.name: each for each in in_order(players)}
    if len(by_name) < match.sides:
        raise ParameterError(
            f"PLAYERS must be at least {match.sides}, for so many meet, but there are {len(by_name)}. Add another one."
        )
    found = Tournament(match.title, tuple(by_name), ())
    games: dict[str, Game] = {}  # by the names of their trials
    trials: list[Trial] = []
    known: set[str] = set()  # those of earlier rounds, which are run again with those of this one

    def note(outcome: Outcome, _: int) -> None:
        if outcome.name not in known:
            on_played(Played(**vars(games[outcome.name]), outcome=outcome), len(games))

    for number in range(1, (rounds or 1) + 1):
        if rounds is None:
            drawn = [*enumerate(round_robin(found.players, match.sides), 1)]
        else:
            drawn = [(number, _next_groups(found, match.sides))]
        for game in (game for turn, groups in drawn for group in groups for game in _games(turn, group, seeds)):
            trials.append(match.trial(len(trials) + 1, game, by_name, is_trusted=is_trusted))
            games[trials[-1].name] = game
            if len(games) > GAMES_MAX:
                raise ParameterError(
                    f"games must be at most {GAMES_MAX}, but there are more. Take --rounds, or fewer seeds."
                )
        outcomes = run_trials(trials, out, workers=workers, on_outcome=note)
        found = replace(found, played=tuple(Played(**vars(games[each.name]), outcome=each) for each in outcomes))
        known |= {*games}
    return found


def _next_groups(found: Tournament, sides: int) -> list[tuple[str, ...]]:
    """Return who meet in the next round of the Swiss system."""
    met = Counter(frozenset(pair) for each in found.played for pair in combinations(each.names, 2))
    # If not all can play, those rest that have played most, of these the last in the table.
    table = [(each["played"], place, each["name"]) for place, each in enumerate(found.standings)]
    resting = sorted(table)[len(table) - len(table) % sides :]
    return swiss([each[-1] for each in table if each not in resting], sides, met)


def _games(number: int, group: Sequence[str], seeds: Sequence[int]) -> Iterator[Game]:
    """Yield the games of a group of players: with each seed, each on each side."""
    for seed in seeds:
        for turn in range(len(group)):
            yield Game(number, (*group[turn:], *group[:turn]), seed)


def round_robin(players: Sequence[str], sides: int) -> list[list[tuple[str, ...]]]:
    """Return the rounds in which each player meets each other one: the groups of players of each round.

    Args:
        players: The players.
        sides: How many meet in a game. Of two, each plays once in a round, or not at all if the number is odd.

    Example:
        >>> round_robin("abcd", 2)
        [[('a', 'd'), ('b', 'c')], [('a', 'c'), ('d', 'b')], [('a', 'b'), ('c', 'd')]]
    """
    if sides > 2:
        return [[group] for group in combinations(players, sides)]
    # The circle method: the first stays, the others move on by a place.
    ring: list[str | None] = [*players, *([None] * (len(players) % 2))]
    rounds: list[list[tuple[str, ...]]] = []
    for _ in range(len(ring) - 1):
        half = len(ring) // 2
        pairs = zip(ring[:half], reversed(ring[half:]), strict=True)
        rounds.append([(one, other) for one, other in pairs if one is not None and other is not None])
        ring = [ring[0], ring[-1], *ring[1:-1]]
    return rounds


def swiss(ranked: Sequence[str], sides: int, met: Mapping[frozenset[str], int]) -> list[tuple[str, ...]]:
    """Return the groups of a round of the Swiss system: neighbours in the table that have met least.

    Args:
        ranked: The players, the best first.
        sides: How many meet in a game.
        met: How often two players have met.

    Example:
        >>> swiss(["ann", "bob", "eve", "joe"], 2, {frozenset(("ann", "bob")): 1})
        [('ann', 'eve'), ('bob', 'joe')]
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

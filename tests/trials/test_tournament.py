"""Tournaments: who meets whom, who has won, and a table that depends on nothing else."""

import sys
from itertools import combinations
from pathlib import Path

import pytest
from typer.testing import CliRunner

from kiks.cli import app
from kiks.errors import ParameterError
from kiks.model.project import Project
from kiks.trials.tournament import Match, Played, Tournament, play, round_robin, swiss
from kiks.trials.trial import End, Outcome, ProgramEnd

NAMES = ("ann", "bob", "eve")


def played(players: tuple[int, ...], score: tuple[float, ...], crashed: tuple[int, ...] = ()) -> Played:
    """Return a game with its score; some players have crashed."""
    names = tuple(NAMES[player] for player in players)
    how = [(End.CRASHED, "no ball") if player in crashed else (End.RUNNING, "") for player in players]
    ends = tuple(ProgramEnd(robot, "player.py", *each) for robot, each in enumerate(how, 1))
    counted: dict[str, float | str] = {str(robot): value for robot, value in enumerate(score, 1)}
    name = "-".join(names)
    return Played(1, names, 0, Outcome(name, name, False, False, 0, 9.0, counted, ends, "", ""))


def test_in_round_robin_each_meets_each_once_and_plays_once_in_a_round() -> None:
    for count in range(2, 10):
        rounds = round_robin("abcdefghij"[:count], 2)
        met = sorted(tuple(sorted(pair)) for pairs in rounds for pair in pairs)
        assert met == [*combinations("abcdefghij"[:count], 2)]
        for pairs in rounds:
            players = [player for pair in pairs for player in pair]
            assert len(set(players)) == len(players) >= count - 1
    assert round_robin("abcd", 3) == [[group] for group in combinations("abcd", 3)]


def test_in_the_swiss_system_neighbours_meet_who_have_not_met() -> None:
    met = {frozenset("ab"): 1, frozenset("cd"): 1}
    assert swiss("abcd", 2, met) == [("a", "c"), ("b", "d")]
    assert swiss("abcd", 2, {}) == [("a", "b"), ("c", "d")]


def test_the_higher_score_wins_unless_its_program_has_failed() -> None:
    for score, crashed, shares in (
        ((2, 1), (), (1, 0)),
        ((1, 1), (), (0.5, 0.5)),
        ((9, 1), (0,), (0, 1)),  # one that crashes has lost, whatever it has scored
        ((9, 1), (0, 1), (0, 0)),
        ((5, 1, 1), (), (1, 0.25, 0.25)),  # of three, each beats those behind it
    ):
        game = played((0, 1, 2)[: len(score)], score, crashed)
        assert game.shares == shares
        assert game.notes == [f"{NAMES[player]} crashed: no ball" for player in crashed]


def test_the_table_has_the_best_first_with_ratings_and_intervals() -> None:
    games = (played((0, 1), (2, 1)), played((1, 0), (0, 3)), played((1, 2), (1, 1)), played((2, 0), (4, 0), (2,)))
    table = Tournament("football", NAMES, games).standings
    assert [each["name"] for each in table] == ["ann", "eve", "bob"]
    first, second, third = table
    assert [*first.values()][1:7] == [3, 3, 0, 0, 5, 5]
    assert (second["drawn"], second["lost"], second["failed"]) == (1, 1, 1)
    assert first["rating"] > 25 > third["rating"]
    assert first["interval"] < 17
    assert Tournament("football", NAMES, games).between("ann", "bob") == (2, 0)
    assert Tournament("football", NAMES, ()).between("ann", "bob") is None


def test_a_project_that_is_no_match_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "referee.py").write_text("def supervise(sim):\n    yield 1\n")
    seconds, referee, two = "seconds = 5.0\n", 'supervisor = "referee.py"\n', "[[robot]]\n[[robot]]\n"
    for text, message in (
        (seconds, "has 1 robot. It needs a robot for each player"),
        (seconds + two, "names none. Write supervisor"),
        (referee + two, "must have a time limit, but 'match.kiks' has none. Write"),
        (f'{referee}{seconds}thinking = "live"\n{two}', "must have a repeatable thinking time"),
    ):
        (tmp_path / "match.kiks").write_text(f"kiks = 1\n{text}[walls]\nsize_mm = [400, 400]\n")
        with pytest.raises(ParameterError, match=message):
            Match.load(tmp_path / "match.kiks")


def test_the_library_of_ratings_is_missed_before_the_games(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "openskill.models", None)
    with pytest.raises(ParameterError, match=r"This needs openskill.*pip install 'kiks\[tournament\]'"):
        play(Match("race", Project(), tmp_path), [], tmp_path)


def test_a_match_or_a_player_that_is_not_there_is_named(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["tournament", "sumo", "missing.py", "--out", str(tmp_path / "out")])
    message = "PLAYERS must be files or folders, but there is no 'missing.py'"
    assert message in str(done.exception or done.output), done.output

"""Sweeps: what varies, up to where a program holds, and which case is the worst."""

import pytest

from kiks.errors import ParameterError
from kiks.model.exercise import Case, Cases
from kiks.model.ranges import numbers_of, seeds_in
from kiks.trials.sweep import Sweep, Tried
from kiks.trials.trial import End, Outcome, ProgramEnd


def tried(thinking_ms: float, points: float = 1.0, *, baud=9600, robot: int = 1, end: End = End.RUNNING) -> Tried:
    """Return a case, solved if it has points."""
    ends = (ProgramEnd(1, "drive.py", end, "no wall" if end == End.CRASHED else ""),)
    name, time_s = f"{baud}/{thinking_ms}/{robot}", 9.0 if points else 3.0
    outcome = Outcome(name, name, points > 0, points == 0, points, time_s, {}, ends, "", f"runs/{name}.mcap")
    return Tried(Case(baud=baud, thinking=f"fixed:{thinking_ms}", family=robot, seed=0), outcome)


def test_it_holds_up_to_the_last_time_before_the_first_that_fails() -> None:
    points = {0: 2, 10: 1, 20: 0, 30: 3}
    found = Sweep(tuple(tried(time, value) for time, value in points.items()))
    assert found.holds_up_to_ms(9600) == 10
    worst = "worst: seed 0, robot 1 with 20 ms at 9600 baud (failed after 3.0 s)"
    assert found.verdict == f"holds up to 10 ms of thinking at 9600 baud; {worst}"
    assert [row.share for row in found.rows] == [1, 1, 0, 1]


def test_each_line_has_a_limit_of_its_own() -> None:
    cases = [tried(0, baud=baud) for baud in (9600, 19200, 38400, 75)]
    cases += [tried(5, baud != 9600, baud=baud) for baud in (9600, 19200, 38400)] + [tried(0, 0, baud=75, robot=0)]
    found = Sweep(tuple(cases))
    assert [found.holds_up_to_ms(baud) for baud in found.bauds] == [None, 0, 5, 5]
    assert found.verdict.startswith(
        "does not hold at 75 baud, not even with 0 ms of thinking, and holds up to 0 ms of thinking at 9600 baud, and "
        "holds up to 5 ms of thinking at 19200 and 38400 baud, the most that was tried; worst: seed 0, the exact robot"
    )


def test_a_share_of_the_runs_may_fail_if_a_person_says_so() -> None:
    cases = tuple(tried(time, robot != 1 or time == 0, robot=robot) for time in (0, 1) for robot in range(1, 5))
    assert Sweep(cases).holds_up_to_ms(9600) == 0
    some = Sweep(cases, share=0.75)
    assert some.holds_up_to_ms(9600) == 1
    assert "(in 75 % of the runs)" in some.verdict


def test_a_program_that_crashes_has_not_solved_anything() -> None:
    verdict = Sweep((tried(0, 5.0, end=End.CRASHED, baud=None),)).verdict
    worst = "worst: seed 0, robot 1 with 0 ms (drive.py crashed: no wall)"
    assert verdict == f"does not hold, not even with 0 ms of thinking; {worst}"
    # The worst of what holds everywhere has the fewest points.
    found = Sweep((tried(0, 5.0), tried(10, 3.0), tried(20, 4.0)))
    assert found.worst.thinking_ms == 10
    assert found.verdict.endswith("with 10 ms at 9600 baud (3 points)")


def test_cases_are_each_value_with_each_of_the_others() -> None:
    cases = Cases(thinking=("fixed:0", "fixed:2.5"), baud=(9600, 19200), family=(1, 2, 3), seed=(0, 1)).each()
    assert len(cases) == len({(each.thinking, each.baud, each.family, each.seed) for each in cases}) == 24
    with pytest.raises(ParameterError, match="cases must be at most 10000"):
        Cases(thinking=tuple(f"fixed:{ms}" for ms in range(1000)), seed=tuple(range(1000)))


def test_seeds_are_whole_numbers_and_ranges() -> None:
    assert seeds_in("1-3, 7") == seeds_in("7,1..3") == [1, 2, 3, 7]
    for wrong in ("", "3-1", "a", "1-", "-1", "0-5000", "1.5"):
        with pytest.raises(ParameterError, match="seeds must be"):
            seeds_in(wrong)


def test_a_range_rises_and_has_no_more_numbers_than_a_file_may_list() -> None:
    no_ranges = ("", "a", "5..1", "0..1:0", "0..inf", "nan", "-3", "0..10:-1", "1,,2", "0..5:x")
    long = "0..1e9:1e-9", ",".join(f"{k}..{k + 0.9}:0.001" for k in range(100))
    for texts, words in ((no_ranges, "numbers or rising ranges, but one was"), (long, "at most 1000 numbers")):
        for text in texts:
            with pytest.raises(ParameterError, match=f"--think must be {words}"):
                numbers_of(text, "--think")
    assert numbers_of("0..0.7:0.1", "--think") == (0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)

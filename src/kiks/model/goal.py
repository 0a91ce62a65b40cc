"""The goal of a project: when a run has solved it, and how many points it gets (the page "Projects")."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from kiks.errors import ParameterError
from kiks.model.checks import ROBOTS_MAX
from kiks.model.data_file import Text, Whole, record
from kiks.model.formula import Formula


def _check_formula(text: str) -> str:
    Formula(text)
    return text


FormulaText = Annotated[Text, AfterValidator(_check_formula)]


def number_of(formula: Formula, values: list[Any], what: str, where: str) -> float:
    """Return the value of a formula, a finite number; messages say what it decides, and where it has none."""
    try:
        value = float(formula.value(values))
        if math.isfinite(value):
            return value
        reason = f"it is {value:g}, as what is not reached is infinite. Add 'if is_solved else 0'"
    except (ArithmeticError, TypeError, ValueError) as error:
        reason = str(error)
    raise ParameterError(f"{what} must be a number, but {formula.text!r} has none {where}: {reason}.")


@record
class Goal:
    """What a run is for. A judge looks every 0.1 s of simulated time, and ends the run when it is solved or failed.

    Formulas have numbers, + - * /, comparisons, `and`, `or`, `not`, `min`, `max`, `abs`, `round` and `a if b else c`.
    Their names are `time_s`; `is_solved`; `is_over`, when neither `solved` nor `failed` has ended the run; the measures
    of `kiks.measures`, such as `contacts` or `goal_mm(800, 500)`; `wall_mm`, the gap to the nearest wall [mm];
    `score("laps")`, what a supervisor has counted; `held_s(condition)`, for how long it has held without a break, and
    `total_s(condition)`, for how long in all [s].

    Args:
        text: The goal in a line for people.
        solved: Formula that says whether it is solved.
        failed: Formula that says whether it cannot be solved any more.
        points: Formula of the points; 1 if it is solved, else 0, if left out.
        robot: The robot whose measures count; `contacts(robot=2)` is another's.

    Example:
        >>> Goal("Reach the lamp without a contact", solved="light_mm < 80", failed="contacts > 0").points
        'is_solved'
    """

    text: Text = ""
    solved: FormulaText = "False"
    failed: FormulaText = "False"
    points: FormulaText = "is_solved"
    robot: Annotated[Whole, Field(ge=1, le=ROBOTS_MAX)] = 1

    def formulas(self) -> dict[str, Formula]:
        """Return the formulas by their names."""
        return {name: Formula(getattr(self, name)) for name in ("solved", "failed", "points")}

    def as_lists(self) -> dict[str, Any]:
        """Return it as JSON has it, for a page: formulas as in `Formula.as_lists`, and the terms of all of them.

        A term is its name, its arguments or the condition of a timer, how it is written, and the index of its robot. It
        stands behind the terms of its condition.
        """
        formulas = self.formulas()
        terms = [*dict.fromkeys(reversed([term for each in formulas.values() for term in each.all_terms()]))]
        rows = []
        for term in terms:
            named = {"robot": self.robot, **dict(term.named)}
            robot = named.pop("robot")
            given = [*term.arguments, *named] if term.condition is None else [term.condition.as_lists(terms)]
            rows.append([term.name, given, str(term), robot - 1 if isinstance(robot, int) else -1])
        return {"text": self.text, "terms": rows} | {name: each.as_lists(terms) for name, each in formulas.items()}

    def counts(self) -> set[float | str]:
        """Return the entries of the score that its formulas ask for."""
        terms = [term for formula in self.formulas().values() for term in formula.all_terms()]
        return {term.arguments[0] for term in terms if term.name == "score" and term.arguments}

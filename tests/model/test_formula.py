"""Formulas of files: they compute what Python computes, and nothing that a file says does more than that."""

import warnings
from contextlib import suppress

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tests.model.refusals import refused

from kiks.errors import ParameterError
from kiks.model.formula import FORMULA_MAX, Formula

NAMES = ("contacts", "light_mm", "goal_mm(8, 5)", 'score("laps")', "path_mm(robot=2)")


def joined(parts: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    """Return formulas made of two or three others."""
    operators = st.sampled_from(["+", "-", "*", "/", "<", "<=", ">", ">=", "==", "!=", "and", "or"])
    return st.one_of(
        st.builds("({}) {} ({})".format, parts, operators, parts),
        st.builds("{} ({})".format, st.sampled_from(["-", "+", "not"]), parts),
        st.builds("({}) if ({}) else ({})".format, parts, parts, parts),
        st.builds("{}({}, {})".format, st.sampled_from(["min", "max"]), parts, parts),
        st.builds("abs({})".format, parts),
    )


formulas = st.recursive(st.one_of(st.sampled_from(NAMES), st.integers(0, 99).map(str)), joined, max_leaves=8)


@given(formulas, st.lists(st.integers(-9, 9), min_size=len(NAMES), max_size=len(NAMES)))
def test_it_has_the_value_that_python_gives(text: str, numbers: list[int]) -> None:
    values = dict(zip(NAMES, numbers, strict=True))
    plain = text
    for name, number in values.items():
        plain = plain.replace(name, f"({number})")
    formula = Formula(text)
    assert len(set(map(str, formula.terms))) == len(formula.terms)
    given = [values[str(term).replace("'", '"')] for term in formula.terms]
    try:
        expected = eval(plain)
    except ZeroDivisionError:
        with pytest.raises(ArithmeticError):
            formula.value(given)
        return
    assert formula.value(given) == expected


def test_its_terms_tell_their_arguments_and_it_computes_with_numbers_alone() -> None:
    formula = Formula("goal_mm(800, -5.5) + reached_s(1, 2, radius_mm=30) + held_s(contacts == 0 and time_s > 3)")
    place, reached, held = formula.terms
    assert (place.name, place.arguments, place.named) == ("goal_mm", (800, -5.5), ())
    assert reached.named == (("radius_mm", 30),)
    assert held.condition == Formula("contacts == 0 and time_s > 3")
    assert [str(term) for term in formula.terms] == [
        "goal_mm(800, -5.5)",
        "reached_s(1, 2, radius_mm=30)",
        "held_s(contacts == 0 and time_s > 3)",
    ]
    assert [str(term) for term in held.condition.terms] == ["contacts", "time_s"]
    for text, value in (
        ("round(2.567, 2)", 2.57),
        ("round(7.4)", 7),
        ("round(5, -1000000000)", 0),
        ("round(2.5, 1000000000)", 2.5),
        ("1 < 2 < 3", True),
        ("1e400", float("inf")),
    ):
        assert Formula(text).value([]) == value
    for name in (*NAMES, "_value", "__import__('os')", "eval('1')", "open('/etc/passwd')", "exit()"):
        assert Formula(name).value([7.0]) == 7.0


def test_what_is_no_formula_is_refused_in_one_line() -> None:
    for text, reason in (
        ("", "invalid syntax"),
        ("1 +", "invalid syntax"),
        ("sim.world", "Attribute is not allowed"),
        ("().__class__", "Attribute is not allowed"),
        ("score('a').real", "Attribute is not allowed"),
        ("[x for x in y]", "ListComp is not allowed"),
        ("max(x for x in y)", "GeneratorExp is not allowed"),
        ("lambda: 1", "Lambda is not allowed"),
        ("(x := 1)", "NamedExpr is not allowed"),
        ("x[0]", "Subscript is not allowed"),
        ("f'{x}'", "JoinedStr is not allowed"),
        ("2 ** 3", "Pow is not allowed"),
        ("1 << 9", "LShift is not allowed"),
        ("'a' * 10", "it must compute with numbers alone"),
        ("None", "it must compute with numbers alone"),
        ("1j", "it must compute with numbers alone"),
        ("9" * 20, "its numbers must be at most 1e15"),
        ("min(*x)", "Starred is not allowed"),
        ("f(*x)", "must be numbers or texts, but one is [*]x"),
        ("goal_mm(contacts, 1)", "must be numbers or texts, but one is contacts"),
        ("contacts(robot=True)", "must be numbers or texts, but one is True"),
        ("contacts(robot=1, robot=2)", "an argument of contacts comes twice"),
        ("f(1)(2)", "only names can be called"),
        ("min", "min must be followed by its arguments"),
        ("held_s", "held_s must be followed by its arguments"),
        ("held_s(1, 2)", "held_s must have one condition"),
        ("max(a=1)", "max takes no arguments with names"),
        ("(" * 300 + "1" + ")" * 300, "too many nested parentheses"),
        ("-" * 950 + "1", "it is nested too deeply"),
        ("x" * (FORMULA_MAX + 1), f"it has more than {FORMULA_MAX} characters"),
        ("x\0", "null bytes"),
        ("\ud800", "encode"),
    ):
        line = refused(f"must be a formula, but .* is none: .*{reason}", Formula, text)
        assert line.endswith("Write one such as 'light_mm < 100 and contacts == 0'.")
        assert len(line) < 400


@example("1*" * 499 + "1")
@example("held_s(" * 120 + "1" + ")" * 120)
@given(st.text(st.sampled_from("()[]{}'\"\\.,:=*/+-<>!#@% \n019_aefilmnorsxdh"), max_size=60))
def test_any_text_is_a_formula_or_refused(text: str) -> None:
    with warnings.catch_warnings(action="error"), suppress(ParameterError, ArithmeticError, TypeError):
        formula = Formula(text)
        formula.value([1.0] * len(formula.terms))

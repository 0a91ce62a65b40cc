"""Formulas in files: arithmetic and comparisons over names that the reader of the file gives values."""

from __future__ import annotations

import ast
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, cast

from kiks.errors import ParameterError, shown
from kiks.model.data_file import one_line

FORMULA_MAX = 1000
"""Most characters of a formula."""

TIMERS = ("held_s", "total_s")
"""Functions of a condition: how long it has held without a break, and how long in all [s]."""


def _round(number: float, digits: float = 0) -> float:
    """Return a number rounded as a float, which takes no time for any count of digits."""
    return round(float(number), int(digits))


FUNCTIONS: dict[str, Callable[..., Any]] = {"min": min, "max": max, "abs": abs, "round": _round}
"""Functions of numbers."""

_NODES = (
    *(ast.Expression, ast.Constant, ast.Name, ast.Load, ast.Call, ast.keyword, ast.IfExp),
    *(ast.UnaryOp, ast.UAdd, ast.USub, ast.Not, ast.BinOp, ast.Add, ast.Sub, ast.Mult, ast.Div),
    *(ast.BoolOp, ast.And, ast.Or, ast.Compare, ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq),
)
_NOTATIONS = {"&&": " and ", r"\|\|": " or ", "!(?!=)": " not ", "=>": ">=", "=<": "<=", "(?<![<>=!])=(?!=)": "=="}
"""What other languages write, and what Python does."""

_EXAMPLE = "Write one such as 'light_mm < 100 and contacts == 0'."


def _in_python(text: str) -> str:
    """Return a formula in the notation of another language as Python writes it; empty if it is in none."""
    found = re.sub(r"\b(?:AND|OR|NOT)\b", lambda word: word[0].lower(), text)
    for pattern, instead in _NOTATIONS.items():
        found = re.sub(pattern, instead, found)
    with suppress(ParameterError):
        return Formula(" ".join(found.split())).text if found != text else ""
    return ""


@dataclass(frozen=True)
class Term:
    """A part of a formula that gets its value from outside.

    Attributes:
        name: Its name, such as 'contacts'.
        arguments: The arguments in brackets, numbers and texts.
        named: The arguments with names, in the order in which they stand.
        condition: What a timer watches; None for all other terms.
    """

    name: str
    arguments: tuple[float | str, ...] = ()
    named: tuple[tuple[str, float | str], ...] = ()
    condition: Formula | None = None

    def __str__(self) -> str:
        given = [self.condition.text] if self.condition is not None else [*map(repr, self.arguments)]
        given += [f"{name}={value!r}" for name, value in self.named]
        return f"{self.name}({', '.join(given)})" if given else self.name


class Formula:
    """A formula of a file, in Python's notation. It can only compute: it reaches neither attributes nor functions.

    Args:
        text: The formula.

    Attributes:
        text: The formula.
        terms: The terms in it, each once; a term of a timer's condition is in that condition's.

    Example:
        >>> formula = Formula("10 - 2 * contacts if goal_mm(800, 500) < 50 else 0")
        >>> [term.name for term in formula.terms]
        ['goal_mm', 'contacts']
        >>> formula.value([30.0, 1.0])
        8.0
    """

    def __init__(self, text: str) -> None:
        self.text = text
        try:
            if len(text) > FORMULA_MAX:
                raise ValueError(f"it has more than {FORMULA_MAX} characters")
            self.terms: list[Term] = []
            with warnings.catch_warnings(action="ignore"):
                self._tree: Any = _TermFinder(self.terms).visit(ast.parse(text.strip(), mode="eval"))
                self._code = compile(ast.fix_missing_locations(self._tree), "<formula>", "eval")
        except ParameterError:
            raise
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            reason = error.msg if isinstance(error, SyntaxError) else one_line(error)
            meant = _in_python(text) if isinstance(error, SyntaxError) else ""
            advice = f"Did you mean {meant!r}?" if meant else _EXAMPLE
            raise ParameterError(f"must be a formula, but {shown(text)} is none: {reason}. {advice}") from None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Formula) and self.text == other.text

    def __hash__(self) -> int:
        return hash(self.text)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.text!r})"

    def all_terms(self) -> Iterator[Term]:
        """Yield the terms in it and in the conditions of its timers."""
        for term in self.terms:
            yield term
            if term.condition is not None:
                yield from term.condition.all_terms()

    def as_lists(self, terms: Sequence[Term]) -> Any:
        """Return it as JSON has it: the nodes of `ast`, with their fields behind their names.

        Args:
            terms: Where its terms are looked up: ["Term", 2] stands for the third.

        Example:
            >>> formula = Formula("2 * contacts")
            >>> formula.as_lists(formula.terms)
            ['BinOp', ['Constant', 2, None], ['Mult'], ['Term', 0]]
        """

        def listed(node: Any) -> Any:
            if isinstance(node, ast.Subscript):
                return ["Term", terms.index(self.terms[cast(Any, node.slice).value])]
            if isinstance(node, ast.AST):
                return [type(node).__name__, *(listed(getattr(node, name)) for name in node._fields)]
            return [*map(listed, node)] if isinstance(node, list) else node

        return listed(self._tree.body)

    def value(self, values: list[Any]) -> Any:
        """Return its value for those of its terms.

        Raises:
            ArithmeticError: If it divides by zero.
            TypeError: If a function gets too few arguments, or too many.
            ValueError: If it rounds what is no number.
        """
        return eval(self._code, {"__builtins__": {}}, FUNCTIONS | {"_value": values})


class _TermFinder(ast.NodeTransformer):
    """Puts `_value[k]` in the place of each term, and refuses all that is no formula."""

    def __init__(self, terms: list[Term]) -> None:
        self._terms = terms

    def visit(self, node: ast.AST) -> Any:
        if not isinstance(node, _NODES):
            raise ValueError(f"{type(node).__name__} is not allowed")
        return super().visit(node)

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        # A text times a number would take memory on a file's word.
        if not isinstance(node.value, bool | int | float):
            raise ValueError("it must compute with numbers alone; texts are for the arguments of a measure")
        if isinstance(node.value, int) and abs(node.value) > 10**15:
            raise ValueError("its numbers must be at most 1e15")
        return node

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if node.id in FUNCTIONS or node.id in TIMERS:
            raise ValueError(f"{node.id} must be followed by its arguments in brackets")
        return self._place(Term(node.id))

    def visit_Call(self, node: ast.Call) -> ast.AST:
        if not isinstance(node.func, ast.Name):
            raise ValueError("only names can be called")
        name = node.func.id
        if name in FUNCTIONS:
            if node.keywords:
                raise ValueError(f"{name} takes no arguments with names")
            return ast.Call(node.func, [self.visit(each) for each in node.args], [])
        if name in TIMERS:
            if len(node.args) != 1 or node.keywords:
                raise ValueError(f"{name} must have one condition in brackets")
            return self._place(Term(name, condition=Formula(ast.unparse(node.args[0]))))
        arguments = tuple(map(_constant, node.args))
        named = tuple((each.arg or "**", _constant(each.value)) for each in node.keywords)
        if len(dict(named)) < len(named):
            raise ValueError(f"an argument of {name} comes twice")
        return self._place(Term(name, arguments, named))

    def _place(self, term: Term) -> ast.AST:
        """Return what reads the value of a term."""
        if term not in self._terms:
            self._terms.append(term)
        index = ast.Constant(self._terms.index(term))
        return ast.Subscript(ast.Name("_value", ast.Load()), index, ast.Load())


def _constant(node: ast.expr) -> float | str:
    """Return an argument of a term, which must be a number or a text: terms do not depend on each other."""
    try:
        value = ast.literal_eval(node)
    except (ValueError, TypeError):
        value = None
    if not isinstance(value, int | float | str) or isinstance(value, bool):
        raise ValueError(f"the arguments of a measure must be numbers or texts, but one is {ast.unparse(node)}")
    return value

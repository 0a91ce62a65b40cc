"""Between which values a formula lies, whatever happens in a run: the most is what full points are."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterable
from itertools import product

from kiks.model.formula import FUNCTIONS, TIMERS, Formula

Range = tuple[float, float]


def range_of(formula: Formula, seconds: float) -> Range:
    """Return the least and the most that a formula of a goal can give, where no measure is negative.

    Each part is taken by itself, so the range may be wider than what can happen.

    Args:
        formula: The formula.
        seconds: Longest time of a run [s].

    Example:
        >>> range_of(Formula("max(0, 10 - contacts) if is_solved else max(0, 5 - light_mm / 80)"), 60.0)
        (0.0, 10.0)
    """
    known: dict[str, Range] = {"is_solved": (0, 1), "is_over": (0, 1), "time_s": (0, seconds)}
    known |= dict.fromkeys(TIMERS, (0.0, seconds))

    def within(node: ast.AST) -> Range:
        match node:
            case ast.Constant(value=int() | float() as value):
                return value, value
            case ast.Compare() | ast.UnaryOp(op=ast.Not()):
                return 0, 1
            case ast.UnaryOp(op=op, operand=operand):
                low, high = within(operand)
                return (-high, -low) if isinstance(op, ast.USub) else (low, high)
            case ast.BoolOp(values=parts):
                return _around(end for part in parts for end in within(part))
            case ast.IfExp(body=first, orelse=second):
                return _around((*within(first), *within(second)))
            case ast.BinOp(left=left, op=op, right=right):
                return _computed(within(left), op, within(right))
            case ast.Call(func=ast.Name(id="abs"), args=[argument]):
                low, high = within(argument)
                return max(low, -high, 0), max(-low, high)
            case ast.Call(func=ast.Name(id="round"), args=[argument, *digits]):
                given = [each.value for each in digits if isinstance(each, ast.Constant)]
                low, high = (FUNCTIONS["round"](end, *given) for end in within(argument))
                return low, high
            case ast.Call(func=ast.Name(id="min" | "max" as which), args=parts) if parts:
                lows, highs = zip(*map(within, parts), strict=True)
                return FUNCTIONS[which](lows), FUNCTIONS[which](highs)
            case ast.Call(func=ast.Name(id=name)) | ast.Name(id=name):
                return known.get(name, (0, math.inf))
        return -math.inf, math.inf

    low, high = within(ast.parse(formula.text.strip(), mode="eval").body)
    return float(low), float(high)


def _computed(left: Range, op: ast.operator, right: Range) -> Range:
    """Return the range of an operation of two numbers."""
    if isinstance(op, ast.Add):
        return left[0] + right[0], left[1] + right[1]
    if isinstance(op, ast.Sub):
        return left[0] - right[1], left[1] - right[0]
    if isinstance(op, ast.Div):
        low, high = right
        if low < 0 < high or low == high == 0:
            return -math.inf, math.inf
        right = (1 / high if high else -math.inf), (1 / low if low else math.inf)
    # Nothing times anything is nothing, however large.
    return _around(a * b if a and b else 0 for a, b in product(left, right))


def _around(ends: Iterable[float]) -> Range:
    all_ends = [*ends]
    return min(all_ends), max(all_ends)

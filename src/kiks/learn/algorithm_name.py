"""The names of the algorithms and their options as text; the command line shows them without loading any."""

from __future__ import annotations

import ast
import enum
from collections.abc import Mapping
from typing import Any

from kiks.errors import ParameterError, shown
from kiks.model.checks import check_choice


class AlgorithmName(enum.StrEnum):
    """The algorithms."""

    CMA = "cma"
    GA = "ga"
    SGA = "sga"
    NSGA2 = "nsga2"
    NEAT = "neat"
    MAP_ELITES = "map-elites"
    CMA_ME = "cma-me"
    NOVELTY = "novelty"


def parse_algorithm(algorithm: str) -> tuple[str, dict[str, Any]]:
    """Return the name and the options of an algorithm, such as 'cma' or 'cma:separable=true,restarts=ipop'.

    Example:
        >>> parse_algorithm("cma:separable=true,restarts=ipop")
        ('cma', {'separable': True, 'restarts': 'ipop'})
    """
    name, colon, text = algorithm.partition(":")
    names = [*map(str, AlgorithmName)]
    check_choice("algorithm", name, names, f"one of {', '.join(names)}, or an object with ask and tell")
    options: dict[str, Any] = {}
    for pair in text.split(",") if colon else ():
        key, equals, value = (word.strip() for word in pair.partition("="))
        if not (key and equals and value) or key in options:
            raise ParameterError(
                f"the options of an algorithm must be like 'cma:separable=true,restarts=ipop', each once, but they "
                f"were {shown(text)}."
            )
        options[key] = _value(value)
    return name, options


def format_algorithm(name: str, options: Mapping[str, Any]) -> str:
    """Return the text of an algorithm with options, as `parse_algorithm` reads it."""
    pairs = (f"{key}={str(value).lower() if isinstance(value, bool) else value}" for key, value in options.items())
    return f"{name}:{','.join(pairs)}" if options else name


def _value(text: str) -> Any:
    """Return a number, true or false, or else the text itself."""
    if text in ("true", "false"):
        return text == "true"
    try:
        value = ast.literal_eval(text)
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return text
    return value if isinstance(value, bool | int | float) else text

"""The algorithms by name: they propose candidates and learn from their fitness.

An algorithm draws all random numbers from its seed, and depends on nothing but the values that it is given: the same
seed and values give the same candidates. So an evolution resumes by telling all generations again.
"""

from __future__ import annotations

from typing import Any

from kiks.errors import ParameterError
from kiks.learn.algorithm import Algorithm, Setting
from kiks.learn.algorithm_name import AlgorithmName, format_algorithm, parse_algorithm
from kiks.learn.cma_es import Cma
from kiks.learn.diversity import CmaMe, MapElites, Novelty
from kiks.learn.genetic import Ga, Nsga2, Sga
from kiks.learn.neat import Neat
from kiks.model.data_file import table_of

ALGORITHMS: dict[str, Any] = {
    AlgorithmName.CMA.value: Cma,
    AlgorithmName.GA.value: Ga,
    AlgorithmName.SGA.value: Sga,
    AlgorithmName.NSGA2.value: Nsga2,
    AlgorithmName.NEAT.value: Neat,
    AlgorithmName.MAP_ELITES.value: MapElites,
    AlgorithmName.CMA_ME.value: CmaMe,
    AlgorithmName.NOVELTY.value: Novelty,
}
"""The algorithms by their names; `Options` of each are what stands behind the colon."""


def checked_options(algorithm: str) -> Any:
    """Return the options of an algorithm, such as 'cma' or 'cma:separable=true'.

    Example:
        >>> checked_options("cma:separable=true").restarts
        'none'
    """
    name, options = parse_algorithm(algorithm)
    try:
        return ALGORITHMS[name].Options(**options)
    except ParameterError as error:
        raise ParameterError(f"algorithm {name}: {error}") from None


def whole_name(algorithm: str) -> str:
    """Return the text of an algorithm that is the same for the same options, without those that are as usual."""
    return format_algorithm(parse_algorithm(algorithm)[0], table_of(checked_options(algorithm)))


def make_algorithm(algorithm: str, setting: Setting) -> Algorithm:
    """Return an algorithm, such as 'cma' or 'cma:separable=true'."""
    name, _ = parse_algorithm(algorithm)
    made: Algorithm = ALGORITHMS[name](setting, checked_options(algorithm))
    return made

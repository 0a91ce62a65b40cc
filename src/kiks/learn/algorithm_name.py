"""The names of the algorithms; the command line shows them without loading any."""

from __future__ import annotations

import enum


class AlgorithmName(enum.StrEnum):
    """The algorithms."""

    CMA = "cma"
    GA = "ga"
    MAP_ELITES = "map-elites"
    CMA_ME = "cma-me"
    NOVELTY = "novelty"
    ROULETTE = "roulette"

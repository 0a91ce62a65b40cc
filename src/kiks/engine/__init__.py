"""Arrays in, arrays out: motors, motion, contact, rays and sensors. No clock, no input or output, no own randomness.

Numba takes settings from the environment, and from a file of the current folder, which may be a stranger's. All that
uses Numba imports this package first: the file is left alone, and settings with which Numba cannot work are refused.
"""

from __future__ import annotations

import os
import sys
import warnings
from importlib import import_module
from typing import Any

from kiks.errors import ParameterError, shown


def _load_numba() -> None:
    """Import Numba."""
    modules: dict[str, Any] = sys.modules
    yaml = modules.pop("yaml", None)
    modules["yaml"] = None  # without YAML, Numba cannot read the file
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("error", "Environment variable", RuntimeWarning)
            warnings.filterwarnings("ignore", "A Numba config file")
            import numba

        _load_array_functions()
        config: Any = numba.config
        config._config_fname = os.devnull
        if config.DISABLE_JIT:
            raise ValueError("NUMBA_DISABLE_JIT leaves the engine without its compiler")
        if not all(each.startswith(("+", "-")) for each in (config.CPU_FEATURES or "+").split(",")):
            raise ValueError("each of NUMBA_CPU_FEATURES must begin with + or -")
    except (RuntimeWarning, ValueError) as error:
        given = {name: value for name, value in os.environ.items() if name.startswith("NUMBA_")}
        why = " ".join(str(error).partition("\nThe parse")[0].split())
        raise ParameterError(
            f"Numba must be able to work with the variables NUMBA_..., but: {shown(why)}. They are {shown(given)}. "
            "Unset those that you do not need."
        ) from None
    finally:
        del modules["yaml"]
        if yaml is not None:
            modules["yaml"] = yaml


def _load_array_functions() -> None:
    """Import Numba's functions of arrays, which import SciPy's linear algebra only to see whether it is there.

    SciPy comes with KiKS, no kernel needs its linear algebra, and to import that takes a seventh of the time to the
    first reading of a sensor. Functions of users that need it import it when they are compiled.
    """
    from numba.np import linalg

    look = linalg.ensure_blas
    linalg.ensure_blas = lambda: None
    try:
        import_module("numba.np.arraymath")
    finally:
        linalg.ensure_blas = look


_load_numba()

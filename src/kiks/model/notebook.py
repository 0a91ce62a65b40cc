"""Notebooks of Jupyter as programs: the code in their cells."""

from __future__ import annotations

import json
from typing import Any

from kiks.errors import ParameterError, shown

_PYTHON = ("python", "python3", "ipython")


def code_cells(data: bytes, name: str) -> list[str]:
    r"""Return the code cells of a notebook in their order, without empty ones, which Jupyter does not count either.

    Args:
        data: The bytes of its file.
        name: What messages call it.

    Raises:
        ParameterError: If it is no notebook of Python.

    Example:
        >>> cells = [{"cell_type": "markdown", "source": "Lab 1"}, {"cell_type": "code", "source": ["x = 1\n", "x"]}]
        >>> code_cells(json.dumps({"nbformat": 4, "cells": cells}).encode(), "lab.ipynb")
        ['x = 1\nx']
    """
    try:
        found: Any = json.loads(data)
        if found["nbformat"] < 4:
            raise ParameterError(
                f"{name} must be a notebook of format 4 or newer, but it has format {found['nbformat']}. Save it with "
                "a newer Jupyter."
            )
        language = found.get("metadata", {}).get("language_info", {}).get("name", _PYTHON[0])
        cells = ["".join(each["source"]) for each in found["cells"] if each["cell_type"] == "code"]
    except (ValueError, RecursionError, LookupError, TypeError, AttributeError) as error:
        if isinstance(error, ParameterError):
            raise
        raise ParameterError(
            f"{name} must be a notebook of Jupyter, but it cannot be read as one. Save it again in Jupyter."
        ) from None
    if language not in _PYTHON:
        raise ParameterError(
            f"{name} must be a notebook of Python, but it is one of {shown(language)}. Write it in Python."
        )
    return [cell for cell in cells if cell.strip()]

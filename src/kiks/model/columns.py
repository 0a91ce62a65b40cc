"""Tables as pandas, R and files take them: a column of numbers or texts for each name, all equally long."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Columns = dict[str, NDArray[Any]]


def columns_of(parts: Mapping[str, NDArray[Any]]) -> Columns:
    r"""Return arrays [row] or [row, number] as columns: one for each number, and bytes as texts.

    Example:
        >>> columns_of({"counts": np.array([[3, 4], [5, 6]]), "data": np.array([b"N", b"\r"], object)})
        {'counts_0': array([3, 5]), 'counts_1': array([4, 6]), 'data': array(['N', '\\r'], dtype='<U2')}
    """
    columns: Columns = {}
    for name, values in parts.items():
        if values.dtype.kind == "O":
            texts = [each.decode("latin-1").encode("unicode_escape").decode() for each in values.tolist()]
            values = np.array(texts, "U")
        columns |= {name: values} if values.ndim == 1 else {f"{name}_{k}": each for k, each in enumerate(values.T)}
    return columns

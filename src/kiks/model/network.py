"""The thesis's response: one small neural network for each sensor, and the fans of rays they were trained on.

Source: thesis section 3.3, "7 input neurons, 13+7 neurons in 2 hidden layers, 1 linear output neuron". The weights of
the file that comes with KiKS were trained by `kiks fit`; `responses/SOURCE.md` says on which data.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError
from kiks.model.files import replace_file
from kiks.model.robot import SENSOR_COUNT

INPUT_COUNT, TANH_COUNT, LINEAR_COUNT = 7, 13, 7
"""Rays, neurons of the first and of the second hidden layer (thesis 3.3)."""

BODY_RADIUS_MM = 27.5
"""Radius of the robot whose readings the networks were trained on [mm] (`responses/SOURCE.md`)."""

THESIS = Path(__file__).with_name("responses") / "thesis_khepera.json"
"""The networks that come with KiKS."""

_PLACES = ("mount_angle_deg", "mount_radius_mm", "direction_deg")
_WEIGHTS = {
    "hidden": (SENSOR_COUNT, TANH_COUNT, INPUT_COUNT + 1),
    "middle": (SENSOR_COUNT, LINEAR_COUNT, TANH_COUNT + 1),
    "last": (SENSOR_COUNT, LINEAR_COUNT + 1),
}


@dataclass(frozen=True, eq=False)
class NetworkResponse:
    """Networks of eight sensors; of each row of weights the last one is the bias.

    Args:
        mount_angle_deg: Polar angle of each sensor's place, left positive [deg].
        mount_radius_mm: Its distance from the robot's centre [mm].
        direction_deg: Where the middle ray looks, left positive [deg].
        field_of_view_deg: From the leftmost ray to the rightmost [deg].
        range_mm: Longest length of a ray [mm]; inputs are 1 - length/range.
        hidden: Weights of the tanh neurons, shape [8, 13, 8].
        middle: Weights of the linear neurons, shape [8, 7, 14].
        last: Weights of the output [counts], shape [8, 8].

    Raises:
        ParameterError: If a list or an array has another shape, or a number is not finite.
    """

    mount_angle_deg: tuple[float, ...]
    mount_radius_mm: tuple[float, ...]
    direction_deg: tuple[float, ...]
    field_of_view_deg: float
    range_mm: float
    hidden: NDArray[np.float64]
    middle: NDArray[np.float64]
    last: NDArray[np.float64]

    def __post_init__(self) -> None:
        shapes = dict.fromkeys(_PLACES, (SENSOR_COUNT,)) | {"field_of_view_deg": (), "range_mm": ()} | _WEIGHTS
        for name, shape in shapes.items():
            try:
                given = np.array(getattr(self, name), np.float64)
                fits = given.shape == shape and bool(np.isfinite(given).all())
            except (TypeError, ValueError):
                fits = False
            if not fits:
                raise ParameterError(
                    f"{name} must be finite numbers of the shape {list(shape)}, but it was not. "
                    "Let `kiks fit` write the file of networks."
                )
            if name in _WEIGHTS:
                given.setflags(write=False)
                object.__setattr__(self, name, given)
            elif name in _PLACES:
                object.__setattr__(self, name, tuple(given.tolist()))

    @property
    def weights(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """What the kernels of `kiks.engine.networks` want: hidden, middle and last."""
        return self.hidden, self.middle, self.last

    @classmethod
    def load(cls, file: str | Path = THESIS) -> NetworkResponse:
        """Read networks from a file; those that come with KiKS if left out.

        Raises:
            ParameterError: If the file cannot be read or holds something else.

        Example:
            >>> NetworkResponse.load().range_mm
            50.0
        """
        try:
            data: Any = json.loads(Path(file).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise ParameterError(
                f"Networks must come from a readable JSON file, but {str(file)!r} is none ({error}). "
                "`kiks fit --out FILE` writes one."
            ) from error
        names = {"field_of_view_deg", "range_mm", *_PLACES, *_WEIGHTS}
        if not isinstance(data, dict) or set(data) != names:
            given = sorted(data) if isinstance(data, dict) else type(data).__name__
            raise ParameterError(
                f"{file}: A file of networks must hold {', '.join(sorted(names))} and nothing else, but it holds "
                f"{given}. `kiks fit --out FILE` writes one."
            )
        return cls(**data)

    def save(self, file: str | Path) -> None:
        """Write the networks to a file, weights with six digits, one neuron a line.

        Raises:
            ParameterError: If the file cannot be written.
        """
        parts = [f'"{name}": {json.dumps(getattr(self, name))}' for name in (*_PLACES, "field_of_view_deg", "range_mm")]
        parts += [f'"{name}": {_written(getattr(self, name))}' for name in _WEIGHTS]
        replace_file(file, "{\n" + ",\n".join(parts) + "\n}\n", "networks")


def _written(array: NDArray[np.float64]) -> str:
    """Return an array as JSON with six significant digits, each of its last rows on a line of its own."""
    if array.ndim == 1:
        return "[" + ", ".join(f"{value:.6g}" for value in array) + "]"
    return "[\n" + ",\n".join(_written(part) for part in array) + "\n]"

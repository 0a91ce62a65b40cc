"""The thesis's response: one small neural network for each sensor, and the rays that are its inputs.

Source: thesis section 3.3, "7 input neurons, 13+7 neurons in 2 hidden layers, 1 linear output neuron". The weights of
the file that comes with KiKS were trained by `tools/accuracy.py`; `responses/SOURCE.md` says on which data.
"""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from kiks.model.atomic_files import replace_file
from kiks.model.data_file import Number, check, parse_json, read_file, record
from kiks.model.robot import SENSOR_COUNT, Angles, Radii

INPUT_COUNT, TANH_COUNT, LINEAR_COUNT = 7, 13, 7
"""Rays, neurons of the first and of the second hidden layer (thesis 3.3)."""

BODY_RADIUS_MM = 27.5
"""Radius of the robot whose readings the networks were trained on [mm] (`responses/SOURCE.md`)."""

THESIS = Path(__file__).with_name("responses") / "thesis_khepera.json"
"""The networks that come with KiKS."""

_ONE_EACH = Field(min_length=SENSOR_COUNT, max_length=SENSOR_COUNT)
Numbers = NDArray[np.float64]
Weight = Annotated[Number, Field(ge=-1e6, le=1e6)]
Inputs = Annotated[tuple[Weight, ...], Field(min_length=INPUT_COUNT + 1, max_length=INPUT_COUNT + 1)]
Bent = Annotated[tuple[Weight, ...], Field(min_length=TANH_COUNT + 1, max_length=TANH_COUNT + 1)]


@record
class NetworkResponse:
    """Networks of eight sensors; of each row of weights the last one is the bias.

    Args:
        mount_angle_deg: Polar angle of each sensor's place, left positive [deg].
        mount_radius_mm: Its distance from the robot's centre [mm].
        direction_deg: Where the middle ray looks, left positive [deg].
        field_of_view_deg: From the leftmost ray to the rightmost [deg].
        range_mm: Longest length of a ray [mm]; inputs are 1 - length/range.
        hidden: Weights of the tanh neurons, 8 sensors of 13 neurons of 8 weights.
        middle: Weights of the linear neurons, 8 of 7 of 14.
        last: Weights of the output [counts], 8 of 8.
    """

    mount_angle_deg: Angles
    mount_radius_mm: Radii
    direction_deg: Angles
    field_of_view_deg: Annotated[Number, Field(gt=0, le=180)]
    range_mm: Annotated[Number, Field(ge=1, le=1000)]
    hidden: Annotated[
        tuple[Annotated[tuple[Inputs, ...], Field(min_length=TANH_COUNT, max_length=TANH_COUNT)], ...], _ONE_EACH
    ]
    middle: Annotated[
        tuple[Annotated[tuple[Bent, ...], Field(min_length=LINEAR_COUNT, max_length=LINEAR_COUNT)], ...], _ONE_EACH
    ]
    last: Annotated[tuple[Inputs, ...], _ONE_EACH]

    @property
    def weights(self) -> tuple[Numbers, Numbers, Numbers]:
        """The weights for the kernels: hidden [8, 13, 8], middle [8, 7, 14] and last [8, 8]."""
        return np.array(self.hidden), np.array(self.middle), np.array(self.last)

    @classmethod
    def load(cls, file: str | Path = THESIS) -> NetworkResponse:
        """Read networks from a file; those that come with KiKS if left out.

        Example:
            >>> NetworkResponse.load().range_mm
            50.0
        """
        what = f"The file of networks {str(file)!r}"
        return check(NetworkResponse, parse_json(read_file(Path(file), what), what), what, advice=_ADVICE)

    def save(self, file: str | Path) -> None:
        """Write the networks to a file, weights with six digits, one neuron a line."""
        parts = [f'"{each.name}": {_written(getattr(self, each.name))}' for each in fields(self)]
        replace_file(file, "{\n" + ",\n".join(parts) + "\n}\n", "networks")


_ADVICE = "`python tools/accuracy.py --networks FILE` in a checkout of KiKS writes one."


def _written(value: Any) -> str:
    """Return numbers as JSON with six significant digits, each of the last rows of a matrix on a line of its own."""
    if not isinstance(value, tuple):
        return f"{value:.6g}"
    is_matrix = isinstance(value[0], tuple)
    return "[\n" + ",\n".join(map(_written, value)) + "\n]" if is_matrix else f"[{', '.join(map(_written, value))}]"

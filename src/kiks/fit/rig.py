"""The rig on which samples were measured: where the robot really stood, as its eight sensors tell together.

A table says at which gap and angle a reading was taken. The hand that set the gap was off by half a millimetre or so,
and the robot turned on the spot by its own wheels: where it began and how far it went round differ from sweep to sweep.
One sensor alone could not tell that from a property of its own; eight that look different ways can.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kiks.fit.samples import Floats, Samples


@dataclass(frozen=True, eq=False)
class Rig:
    """How each sweep differed from what its table says.

    Args:
        gap_mm: How much wider the gap was [mm], shape [gaps].
        angle_deg: How much larger the angle was half way round [deg], shape [gaps].
        turn_deg: How much farther than once around the robot went [deg], shape [gaps].
    """

    gap_mm: Floats
    angle_deg: Floats
    turn_deg: Floats

    @classmethod
    def exact(cls, gap_count: int) -> Rig:
        """Return the rig whose tables are right."""
        return cls(*np.zeros((3, gap_count)))

    def moved(self, samples: Samples) -> Samples:
        """Return the samples with the poses at which they were really taken."""
        # The angle grows by about one turn from the first column of a sweep to the last.
        share = samples.angle_deg / 360.0 - 0.5
        angle_deg = samples.angle_deg + self.angle_deg[:, None] + self.turn_deg[:, None] * share
        return replace(samples, gap_mm=samples.gap_mm + self.gap_mm, angle_deg=angle_deg)

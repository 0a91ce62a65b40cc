"""The log for TensorBoard: TensorBoard's own reader finds the curves in it."""

from pathlib import Path

import numpy as np
import pytest
from tests.learn.small import small

import kiks


@pytest.mark.slow
def test_the_curves_are_those_of_the_generations(tmp_path: Path) -> None:
    pytest.importorskip("tensorboard")
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    from kiks.learn.tensorboard_log import FILES, TensorBoardLog

    evolution = kiks.Evolution(small(), "ga", seed=3, population=8)
    for count in (1, 3):  # a log of an evolution that goes on begins anew
        with TensorBoardLog(tmp_path) as log:
            evolution.run(generations=count, each=log)
            log(evolution)
    assert len(list(tmp_path.glob(FILES))) == 1
    path = evolution.task.value_names.index("path_mm")
    found = EventAccumulator(str(tmp_path)).Reload()
    for name, known in (
        ("fitness/best", [each.fitness.max() for each in evolution.generations]),
        ("fitness/champion", [each.champion_fitness for each in evolution.generations[1:]]),
        ("evaluations", np.cumsum([each.evaluations for each in evolution.generations])),
        ("measures/path_mm", [each.values[:8, path].mean() for each in evolution.generations]),
    ):
        events = found.Tensors(name)
        values = [each.tensor_proto.float_val[0] for each in events]
        assert values == pytest.approx(list(known), rel=1e-6), name
        assert [each.step for each in events] == list(range(1, 4))[-len(values) :]

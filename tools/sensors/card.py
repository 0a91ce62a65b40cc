"""The accuracy card: how far each model's counts are from those that were measured on a real Khepera.

Only active cells count, those with a measured reading between 20 and 1000: below is noise, above saturation. Models and
poses were fitted to angles with an even index at most; those with an odd one, the held-out half, were never seen.

Every figure is given for two sets of poses, the same for all models: those found for the rig (`kiks.fit.robot_fit`)
and, with `told` in its name, those of the tables.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tools.sensors.models import MODELS

from kiks.errors import ParameterError
from kiks.fit.robot_fit import Rig, active_pairs, find_rigs, fit_robot
from kiks.fit.samples import ACTIVE_COUNTS, MAXIMUM_COUNTS, Floats, Samples, is_active, load_samples
from kiks.model.robot import SENSOR_COUNT, RobotSpec

OBJECTS = {"wall": np.inf, "cylinder": 27.0}
"""The tables of the samples' folder: their names and the radius of what stood there [mm]."""

HALVES = {"odd": slice(1, None, 2), "even": slice(0, None, 2), "all": slice(None)}
"""Parts of a table by the index of the angle; `odd` is the held-out half."""

HELD_OUT = "odd"

FOUND, TOLD = "found", "told"
"""Poses of the samples: as the readings of all sensors say, and as the tables do."""

_FITTED = ("light", "threshold", "lobe_deg")

_REPOSITORY = Path(__file__).parents[2]


@dataclass(frozen=True)
class Score:
    """Absolute errors over the active cells [counts]."""

    median: float
    mean: float
    p95: float
    max: float

    @classmethod
    def of(cls, error: Floats) -> Score:
        """Return the score of errors of any sign."""
        size = np.abs(error)
        return cls(float(np.median(size)), float(size.mean()), float(np.percentile(size, 95)), float(size.max()))


@dataclass(frozen=True)
class Figure:
    """One number of the card, as `python tools/accuracy.py --json` prints it."""

    name: str
    value: float
    unit: str


@dataclass(frozen=True, eq=False)
class Card:
    """What was measured and what each model answers.

    Args:
        tables: Measured samples by object; the readings are the same for all poses.
        rigs: How the sweeps of each object differed from the tables.
        answers: By poses, model and object, counts of the shape [gaps, angles, 8].
        unseen: By poses and object, the score of the default response for an object that it was not fitted to.
    """

    tables: Mapping[str, Samples]
    rigs: Mapping[str, Rig]
    answers: Mapping[str, Mapping[str, Mapping[str, Floats]]]
    unseen: Mapping[str, Mapping[str, Score]]

    def errors(
        self, model: str, objects: Sequence[str] | None = None, half: str = HELD_OUT, poses: str = FOUND
    ) -> Floats:
        """Return predicted less measured counts of the active cells [counts], shape [cells]."""
        parts = []
        for name in objects or list(self.tables):
            counts = self.tables[name].counts[:, HALVES[half]]
            answer = self.answers[poses][model][name][:, HALVES[half]]
            parts.append((answer - counts)[is_active(counts)])
        return np.concatenate(parts)

    def score(
        self, model: str, objects: Sequence[str] | None = None, half: str = HELD_OUT, poses: str = FOUND
    ) -> Score:
        """Return a model's score; for all objects if none is named, on the held-out half, at the poses found."""
        return Score.of(self.errors(model, objects, half, poses))

    def half_distances_mm(self, name: str, model: str | None = None, poses: str = FOUND) -> Floats:
        """Return at which gap each sensor falls to half of the range, shape [8]; measured if no model is named."""
        table = self.tables[name]
        gap_mm = table.gap_mm + self.rigs[name].gap_mm if poses == FOUND else table.gap_mm
        return half_distances_mm(gap_mm, table.counts if model is None else self.answers[poses][model][name])

    def figures(self) -> Iterator[Figure]:
        """Return all numbers of the card; those without a part in their name are of the held-out half, at FOUND."""
        for model, poses in product(self.answers[FOUND], (FOUND, TOLD)):
            title = f"accuracy.{model}" if poses == FOUND else f"accuracy.{model}_{poses}"
            parts: list[tuple[str, Sequence[str] | None, str]] = [("", None, HELD_OUT)]
            parts += [(f"_{name}_{half}", [name], half) for name in self.tables for half in HALVES]
            parts += [(f"_{half}", None, half) for half in HALVES if half != HELD_OUT]
            for suffix, objects, half in parts:
                for measure, value in vars(self.score(model, objects, half, poses)).items():
                    yield Figure(f"{title}{suffix}_{measure}_counts", round(value, 2), "counts")
            for name in self.tables:
                off_mm = self.half_distances_mm(name, model, poses) - self.half_distances_mm(name, poses=poses)
                for sensor in range(SENSOR_COUNT):
                    label = f"{title}_{name}_sensor_{sensor}_half_distance_error_mm"
                    yield Figure(label, round(float(off_mm[sensor]), 3), "mm")
        for poses, name in product((FOUND, TOLD), self.tables):
            title = "accuracy.default" if poses == FOUND else f"accuracy.default_{poses}"
            for measure, value in vars(self.unseen[poses][name]).items():
                yield Figure(f"{title}_unseen_{name}_{measure}_counts", round(value, 2), "counts")


def smoothed(counts: NDArray[Any]) -> Floats:
    """Return the mean of each reading and the three on either side of it along the angle."""
    return np.asarray(np.mean([np.roll(counts, shift, axis=1) for shift in range(-3, 4)], axis=0))


def half_distances_mm(gap_mm: Floats, counts: NDArray[Any]) -> Floats:
    """Return the gap at which each sensor reads half of 1023, at its best angle, shape [8].

    The best angle is where a sensor reads most over all gaps; readings are means of seven neighbouring angles. A sensor
    that never reads as much, or always, gets the end of the table.
    """
    curves = smoothed(counts)
    best = curves.sum(axis=0).argmax(axis=0)
    found = np.empty(SENSOR_COUNT)
    for sensor in range(SENSOR_COUNT):
        curve = curves[:, best[sensor], sensor]
        below = np.nonzero(curve < MAXIMUM_COUNTS / 2)[0]
        if len(below) == 0 or below[0] == 0:
            found[sensor] = gap_mm[0 if len(below) else -1]
            continue
        i = below[0]
        share = (curve[i - 1] - MAXIMUM_COUNTS / 2) / (curve[i - 1] - curve[i])
        found[sensor] = gap_mm[i - 1] + share * (gap_mm[i] - gap_mm[i - 1])
    return found


def data_folder(given: str | Path | None = None) -> Path:
    """Return the folder of the samples: the one given, that below `KIKS_SHARED`, or that beside the repository.

    Raises:
        ParameterError: If there is no such folder.
    """
    shared = Path(os.environ.get("KIKS_SHARED") or _REPOSITORY.parent / "shared")
    folder = Path(given) if given is not None else shared / "data" / "khepera-samples"
    if not (folder / "wall.npz").is_file():
        raise ParameterError(
            f"The measured samples (wall.npz, cylinder.npz) must lie in the data folder, but {str(folder)!r} has none. "
            "Name their folder with --data, or the one above data/khepera-samples in KIKS_SHARED."
        )
    return folder


def load_tables(folder: Path) -> dict[str, Samples]:
    """Return the measured samples of a folder by object.

    Raises:
        ParameterError: If one of its files is missing or broken.
    """
    return {name: load_samples(folder / f"{name}.npz", radius_mm=radius) for name, radius in OBJECTS.items()}


def make_card(tables: Mapping[str, Samples]) -> Card:
    """Find the poses by the half that is not held out, and ask every model for every sample."""
    seen = [table.at_angles(HALVES["even"]) for table in tables.values()]
    rigs = dict(zip(tables, find_rigs(seen, RobotSpec.load("khepera")), strict=True))
    poses = {FOUND: {name: rigs[name].moved(table) for name, table in tables.items()}, TOLD: tables}
    answers = {
        which: {key: {name: model(table) for name, table in there.items()} for key, (_, model) in MODELS.items()}
        for which, there in poses.items()
    }
    return Card(tables, rigs, answers, _unseen(tables))


def _unseen(tables: Mapping[str, Samples]) -> dict[str, dict[str, Score]]:
    """Fit the default response to all objects but one and ask it about that one: by poses and object, its score."""
    base = RobotSpec.load("khepera")
    assert base.reflection is not None
    # It must not begin with what it knows of the object already.
    alike = {f"reflection__{key}": (float(np.mean(getattr(base.reflection, key))),) * SENSOR_COUNT for key in _FITTED}
    scores: dict[str, dict[str, Score]] = {FOUND: {}, TOLD: {}}
    for name, table in tables.items():
        others = [other.at_angles(HALVES["even"]) for each, other in tables.items() if each != name]
        spec = fit_robot(others, base.with_changes(**alike)).spec
        (rig,) = find_rigs([table.at_angles(HALVES["even"])], spec)
        for poses, samples in ((FOUND, rig.moved(table)), (TOLD, table)):
            answers, readings = active_pairs(spec, [samples.at_angles(HALVES[HELD_OUT])])
            scores[poses][name] = Score.of(answers - readings)
    return scores


def page(card: Card) -> str:
    """Return the page `docs/explanation/accuracy.md`: the card in Markdown."""
    cells = int(sum(is_active(table.counts[:, HALVES[HELD_OUT]]).sum() for table in card.tables.values()))
    lines = [
        "# How true the proximity sensors are",
        "",
        "`python tools/accuracy.py --page docs/explanation/accuracy.md` makes this page from readings of a real",
        "Khepera. They are in `data/khepera-samples` of the shared folder, with a README that names their source.",
        "The robot stood at 20 gaps from 5 to 43 mm in front of a wall and of a cylinder of its own size, and",
        "turned in steps of 2 degrees. A test fails when these figures differ from those of the program.",
        "[Samples](../howto/samples.md) tells how to fit readings of your own.",
        "",
        "## Absolute errors [counts]",
        "",
        f"Over the {cells} active cells of the held-out half: measured readings between {ACTIVE_COUNTS[0]} and "
        f"{ACTIVE_COUNTS[1]} at angles with an",
        "odd index. The default, the networks and their table were fitted to the even ones. The last line predicts",
        "each reading from the two beside it, and shows about the noise of the data.",
        "",
        *_score_table(card, FOUND),
        "",
        "All models get the same poses: those at which the rig really was, estimated from the even angles. The tables",
        "say where it should have been. A hand set each gap, and the robot turned by its own wheels. The eight sensors",
        "look different ways and agree on how far each sweep was off, as the default model sees it. Root mean square",
        "over the sweeps that saw something:",
        "",
        *_rig_table(card),
        "",
        "## The same at the poses of the tables [counts]",
        "",
        "Here the rig's errors count as errors of the models. Only a model that has memorized this rig could do much",
        "better, and it would fail on a real robot.",
        "",
        *_score_table(card, TOLD),
    ]
    lines += [
        "",
        "## An unseen shape [counts]",
        "",
        "The default response is fitted to one of the objects alone and tested on the held-out half of the other: at",
        "the poses that the fitted robot estimates, and at those of the table.",
        "",
        "| object | poses | median | mean | 95 % | maximum |",
        "|---|---|---|---|---|---|",
    ]
    for name, poses in product(card.tables, (FOUND, TOLD)):
        score = card.unseen[poses][name]
        figures = f"{score.median:.1f} | {score.mean:.1f} | {score.p95:.0f} | {score.max:.0f}"
        lines.append(f"| {name} | {poses} | {figures} |")
    columns = [(name, half) for name in card.tables for half in ("odd", "even")]
    lines += [
        "",
        "## By object and half: median / mean / 95 % / maximum [counts]",
        "",
        "| model | " + " | ".join(f"{name}, {half}" for name, half in columns) + " |",
        "|---|" + "---|" * len(columns),
    ]
    for key, (title, _) in MODELS.items():
        scores = [card.score(key, [name], half) for name, half in columns]
        entries = [f"{s.median:.0f} / {s.mean:.0f} / {s.p95:.0f} / {s.max:.0f}" for s in scores]
        lines.append(f"| {title} | " + " | ".join(entries) + " |")
    for name in card.tables:
        lines += [
            "",
            f"## 50 % distance, {name} [mm]",
            "",
            "Gap at which a sensor reads 512 at its best angle (mean of seven neighbouring angles): as measured, and",
            "the error of each model.",
            "",
            "| | " + " | ".join(f"sensor {sensor}" for sensor in range(SENSOR_COUNT)) + " |",
            "|---|" + "---|" * SENSOR_COUNT,
        ]
        measured_mm = card.half_distances_mm(name)
        lines.append("| measured | " + " | ".join(f"{gap:.1f}" for gap in measured_mm) + " |")
        for key, (title, _) in MODELS.items():
            if key != "floor":
                off_mm = card.half_distances_mm(name, key) - measured_mm
                lines.append(f"| {title} | " + " | ".join(f"{off:+.1f}" for off in off_mm) + " |")
    return "\n".join(lines) + "\n"


def _score_table(card: Card, poses: str) -> list[str]:
    lines = ["| model | median | mean | 95 % | maximum |", "|---|---|---|---|---|"]
    for key, (title, _) in MODELS.items():
        score = card.score(key, poses=poses)
        lines.append(f"| {title} | {score.median:.1f} | {score.mean:.1f} | {score.p95:.0f} | {score.max:.0f} |")
    return lines


def _rig_table(card: Card) -> list[str]:
    lines = ["| object | gap [mm] | angle [deg] | turn beyond 360 degrees [deg] |", "|---|---|---|---|"]
    for name, rig in card.rigs.items():
        saw = is_active(card.tables[name].counts).any(axis=(1, 2))
        sizes = [float(np.sqrt(np.mean(part[saw] ** 2))) for part in (rig.gap_mm, rig.angle_deg, rig.turn_deg)]
        lines.append(f"| {name} | " + " | ".join(f"{size:.1f}" for size in sizes) + " |")
    return lines

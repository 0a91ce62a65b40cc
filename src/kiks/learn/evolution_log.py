"""The files of an evolution: its generations, from which it can resume, and a log for people and programs.

If the process is killed, all generations but the current one are safe, and the log is readable: each generation is a
small file of its own, and files appear complete, in one step, after their bytes are on the disk. The log is rewritten
from all generations each time.
"""

from __future__ import annotations

import io
import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from kiks.errors import ParameterError, counted, shown
from kiks.export.tables import write_parquet
from kiks.learn.finals import Contender, Finals, MasterTournament
from kiks.learn.fingerprint import differing
from kiks.learn.task import Axis
from kiks.meant import nearest_file
from kiks.model.array_checks import Numbers, read_arrays
from kiks.model.atomic_files import make_folder, path_of, replace_file
from kiks.model.data_file import Rule, Text, Whole, check, parse_json, read_file, record
from kiks.model.settings import Seed

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

Digest = Annotated[
    dict[Text, Text], Field(max_length=100), Rule("a table with a fingerprint of each argument of the task")
]

IDENTITY, GENERATIONS, LOG, CHAMPION = "evolution.json", "generations", "log.parquet", "champion.toml"
TOURNAMENT = "tournament.parquet"
"""Names in the folder."""

TRIALS = 8
"""Trials of a rival, each in as many worlds as a candidate of the population gets."""

_ADVICE = "Remove the file, and those after it."
_FINALS_ADVICE = "Remove the file: then the finals are held again."


@record
class Identity:
    """The properties that identify an evolution, and what its generations consist of.

    Attributes:
        task_file: The file of its task, which may be moved.
        sides: Number of parameters of a candidate of each side, by the name of the side.
        measures: Names of the measures.
        axes: Axes of the archive.
    """

    task: Text
    algorithm: Text
    seed: Seed
    population: Annotated[Whole, Field(ge=1, le=1_000_000)]
    controller: Text
    task_digest: Digest
    kiks: Text
    task_file: Text
    sides: Annotated[dict[Text, Annotated[Whole, Field(ge=1, le=1_000_000)]], Field(min_length=1, max_length=2)]
    measures: Annotated[tuple[Text, ...], Field(min_length=1, max_length=100)]
    axes: Annotated[tuple[Axis, ...], Field(max_length=100)]


@dataclass(frozen=True)
class Generation:
    """A generation with its values.

    Attributes:
        candidates: The candidates, float64 [candidate, parameter]: the population, of two sides the one beside the
            other, then the trials of a rival.
        values: Their values, float64 [candidate, value]: fitness, then measures; of two sides, one after the other,
            each the mean over its opponents.
        seeds: Seeds of their worlds, int64 [candidate]; of two sides, those with their first opponents.
        population: Size of the population of a side.
        evaluations: Number of evaluations.
        champion_fitness: Fitness of the best rival so far; NaN before the first.
        seconds: Time of its end [s of the wall clock, since the evolution began].
    """

    candidates: Floats
    values: Floats
    seeds: Integers
    population: int
    evaluations: int
    champion_fitness: float
    seconds: float

    def __repr__(self) -> str:
        return f"<Generation of {counted(self.population, 'candidate')}: best fitness {self.fitness.max():.4g}>"

    @property
    def fitness(self) -> Floats:
        """Fitness of the population, of two sides that of the first, float64 [candidate]."""
        return self.fitness_of(0)

    def fitness_of(self, side: int) -> Floats:
        """Return the fitness of the population of a side, float64 [candidate]."""
        second = self.values.shape[1] // 2
        return self.values[: self.population, second if side else 0]


def check_alike(
    one: Any, other: Any, names: Collection[str], whose: str, advice: str, free: Collection[str] = ()
) -> None:
    """Check that identities or results have the same attributes, and tasks that are the same but for some arguments."""
    for name in names:
        if (known := getattr(one, name)) != (value := getattr(other, name)):
            raise ParameterError(
                f"{whose} must have the same {name}, but they have {shown(known)} and {shown(value)}. {advice}"
            )
    if found := differing(one.task_digest, other.task_digest, free):
        raise ParameterError(f"{whose} must have the same task, but these differ: {shown(found)[1:-1]}. {advice}")


class EvolutionFolder:
    """The folder of an evolution.

    Args:
        path: The folder.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = path_of(path, "folder")

    def champion_file(self, side: str = "") -> Path:
        """Return the file of the champion, or of the champion of a side of two."""
        return self.path / (f"{side}.toml" if side else CHAMPION)

    def identity(self) -> Identity:
        """Return the identity of the evolution in the folder."""
        file = self.path / IDENTITY
        if not file.exists():
            raise ParameterError(
                f"{str(self.path)!r} must be the folder of an evolution, but it has no {IDENTITY}. "
                f"Name one that `kiks evolve` has written.{nearest_file(self.path) if not self.path.exists() else ''}"
            )
        what = f"The record of an evolution {str(file)!r}"
        return check(Identity, parse_json(read_file(file, what), what), what, advice="Take a new folder.")

    def check_identity(self, identity: Identity) -> None:
        """Write the identity of an evolution into the folder, or compare it with the one that is there."""
        file = self.path / IDENTITY
        champions = [each for side in identity.sides if (each := self.champion_file(side)).exists()]
        if champions and not file.exists():
            raise ParameterError(
                f"the folder {str(self.path)!r} must hold an evolution or no {champions[0].name}, but it holds one "
                f"without {IDENTITY}, which would be replaced. Take a new folder."
            )
        make_folder(self.path / GENERATIONS, "an evolution")
        if not file.exists():
            replace_file(file, json.dumps(asdict(identity), indent=1) + "\n", "an evolution")
            return
        names = ("task", "algorithm", "seed", "population", "controller", "kiks")
        advice = "Take a new folder, or go back to the arguments of the evolution that it holds."
        check_alike(self.identity(), identity, names, f"the evolution in {str(self.path)!r} and yours", advice)

    def generation(self, number: int, identity: Identity) -> dict[str, NDArray[Any]]:
        """Return candidates, values and seconds of a saved generation, whose number counts from 0."""
        # There may be a rival on trial or not: the first generation has none, nor has one after all elites were tried.
        counts = (identity.population, identity.population + TRIALS)
        side_count, parameter_count = len(identity.sides), sum(identity.sides.values())
        value_count = side_count * (1 + len(identity.measures))
        rules = {
            "candidates": Numbers(("candidate", parameter_count), advice=_ADVICE),
            "values": Numbers(("candidate", "value"), advice=_ADVICE),
            "seconds": Numbers((), low=0.0, advice=_ADVICE),
        }
        file, what = self._file(number), f"Generation {str(self._file(number))!r}"
        arrays = read_arrays(file, rules, what, numbers_max=counts[1] * (parameter_count + value_count) + 1)
        for name, axis, known in (("candidates", 0, counts), ("values", 1, (side_count, value_count))):
            if (count := arrays[name].shape[axis]) not in known:
                raise ParameterError(
                    f"{what}: {name} must be {known[0]} or {known[1]}, but their number was {count}. {_ADVICE}"
                )
        return arrays

    def generation_count(self) -> int:
        """Return the number of saved generations."""
        number = 0
        while self._file(number).exists():
            number += 1
        return number

    def save(self, number: int, generation: Generation) -> None:
        """Save a generation."""
        arrays = {"candidates": generation.candidates, "values": generation.values}
        _save_arrays(self._file(number), arrays, generation.seconds, "a generation")

    def saved_finals(
        self, number: int, finalists: Sequence[Contender], evaluation_count: int, value_count: int
    ) -> Finals | None:
        """Return the finals that were held after a generation; None if there are none.

        Args:
            number: Number of the generation, from 0.
            finalists: The finalists of this evolution.
            evaluation_count: Number of evaluations.
            value_count: Number of values of a candidate.
        """
        file, what = self._finals_file(number), f"Finals {str(self._finals_file(number))!r}"
        if not file.exists():
            return None
        parameters = np.array([each.parameters for each in finalists])
        whole: dict[str, Any] = {"is_whole": True, "advice": _FINALS_ADVICE}
        rules = {
            "finalists": Numbers(parameters.shape, advice=_FINALS_ADVICE),
            "finalist": Numbers((evaluation_count,), 0, len(finalists) - 1, **whole),
            "seed": Numbers((evaluation_count,), **whole),
            "values": Numbers((evaluation_count, value_count), advice=_FINALS_ADVICE),
            "seconds": Numbers((), low=0.0, advice=_FINALS_ADVICE),
        }
        found = read_arrays(file, rules, what, numbers_max=parameters.size + evaluation_count * (value_count + 2) + 1)
        numbers = found["finalist"].astype(np.int64)
        if not np.array_equal(parameters, found["finalists"]) or len(np.unique(numbers)) < len(finalists):
            raise ParameterError(f"{what} must have the finalists of this evolution, but has others. {_FINALS_ADVICE}")
        seeds = found["seed"].astype(np.int64)
        return Finals(tuple(finalists), numbers, seeds, found["values"], float(found["seconds"]))

    def save_finals(self, number: int, finals: Finals) -> None:
        """Save the finals that were held after a generation, whose number counts from 0."""
        parameters = np.array([each.parameters for each in finals.finalists])
        arrays = {"finalists": parameters, "finalist": finals.numbers, "seed": finals.seeds, "values": finals.values}
        _save_arrays(self._finals_file(number), arrays, finals.seconds, "finals")

    def save_log(self, generations: Sequence[Generation], value_names: Sequence[str]) -> None:
        """Write the log of all generations, a row for each evaluation: the population, then the trials of a rival."""
        counts = [len(each.values) for each in generations]
        width = min(each.values.shape[1] for each in generations)  # fitness alone, if one generation has no more
        numbers = np.arange(1, len(generations) + 1)
        is_trial = [np.arange(count) >= each.population for count, each in zip(counts, generations, strict=True)]
        columns: dict[str, Any] = {
            "generation": np.repeat(numbers, counts),
            "candidate": np.concatenate([np.arange(count) for count in counts]),
            "is_trial": np.concatenate(is_trial),
            "seed": np.concatenate([each.seeds for each in generations]),
        }
        values = np.concatenate([each.values[:, :width] for each in generations])
        columns |= dict(zip(value_names, values.T, strict=False))
        columns["champion_fitness"] = np.repeat([each.champion_fitness for each in generations], counts)
        columns["seconds"] = np.repeat([each.seconds for each in generations], counts)
        columns["evaluations"] = np.repeat(np.cumsum([each.evaluations for each in generations]), counts)
        write_parquet(columns, self.path / LOG, "the log")

    def save_tournament(self, tournament: MasterTournament) -> None:
        """Save a tournament, a row for each pair: the generations of both sides, and the fitness of both."""
        places = np.meshgrid(tournament.generations, tournament.generations, indexing="ij")
        columns = {f"{side}_generation": place.ravel() for side, place in zip(tournament.sides, places, strict=True)}
        columns |= {side: scores.ravel() for side, scores in zip(tournament.sides, tournament.scores, strict=True)}
        write_parquet(columns, self.path / TOURNAMENT, "the tournament")

    def _file(self, number: int) -> Path:
        return self.path / GENERATIONS / f"{number + 1:06}.npz"

    def _finals_file(self, number: int) -> Path:
        return self.path / GENERATIONS / f"{number + 1:06}_finals.npz"


def _save_arrays(file: Path, arrays: Mapping[str, Any], seconds: float, what: str) -> None:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays, seconds=np.float64(seconds))
    replace_file(file, buffer.getvalue(), what)

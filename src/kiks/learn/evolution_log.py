"""The files of an evolution: its generations, from which it can resume, and a log for people and programs.

If the process is killed, all generations but the current one are safe, and the log is readable: each generation is a
small file of its own, and files appear complete, in one step, after their bytes are on the disk. The log is rewritten
from all generations each time.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from kiks.errors import ParameterError, shown
from kiks.export.tables import write_parquet
from kiks.learn.finals import Finals
from kiks.learn.fingerprint import differing, tell_unseen
from kiks.model.array_checks import Numbers, read_arrays
from kiks.model.atomic_files import make_folder, path_of, replace_file
from kiks.model.data_file import Rule, Text, Whole, check, parse_json, read_file, record

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

Digest = Annotated[
    dict[Text, Text], Field(max_length=100), Rule("a table with a fingerprint of each argument of the task")
]

IDENTITY, GENERATIONS, LOG = "evolution.json", "generations", "log.parquet"
"""Names in the folder."""

_ADVICE = "Remove the file, and those after it."
_FINALS_ADVICE = "Remove the file: then the finals are held again."


@record
class Identity:
    """The properties that identify an evolution, and the file of its task, which may be moved."""

    task: Text
    algorithm: Text
    seed: Annotated[Whole, Field(ge=0, lt=2**63)]
    population: Annotated[Whole, Field(ge=1, le=1_000_000)]
    controller: Text
    task_digest: Digest
    kiks: Text
    task_file: Text = ""

    @property
    def is_contest(self) -> bool:
        """Whether two sides evolve."""
        return "sides" in self.task_digest


@dataclass(frozen=True)
class Generation:
    """A generation with its values.

    Attributes:
        candidates: All evaluated candidates, float64 [candidate, parameter]: the population, then trials of a rival.
        values: Their values, float64 [candidate, value]: fitness, then measures.
        seeds: Seeds of their worlds, int64 [candidate]; in a co-evolution, those of their first contests.
        population: Size of the population.
        champion_fitness: Fitness of the best rival so far; NaN before the first.
        seconds: Time of its end [s of the wall clock, since the evolution began].
    """

    candidates: Floats
    values: Floats
    seeds: Integers
    population: int
    champion_fitness: float
    seconds: float

    @property
    def fitness(self) -> Floats:
        """Fitness of the population, float64 [candidate]."""
        return self.values[: self.population, 0]


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
        raise ParameterError(f"{whose} must have the same task, but these differ: {found}. {advice}")


class Folder:
    """The folder of an evolution.

    Args:
        path: The folder.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = path_of(path, "folder")

    def identity(self) -> Identity:
        """Return the identity of the evolution in the folder."""
        file = self.path / IDENTITY
        if not file.exists():
            raise ParameterError(
                f"{str(self.path)!r} must be the folder of an evolution, but it has no {IDENTITY}. "
                "Name one that `kiks evolve` has written."
            )
        what = f"The record of an evolution {str(file)!r}"
        return check(Identity, parse_json(read_file(file, what), what), what, advice="Take a new folder.")

    def check_identity(self, identity: Identity) -> None:
        """Write the identity of an evolution into the folder, or compare it with the one that is there."""
        file = self.path / IDENTITY
        if not file.exists() and (self.path / "champion.toml").exists():
            raise ParameterError(
                f"the folder {str(self.path)!r} must hold an evolution or no champion.toml, but it holds one without "
                f"{IDENTITY}, which would be replaced. Take a new folder."
            )
        make_folder(self.path / GENERATIONS, "an evolution")
        if not file.exists():
            replace_file(file, json.dumps(asdict(identity), indent=1) + "\n", "an evolution")
            tell_unseen(identity.task_digest, f"The evolution in {str(self.path)!r} continues")
            return
        names = ("task", "algorithm", "seed", "population", "controller", "kiks")
        advice = "Take a new folder, or go back to the arguments of the evolution that it holds."
        check_alike(self.identity(), identity, names, f"the evolution in {str(self.path)!r} and yours", advice)

    def generation(
        self, number: int, candidate_counts: Collection[int], parameter_count: int, value_count: int
    ) -> dict[str, NDArray[Any]] | None:
        """Return candidates, values and seconds of a saved generation; None if there is none.

        Args:
            number: Number of the generation, from 0.
            candidate_counts: Numbers of candidates of which it must have one.
            parameter_count: Number of parameters of a candidate.
            value_count: Largest number of values of a candidate.
        """
        file = self._file(number)
        if not file.exists():
            return None
        rules = {
            "candidates": Numbers(("candidate", parameter_count), advice=_ADVICE),
            "values": Numbers(("candidate", "value"), advice=_ADVICE),
            "seconds": Numbers((), low=0.0, advice=_ADVICE),
        }
        what, numbers_max = f"Generation {str(file)!r}", max(candidate_counts) * (parameter_count + value_count) + 1
        arrays = read_arrays(file, rules, what, numbers_max=numbers_max)
        if (count := len(arrays["candidates"])) not in candidate_counts:
            wanted = " or ".join(map(str, candidate_counts))
            raise ParameterError(f"{what}: candidates must be {wanted}, but their number was {count}. {_ADVICE}")
        return arrays

    def saved_generations(self, ask: Callable[[], Floats], value_count: int) -> Iterator[tuple[Floats, float]]:
        """Yield values and seconds of the saved generations, for an evolution that begins anew.

        Args:
            ask: Returns the candidates that the evolution has for its next generation, float64 [candidate, parameter].
            value_count: Largest number of values of a candidate.
        """
        number = 0
        while (saved := self.generation(number, ask().shape[:1], ask().shape[1], value_count)) is not None:
            number += 1
            if not np.array_equal(ask(), saved["candidates"]):
                raise ParameterError(
                    f"the evolution in {str(self.path)!r} must continue to the bit, but generation {number} would have "
                    "other candidates here: the libraries or the computer have changed. Continue on the computer where "
                    "it began, or take a new folder."
                )
            yield saved["values"], float(saved["seconds"])

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

    def saved_finals(self, number: int, finals: Finals) -> tuple[Floats, float] | None:
        """Return the values of saved finals, float64 [evaluation, value], and their seconds; None if there are none.

        Args:
            number: Number of the generation after which they were held, from 0.
            finals: Finals with the same finalists, before their first round.
        """
        file, what = self._finals_file(number), f"Finals {str(self._finals_file(number))!r}"
        if not file.exists():
            return None
        finalists, count = finals.candidates, finals.evaluation_count
        rules = {
            "finalists": Numbers(finalists.shape, advice=_FINALS_ADVICE),
            "values": Numbers((count, finals.value_count), advice=_FINALS_ADVICE),
            "seconds": Numbers((), low=0.0, advice=_FINALS_ADVICE),
        }
        # Beside these the file holds the finalist and the seed of each evaluation.
        numbers_max = finalists.size + count * (finals.value_count + 2) + 1
        arrays = read_arrays(file, rules, what, numbers_max=numbers_max)
        if not np.array_equal(finalists, arrays["finalists"]):
            raise ParameterError(f"{what} must have the finalists of this evolution, but has others. {_FINALS_ADVICE}")
        return arrays["values"], float(arrays["seconds"])

    def save_finals(self, number: int, finals: Finals) -> None:
        """Save finals that are over.

        Args:
            number: Number of the generation after which they were held, from 0.
            finals: The finals.
        """
        numbers, seeds, values = finals.evaluated
        arrays: dict[str, Any] = {"finalists": finals.candidates, "finalist": numbers, "seed": seeds, "values": values}
        _save_arrays(self._finals_file(number), arrays, finals.seconds, "finals")

    def save_log(self, generations: Sequence[Generation], value_names: Sequence[str]) -> None:
        """Write the log of all generations, a row for each evaluation: the population, then the trials of a rival."""
        counts = [len(each.values) for each in generations]

        def per_candidate(values: Sequence[float]) -> NDArray[Any]:
            return np.repeat(np.array(values), counts) if counts else np.zeros(0)

        columns: dict[str, Any] = {
            "generation": per_candidate(range(1, len(counts) + 1)).astype(np.int64),
            "candidate": np.concatenate([np.zeros(0, np.int64), *map(np.arange, counts)]).astype(np.int64),
        }
        populations = per_candidate([each.population for each in generations])
        columns["is_trial"] = columns["candidate"] >= populations
        columns["seed"] = np.concatenate([np.zeros(0, np.int64), *(each.seeds for each in generations)])
        values = [each.values for each in generations]
        table = np.concatenate(values) if values else np.zeros((0, len(value_names)))
        columns |= {name: table[:, number] for number, name in enumerate(value_names[: table.shape[1]])}
        columns["champion_fitness"] = per_candidate([each.champion_fitness for each in generations])
        columns["seconds"] = per_candidate([each.seconds for each in generations])
        columns["evaluations"] = per_candidate(np.cumsum(counts).tolist()).astype(np.int64)
        write_parquet(columns, self.path / LOG, "the log")

    def _file(self, number: int) -> Path:
        return self.path / GENERATIONS / f"{number + 1:06}.npz"

    def _finals_file(self, number: int) -> Path:
        return self.path / GENERATIONS / f"{number + 1:06}_finals.npz"


def _save_arrays(file: Path, arrays: Mapping[str, Any], seconds: float, what: str) -> None:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays, seconds=np.float64(seconds))
    replace_file(file, buffer.getvalue(), what)

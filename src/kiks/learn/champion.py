"""A champion: a controller with its parameters, and how to make it drive, in a file that people can read."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import kiks
from kiks.batch.timing import Timing
from kiks.client.drive import Driver, drive
from kiks.client.khepera import Port
from kiks.control.controller import Controller
from kiks.control.controllers import from_recipe, recipe_for
from kiks.errors import ParameterError, nearest
from kiks.model.arena import Arena
from kiks.model.files import replace_files
from kiks.sim.simulation import Simulation

FORMAT = 1
"""Version of the file's format."""

_TOP = ("champion", "task", "fitness", "generation", "algorithm", "seed", "robot", "kiks", "parameters")
_SECTIONS = ("timing", "controller", "measures")
_NEEDED = ("champion", "robot", "parameters", "timing", "controller")


@dataclass(frozen=True, eq=False)
class Champion:
    """A controller with its parameters.

    Attributes:
        controller: The controller.
        parameters: Its parameters.
        task: Name of the task that it was evolved for.
        fitness: What it is worth there.
        measures: What was measured there, on average.
        generation: In which generation it was found.
        algorithm: By which algorithm.
        seed: Seed of its evolution.
        robot: The kind of robot that it drives.
        timing: The pace of its loop.
        kiks: Version of KiKS that found it.
    """

    controller: Controller
    parameters: tuple[float, ...]
    task: str = ""
    fitness: float = 0.0
    measures: Mapping[str, float] = field(default_factory=dict)
    generation: int = 0
    algorithm: str = ""
    seed: int = 0
    robot: str = "khepera"
    timing: Timing = field(default_factory=Timing)
    kiks: str = kiks.__version__

    def drive(self, port: str | Port | Sequence[str | Port], *, seconds: float) -> int:
        """Let it drive one or more robots, simulated or real; see `kiks.drive`.

        Returns:
            How many loops there were.

        Raises:
            ParameterError: If seconds are out of range.
            LinkError: If a port cannot be opened, or a robot does not answer as it should.
        """
        period_s = self.timing.period_s
        return drive(port, self.controller, self.parameters, seconds=seconds, period_s=period_s, baud=self.baud)

    def driver(self, port: str | Port | Sequence[str | Port]) -> Driver:
        """Return what lets it drive one or more robots loop by loop.

        Raises:
            LinkError: If a port cannot be opened.
        """
        return Driver(port, self.controller, self.parameters, period_s=self.timing.period_s, baud=self.baud)

    @property
    def baud(self) -> int:
        """Speed of its lines [bit/s]: the fastest of a Khepera if it was evolved without a line."""
        return self.timing.baud or 57600

    def simulation(self, arena: Arena, *, robots: int = 1, seed: int = 0) -> tuple[Simulation, list[Port]]:
        """Return a world of its robots and pace, and the ports of the robots.

        Raises:
            ParameterError: If an argument is out of range.
            ArenaError: If there is no free place for a robot.
        """
        think_s = self.timing.think_s
        thinking = f"fixed:{think_s * 1e3:g}" if think_s else "none"
        sim = Simulation(arena, robots=robots, seed=seed, robot=self.robot, thinking=thinking)
        ports: list[Port] = []
        for number in range(1, robots + 1):
            port = sim.port(number)
            port.baudrate = self.baud
            ports.append(port)
        return sim, ports

    # ---- files ----

    def save(self, path: str | Path) -> None:
        """Write it into a file that `load` reads; a user's file with its controller goes beside it.

        Raises:
            ParameterError: If the file cannot be written, or the controller stands in no file.
        """
        target = Path(path)
        recipe = recipe_for(self.controller, target.parent)
        files: dict[Path, bytes | str] = {}
        if "file" in recipe:
            beside = target.with_name(f"{target.stem}_controller.py")
            files[beside] = _bytes_of(target.parent / recipe["file"])
            recipe = {"file": beside.name, "name": recipe["name"]}
        files[target] = self._text(recipe)
        replace_files(files, "a champion")

    def _text(self, recipe: Mapping[str, Any]) -> str:
        top = {"champion": FORMAT} | {name: getattr(self, name) for name in _TOP[1:-1]}
        lines = [
            "# A controller for Khepera robots. See it: kiks demo FILE. Let it drive: kiks run FILE.",
            *(f"{name} = {_word(value)}" for name, value in top.items()),
            "parameters = [",
            *(f"    {value!r}," for value in self.parameters),
            "]",
        ]
        sections = {"timing": asdict(self.timing), "controller": recipe, "measures": self.measures}
        for section, entries in sections.items():
            lines += ["", f"[{section}]"]
            lines += [f"{name} = {_word(value)}" for name, value in entries.items() if value is not None]
        return "\n".join(lines) + "\n"

    @classmethod
    def load(cls, path: str | Path) -> Champion:
        """Read a champion's file. If its controller is a user's, the file of that is run.

        Raises:
            ParameterError: If it is none.
        """
        try:
            content = tomllib.loads(Path(path).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise ParameterError(f"{str(path)!r} must be a champion's file, but: {error}.") from None
        try:
            return _champion_of(content, Path(path).parent)
        except (ParameterError, TypeError) as error:
            raise ParameterError(f"{str(path)!r} must be a champion's file, but: {error}") from None


def is_champion(path: str | Path) -> bool:
    """Say whether a file says that it is a champion's, right or wrong in all else."""
    try:
        return "champion" in tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False


def _champion_of(content: dict[str, Any], folder: Path) -> Champion:
    """Return the champion of a file's content."""
    known = (*_TOP, *_SECTIONS)
    for key in content:
        if key not in known:
            raise ParameterError(f"there is a key {key!r}, which is unknown.{nearest(key, known)}")
    for key in _NEEDED:
        if key not in content:
            raise ParameterError(f"there must be a key {key!r}, and there is none.")
    if content["champion"] != FORMAT:
        raise ParameterError(
            f"champion must be {FORMAT}, the version of the format, but it was {content['champion']!r}."
        )
    texts = {"task": str, "algorithm": str, "robot": str, "kiks": str, "generation": int, "seed": int, "fitness": float}
    given: dict[str, Any] = {}
    for key, kind in texts.items():
        value = content.get(key)
        if value is not None:
            if not isinstance(value, (int, float) if kind is float else kind):
                raise ParameterError(f"{key} must be a {kind.__name__}, but it was {value!r}.")
            given[key] = value
    parameters = content["parameters"]
    if not isinstance(parameters, list) or not all(_is_number(value) for value in parameters):
        raise ParameterError(f"parameters must be a list of finite numbers, but they were {parameters!r:.60}.")
    timing: dict[str, Any] = {"baud": None} | dict(content["timing"])
    controller = from_recipe(content["controller"], folder)
    controller.check_parameters(parameters)
    return Champion(
        controller,
        tuple(float(value) for value in parameters),
        timing=Timing(**timing),
        measures=dict(content.get("measures", {})),
        **given,
    )


def _bytes_of(path: Path) -> bytes:
    """Return what is in the file of a user's controller.

    Raises:
        ParameterError: If it cannot be read.
    """
    try:
        return path.read_bytes()
    except OSError as error:
        raise ParameterError(f"the file of the controller, {str(path)!r}, must be there, but: {error}.") from None


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _word(value: object) -> str:
    """Return a value as TOML has it."""
    if isinstance(value, float):
        return repr(value)
    return json.dumps(list(value) if isinstance(value, tuple) else value, ensure_ascii=False)

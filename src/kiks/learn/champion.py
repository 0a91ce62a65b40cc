"""A champion: an evolved controller with its parameters, robot and timing, in a readable file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, field, fields
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from kiks.batch.loop_timing import Baud, Timing
from kiks.client.drive import Driver, drive
from kiks.client.port import Port
from kiks.control.controller import Controller
from kiks.control.controller_spec import Recipe
from kiks.control.controllers import controller_of, recipe_for
from kiks.model.arena import Arena
from kiks.model.arena_file import quoted
from kiks.model.atomic_files import path_of, replace_files
from kiks.model.data_file import Number, Text, Whole, as_list, check, parse_toml, read_file, record
from kiks.sim.simulation import Simulation
from kiks.version import __version__

FORMAT = 1
"""Version of the file's format."""

FILE_BYTES_MAX = 32 << 20
"""Largest size of a champion's file [byte]."""

PARAMETERS_MAX = 1_000_000
"""Largest number of parameters of a champion."""


Parameters = Annotated[tuple[Number, ...], BeforeValidator(as_list), Field(max_length=PARAMETERS_MAX)]
Measures = Annotated[dict[Text, Number], Field(max_length=1000)]
Generation = Annotated[Whole, Field(ge=0, lt=2**63)]
Seed = Annotated[Whole, Field(ge=0, lt=2**63)]


@record
class _FileTiming(Timing):
    """Timing of the control loop; without a baud rate there is no line."""

    baud: Baud | None = None


@record
class _ChampionFile:
    """The content of a champion's file."""

    champion: Annotated[Literal[1], Field(description="It is the version of the format.")]
    parameters: Parameters
    robot: Text
    timing: _FileTiming
    controller: Recipe
    task: Text = ""
    fitness: Number = 0.0
    generation: Generation = 0
    algorithm: Text = ""
    seed: Seed = 0
    kiks: Text = ""
    measures: Measures = field(default_factory=dict)


@record
class Champion:
    """A controller with its parameters.

    Attributes:
        controller: The controller.
        parameters: Its parameters.
        task: Name of the task for which it was evolved.
        fitness: Its fitness there.
        measures: Mean values of the measures there.
        generation: The generation that found it.
        algorithm: The algorithm that found it.
        seed: Seed of its evolution.
        robot: The kind of robot that it drives.
        timing: Timing of its control loop.
        kiks: Version of KiKS that found it.
    """

    controller: Controller
    parameters: Parameters
    task: Text = ""
    fitness: Number = 0.0
    measures: Measures = field(default_factory=dict)
    generation: Generation = 0
    algorithm: Text = ""
    seed: Seed = 0
    robot: Text = "khepera"
    timing: Timing = field(default_factory=Timing)
    kiks: Text = __version__

    # Functions cannot be compared: a champion equals itself only.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def __post_init__(self) -> None:
        self.controller.check_parameters(self.parameters)

    def drive(self, port: str | Port | Sequence[str | Port], *, seconds: float) -> int:
        """Drive one or more robots, simulated or real; see `kiks.drive`.

        Returns:
            Number of loops.

        Raises:
            ParameterError: If seconds are out of range.
            LinkError: If a port cannot be opened, or a robot does not answer as it should.
        """
        period_s = self.timing.period_s
        return drive(port, self.controller, self.parameters, seconds=seconds, period_s=period_s, baud=self.baud)

    def driver(self, port: str | Port | Sequence[str | Port]) -> Driver:
        """Return a driver of one or more robots, to call loop by loop.

        Raises:
            LinkError: If a port cannot be opened.
        """
        return Driver(port, self.controller, self.parameters, period_s=self.timing.period_s, baud=self.baud)

    @property
    def baud(self) -> int:
        """Speed of its lines [bit/s]: the highest baud rate of a Khepera if it was evolved without a line."""
        return self.timing.baud or 57600

    def simulation(self, arena: Arena, *, robots: int = 1, seed: int = 0) -> tuple[Simulation, list[Port]]:
        """Return a simulation with its kind of robot and its timing, and the ports of the robots.

        Raises:
            ParameterError: If an argument is out of range.
            ArenaError: If the arena has no free place for a robot.
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
        """Write a file that `load` reads; a Python file that defines the controller is copied beside it.

        Raises:
            ParameterError: If the file cannot be written, or the controller is not defined in a file.
        """
        target = path_of(path)
        recipe = recipe_for(self.controller, target.parent)
        files: dict[Path, bytes | str] = {}
        if "file" in recipe:
            copy = target.with_name(f"{target.stem}_controller.py")
            files[copy] = read_file(target.parent / recipe["file"], "the file of the controller")
            recipe = {"file": copy.name, "name": recipe["name"]}
        files[target] = self._text(recipe)
        replace_files(files, "a champion")

    def _text(self, recipe: Mapping[str, Any]) -> str:
        top = ("task", "fitness", "generation", "algorithm", "seed", "robot", "kiks")
        lines = [
            "# A controller for Khepera robots. See it: kiks demo FILE. Let it drive: kiks run FILE.",
            f"champion = {FORMAT}",
            *(f"{name} = {_toml_value(getattr(self, name))}" for name in top),
            "parameters = [",
            *(f"    {value!r}," for value in self.parameters),
            "]",
        ]
        sections = {"timing": asdict(self.timing), "controller": recipe, "measures": self.measures}
        for section, entries in sections.items():
            lines += ["", f"[{section}]"]
            lines += [
                f"{_toml_key(name)} = {_toml_value(value)}" for name, value in entries.items() if value is not None
            ]
        return "\n".join(lines) + "\n"

    @classmethod
    def load(cls, path: str | Path) -> Champion:
        """Read a champion's file. A controller from a Python file or module is imported, which runs its code.

        Raises:
            ParameterError: If the file does not hold a champion.
        """
        path = path_of(path)
        what = f"Champion's file {str(path)!r}"
        read = check(_ChampionFile, parse_toml(read_file(path, what, bytes_max=FILE_BYTES_MAX), what), what)
        controller = controller_of(read.controller, path.parent)
        given = {each.name: getattr(read, each.name) for each in fields(cls)}
        timing = Timing(**asdict(read.timing))
        return cls(**given | {"controller": controller, "timing": timing})


def _toml_key(name: str) -> str:
    """Return a name as a TOML key; names of measures may have letters that bare keys do not allow."""
    return name if name.isascii() and name.isidentifier() else quoted(name)


def _toml_value(value: Any) -> str:
    """Return a value in TOML."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml_value, value))}]"
    return quoted(value) if isinstance(value, str) else repr(value).lower()

"""A champion: an evolved controller with its parameters, robot and timing, in a readable file."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import asdict, field, fields, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from kiks.batch.loop_timing import Baud, Timing
from kiks.client.drive import drive
from kiks.client.port import Port, open_port
from kiks.control.controller import Controller
from kiks.control.controllers import Recipe, controller_of, recipe_for
from kiks.control.recipes import file_of
from kiks.control.turret_parts import turrets_of
from kiks.learn.fingerprint import COMPILED_HERE, fingerprints
from kiks.model.arena import Arena
from kiks.model.arena_file import toml, toml_key
from kiks.model.atomic_files import inside, path_of, replace_files
from kiks.model.checks import ROBOTS_MAX, check_count
from kiks.model.data_file import Number, Rule, Text, Whole, as_list, check, parse_toml, read_file, record
from kiks.model.limits import CHAMPION_FILE_BYTES_MAX
from kiks.model.project import Project, ProjectRobot
from kiks.model.robot import RobotSpec, robot_names, robot_toml, specs_of
from kiks.model.settings import Seed
from kiks.sim.from_project import simulation_of, with_kinds
from kiks.sim.simulation import Simulation
from kiks.upwards import shown_in_notebooks
from kiks.version import __version__

FORMAT = 1
"""Version of the file's format."""

PARAMETERS_MAX = 1_000_000
"""Largest number of parameters of a champion."""


Parameters = Annotated[tuple[Number, ...], BeforeValidator(as_list), Field(max_length=PARAMETERS_MAX)]
Measures = Annotated[dict[Text, Number], Field(max_length=1000)]
Generation = Annotated[Whole, Field(ge=0, lt=2**63)]
Kind = Annotated[Text | RobotSpec, Rule("the name of a robot, a robot file or a kiks.RobotSpec")]


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
    world: Text | None = None
    code: Text = ""


@shown_in_notebooks("kiks.learn.notebook", "champion")
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
        robot: The kind of robot that it drives: a name, a robot file or a `RobotSpec`.
        timing: Timing of its control loop.
        kiks: Version of KiKS that found it.
        world: The world in which it lives: arena, number of robots, starts and seed. None if it is not known.

    Example:
        >>> import tempfile
        >>> import kiks
        >>> champion = kiks.Champion(kiks.controllers.linear(), [0.5, 0.5] + [0.0] * 16)
        >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
        >>> steps = champion.drive(sim.port(1), seconds=2)
        >>> round(sim.travelled_mm(1))
        78
        >>> champion.project().arena.width_mm
        500.0
        >>> sim, ports = champion.simulation(robots=2)
        >>> file = tempfile.mkdtemp() + "/champion.toml"
        >>> champion.save(file)
        >>> kiks.Champion.load(file).parameters == champion.parameters
        True
    """

    controller: Controller
    parameters: Parameters
    task: Text = ""
    fitness: Number = 0.0
    measures: Measures = field(default_factory=dict)
    generation: Generation = 0
    algorithm: Text = ""
    seed: Seed = 0
    robot: Kind = "khepera"
    timing: Timing = field(default_factory=Timing)
    kiks: Text = __version__
    world: Project | None = None

    # Functions cannot be compared: a champion equals itself only.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def __repr__(self) -> str:
        task = f" of {self.task!r}" if self.task else ""
        return f"<{type(self).__name__}{task}: {self.controller!r}, fitness {self.fitness:g}>"

    def __post_init__(self) -> None:
        self.controller.check_parameters(self.parameters)

    def drive(self, port: str | Port | Sequence[str | Port], *, seconds: float) -> int:
        """Drive one or more robots, simulated or real; see `kiks.drive`. Ports that are open keep their speed.

        Returns:
            Number of loops.

        Raises:
            LinkError: If a port cannot be opened, or a robot does not answer as it should.
        """
        given = [port] if isinstance(port, str) or not isinstance(port, Sequence) else port
        ports = [open_port(each, self.baud) if isinstance(each, str) else each for each in given]
        (spec,) = specs_of(self.robot, 1, None)
        period_s, kind = self.timing.period_s, spec.kind
        return drive(ports, self.controller, self.parameters, seconds=seconds, period_s=period_s, kind=kind)

    @property
    def baud(self) -> int:
        """Speed of its lines [bit/s]: the highest baud rate of a Khepera if it was evolved without a line."""
        return self.timing.baud or 57600

    def project(self, arena: Arena | None = None) -> Project:
        """Return its own world, or that of an arena or the default box, with its timing and the turrets it needs."""
        own = self.world if arena is None else None
        project = own or Project(Arena.default() if arena is None else arena)
        needed = [each for each in turrets_of(self.controller.parts) if isinstance(each, str)]
        robots = (
            replace(each, turrets=tuple(dict.fromkeys((*each.turrets, *needed))))
            for each in project.robots or (ProjectRobot(),)
        )
        return replace(project, robots=tuple(robots), baud=self.baud, thinking=self.timing.thinking)

    def simulation(
        self, arena: Arena | None = None, *, robots: int | None = None, seed: int | None = None
    ) -> tuple[Simulation, list[Port]]:
        """Return a simulation with its kind of robot, which has its senses, and its timing; and the robots' ports.

        Args:
            arena: The arena; its own world if left out, or the default box if it has none.
            robots: Number of robots; that of its own world, else 1, if left out.
            seed: Seed of all random numbers; that of its own world, else 0, if left out.
        """
        project = self.project(arena)
        there = project.robots
        count = len(there) if robots is None else check_count("robots", robots, 1, ROBOTS_MAX)
        named = (*there, *there[-1:] * count)[:count]
        project = replace(project, robots=named, seed=project.seed if seed is None else seed)
        sim = simulation_of(with_kinds(project, [self.robot]))
        for number in range(1, count + 1):
            for turret in turrets_of(self.controller.parts):
                if not isinstance(turret, str):
                    sim.fit(number, turret())
        return sim, [sim.port(number) for number in range(1, count + 1)]

    # ---- files ----

    def save(self, path: str | Path) -> None:
        """Write a file that `load` reads, and beside it the files that it names.

        These are its world, its robot if that does not come with KiKS, and the Python file that defines its controller.
        """
        target = path_of(path)
        recipe = recipe_for(self.controller, target.parent)
        named: dict[str, str] = {}
        files: dict[str | Path, bytes | str] = {}

        def beside(ending: str, data: bytes | str) -> str:
            copy = target.with_name(f"{target.stem}_{ending}")
            files[copy] = data
            return copy.name

        file, name = file_of(recipe)
        if file:
            code = read_file(target.parent / file, "the file of the controller")
            recipe = {"function": f"{beside('controller.py', code)}:{name}"}
        if self.robot in robot_names():
            named["robot"] = str(self.robot)
        else:
            (spec,) = specs_of(self.robot, 1, None)
            named["robot"] = beside("robot.toml", robot_toml(spec))
        if self.world is not None:
            robots = tuple(replace(each, kind=named["robot"]) for each in self.world.robots)
            named["world"] = beside("world.kiks", replace(self.world, robots=robots).to_bytes())
        files[target] = self._text(recipe, named | fingerprints({"code": self.controller}))
        replace_files(files, "a champion")

    def _text(self, recipe: Mapping[str, Any], named: Mapping[str, str]) -> str:
        top = ("task", "fitness", "generation", "algorithm", "seed", "kiks")
        lines = [
            "# A controller for Khepera robots. See it drive: kiks run FILE.",
            f"champion = {FORMAT}",
            *(f"{name} = {toml(getattr(self, name))}" for name in top),
            *(f"{name} = {toml(value)}" for name, value in named.items()),
            "parameters = [",
            *(f"    {value!r}," for value in self.parameters),
            "]",
        ]
        sections = {"timing": asdict(self.timing), "controller": recipe, "measures": self.measures}
        for section, entries in sections.items():
            lines += ["", f"[{section}]"]
            lines += [f"{toml_key(name)} = {toml(value)}" for name, value in entries.items() if value is not None]
        return "\n".join(lines) + "\n"

    @classmethod
    def load(cls, path: str | Path) -> Champion:
        """Read a champion's file. A controller from a Python file or module is imported, which runs its code."""
        path = path_of(path)
        what = f"Champion's file {str(path)!r}"
        read = check(_ChampionFile, parse_toml(read_file(path, what, bytes_max=CHAMPION_FILE_BYTES_MAX), what), what)
        given = {each.name: getattr(read, each.name) for each in fields(cls)}
        given["timing"] = Timing(**asdict(read.timing))
        if read.world is not None:
            given["world"] = Project.load(inside(path.parent, read.world, "world"))
        given["robot"] = _robot_of(read.robot, path.parent)
        controller = controller_of(read.controller, path.parent)
        # Another Python compiles the same code differently.
        if read.code.endswith(COMPILED_HERE) and read.code != fingerprints({"": controller})[""]:
            logging.getLogger("kiks.learn").warning(
                "The controller of %r, or what it imports, has changed: it may drive differently.", str(path)
            )
        return cls(**given | {"controller": controller})


def _robot_of(name: str, folder: Path) -> str | RobotSpec:
    """Return the robot of a file that lies beside the champion's, as `save` writes it; any other name as it is."""
    if name in robot_names() or "/" in name:
        return name
    path = inside(folder, name, "robot")
    return RobotSpec.load(path) if path.is_file() else name

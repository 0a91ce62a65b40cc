"""A project: everything that a world is built from, in one file that people can read (the page "Projects").

The file is an arena file with its raster within, the robots, and the settings of the simulation.
"""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections.abc import Callable
from dataclasses import field, fields, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, InstanceOf

from kiks.errors import ArenaError, KiksError, ParameterError, counted, shown
from kiks.meant import nearest, nearest_file
from kiks.model.arena import Arena
from kiks.model.arena_doubts import doubt_colours, doubt_starts
from kiks.model.arena_file import (
    Pitch,
    Places,
    Walls,
    floor_of,
    load_arena,
    place_lines,
    toml,
)
from kiks.model.arena_objects import THINGS_MAX
from kiks.model.atomic_files import check_relative, ending_of, path_of, replace_file
from kiks.model.box import Box
from kiks.model.checks import ROBOTS_MAX
from kiks.model.data_file import (
    Number,
    OneOf,
    Rule,
    Switch,
    Text,
    Whole,
    check,
    check_size,
    parse_toml,
    read_file,
    record,
    table_of,
)
from kiks.model.exercise import CASES_MAX, LONG_TEXT_MAX, Cases, Exercise
from kiks.model.goal import Goal
from kiks.model.kad import load_kad
from kiks.model.limits import PROJECT_FILE_BYTES_MAX
from kiks.model.package import where_from
from kiks.model.picture import Pixels, decode_picture, encode_picture
from kiks.model.program_kinds import ENDINGS
from kiks.model.robot import Baud, Brightness, Response, RobotSpec, robot_names
from kiks.model.ros_map import load_ros_map
from kiks.model.settings import LinkName, Seconds, Seed, Speed, ThinkingPolicy
from kiks.model.shipped import shipped_arenas
from kiks.model.turrets import TURRETS

FASTEST = "fastest"
"""Value in a file for no speed limit."""

_VERSION = 1
_LINE = 116
_SETTINGS = ("seed", "thinking", "baud", "keeps_baud", "link", "response", "noise", "speed", "seconds", "supervisor")
_UNSAID = (("keeps_baud", False), ("link", "cable"))


def _check_kind(kind: str) -> str:
    if kind.lower().endswith(".toml"):
        return check_relative(kind, "kind")
    if kind not in (known := robot_names()):
        raise ParameterError(f"must be one of {known} or a .toml file, but it was {shown(kind)}.{nearest(kind, known)}")
    return kind


def _check_differ(turrets: tuple[str, ...]) -> tuple[str, ...]:
    if len(set(turrets)) < len(turrets):
        raise ParameterError(f"must differ, but they were {list(turrets)}. A robot has one of each.")
    return turrets


Program = Annotated[Text, AfterValidator(partial(check_relative, what="program"))]
_Plain = Switch | Whole | Number | Text
Change = Annotated[
    _Plain | Annotated[tuple[_Plain, ...], Field(max_length=1000)],
    Rule("a number, a text, true, false, or a list of them"),
]
"""A value in a robot's file."""


@record
class ProjectRobot:
    """A robot of a project.

    Args:
        kind: 'khepera', 'khepera_ii', or a robot file in the project's folder.
        turrets: Its turrets, of `TURRETS`.
        name: Its name; its number if empty.
        program: A Python file in the project's folder, which drives it.
        arguments: The program's arguments.
        brightness: Its brightness for other robots' sensors, 1 black to 255 white; that of its file if None.
        changes: What is different from its file: the keys of each section and their values.
        kind_name: What a robot with these changes is called; the name in its file if empty.

    Example:
        >>> ProjectRobot(changes={"body": {"diameter_mm": 70.0}}).kind
        'khepera'
    """

    kind: Annotated[Text, AfterValidator(_check_kind)] = "khepera"
    turrets: Annotated[tuple[Annotated[str, OneOf(tuple(TURRETS))], ...], AfterValidator(_check_differ)] = ()
    name: Text = ""
    program: Program | None = None
    arguments: Annotated[tuple[Text, ...], Field(max_length=100)] = ()
    brightness: Brightness | None = None
    changes: dict[str, dict[str, Change]] = Field(default_factory=dict)
    kind_name: Text = ""


Robots = Annotated[tuple[ProjectRobot, ...], Field(max_length=ROBOTS_MAX, description="Head each with [[robot]].")]
CaseTables = Annotated[tuple[Cases, ...], Field(max_length=CASES_MAX, description="Head each with [[case]].")]


@record
class Project:
    """All parts of a world; `dataclasses.replace` makes a changed copy.

    Args:
        arena: Walls, what stands in it, and where robots start, the first start for the first robot.
        robots: The robots; () for a world without a robot.
        seed: Seed of all random numbers.
        thinking: Thinking time of programs: 'none', 'fixed:MS', 'live', 'live:FACTOR' (another computer's), or
            'replay:FILE' with a file in the project's folder.
        baud: Speed of the serial lines [bit/s]; that of the robots' files if None.
        keeps_baud: Whether the lines keep that speed, whatever programs set.
        link: What is between programs and robots; see `Simulation`.
        response: Response of the proximity sensors (the page "Sensors"); that of the robots' files if None.
        noise: Whether sensors are noisy.
        speed: Simulated seconds per real second on the desk; None for no limit.
        seconds: Simulated time at which a run ends [s]; None for the end of its programs.
        supervisor: A Python file in the project's folder that acts in the world from outside, such as a referee.
        goal: When a run has solved it, and its points; None without a goal.
        cases: Ways in which programs are tried.
        exercise: What makes an exercise of it; None if it is none.

    Example:
        >>> project = Project(Arena.default(), robots=(ProjectRobot(turrets=("gripper",)),), seed=7)
        >>> Project.from_bytes(project.to_bytes()).robots[0].turrets
        ('gripper',)
    """

    arena: InstanceOf[Arena] = Field(default_factory=Arena.default)
    robots: Robots = (ProjectRobot(),)
    seed: Seed = 0
    thinking: ThinkingPolicy = "none"
    baud: Baud | None = None
    keeps_baud: Switch = False
    link: LinkName = "cable"
    response: Response | None = None
    noise: Switch = True
    speed: Speed | None = 1.0
    seconds: Seconds | None = None
    supervisor: Program | None = None
    goal: Goal | None = None
    cases: CaseTables = ()
    exercise: Exercise | None = None

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {counted(len(self.robots), 'robot')} in {self.arena!r}, seed {self.seed}>"

    def __post_init__(self) -> None:
        for name in ("starts", "lamps", "balls", "cylinders"):
            if (count := len(getattr(self.arena, name))) > THINGS_MAX:
                raise ParameterError(f"{name} must be at most {THINGS_MAX}, but there are {count}.")

    @classmethod
    def load(cls, path: str | Path) -> Project:
        """Read a project, or an arena of any kind, which becomes a project with a robot for each of its starts.

        A folder is an exercise: the project `exercise.kiks` in it, with the exercise's text and template beside it.
        """
        path = project_file(path_of(path))
        if path.suffix.lower() != ".kiks":
            if path.suffix.lower() in NO_WORLDS or not (path.suffix or path.exists() or str(path) in shipped_arenas()):
                what = NO_WORLDS.get(path.suffix.lower(), "none")
                hint = nearest_file(path, shipped_arenas()) if what == "none" else ""
                raise ArenaError(
                    "A project must be a file (.kiks), the folder of an exercise or an arena, but "
                    f"{shown(str(path))} is {what}.{hint} `kiks examples first` copies some."
                )
            return cls.of_arena(Arena.load(path))
        what = f"Project file {str(path)!r}"
        data = read_file(path, what, bytes_max=PROJECT_FILE_BYTES_MAX, error=ArenaError)
        project = cls.from_bytes(data, name=path.stem, what=what)
        return _with_files_beside(project, path.parent) if path.name == EXERCISE_FILE else project

    @classmethod
    def of_arena(cls, arena: Arena) -> Project:
        """Return a project of an arena, with a Khepera for each of its starts, at least one."""
        return cls(arena, robots=(ProjectRobot(),) * max(len(arena.starts), 1))

    def for_students(self) -> Project:
        """Return it without what only the lecturer's file has: hidden cases."""
        return replace(self, cases=tuple(each for each in self.cases if not each.is_hidden))

    def save(self, path: str | Path) -> None:
        """Write the file, in one step."""
        ending_of(path, "a project's file", (".kiks",))
        replace_file(path, self.to_bytes(), "a project")

    @classmethod
    def from_bytes(cls, data: bytes, *, name: str = "project", what: str = "The project file") -> Project:
        """Read what `to_bytes` returned, or a person wrote; the arena is called `name` if the file does not say."""
        check_size(data, what, bytes_max=PROJECT_FILE_BYTES_MAX, error=ArenaError)
        table = parse_toml(data, what, error=ArenaError)
        if (found := table.get("kiks")) != _VERSION:
            was = "it is not there" if found is None else f"it was {shown(found)}"
            raise ArenaError(
                f"{what}: kiks must be {_VERSION}, the version of this format, but {was}. "
                f"Write kiks = {_VERSION}, or open a newer file with a newer KiKS."
            )
        file = check(ProjectFile, table, what, error=ArenaError)
        try:
            name = name if file.name is None else file.name
            arena = file.placed_in(file.walls.arena(name), name=name)
            settings = {each: getattr(file, each) for each in _SETTINGS}
            if file.speed == FASTEST:
                settings["speed"] = None
            return cls(arena, file.robot, goal=file.goal, cases=file.case, exercise=file.exercise, **settings)
        except KiksError as error:
            raise ArenaError(f"{what}: {error}") from None

    def to_bytes(self) -> bytes:
        """Return the file."""
        lines = [
            '# A project of KiKS: the page "Projects" of the documentation says what each line means.',
            f"kiks = {_VERSION}",
        ]
        for name in _SETTINGS:
            value = getattr(self, name)
            if name == "speed" and value is None:
                value = FASTEST
            if value is not None and (name, value) not in _UNSAID:
                lines.append(f"{name} = {toml(value)}")
        lines.append(f"name = {toml(self.arena.name)}")
        if not self.robots:
            lines.append("robot = []")
        for robot in self.robots:
            lines += ["", "[[robot]]"]
            values = ((each.name, getattr(robot, each.name)) for each in fields(robot))
            lines += [f"{name} = {toml(value)}" for name, value in values if value not in (None, "", (), {})]
        tables = [("[goal]", self.goal), ("[exercise]", self.exercise), *(("[[case]]", each) for each in self.cases)]
        for head, table in tables:
            if table is not None:
                lines += ["", head, *(f"{name} = {toml(value)}" for name, value in table_of(table).items())]
        lines += place_lines(self.arena)
        lines += ["", "[walls]"]
        raster = self.arena.ground
        lines += _wall_lines(raster.tobytes(), raster.shape, self.arena.mm_per_cell)
        if self.arena.floor is not None:
            lines.append(f"floor = {_packed(self.arena.floor)}")
        return ("\n".join(lines) + "\n").encode("utf-8", errors="replace")


_PNG = Annotated[str, Rule("a PNG file in base64")]


@record
class ProjectWalls(Walls):
    """The walls of a project: a PNG in base64, or a box in whole millimetres; and its floor, another PNG."""

    png: _PNG | None = None
    mm_per_cell: Pitch | None = None
    floor: _PNG | None = None

    def __post_init__(self) -> None:
        if self.png is not None:
            self.check_is_alone("png")
        elif self.mm_per_cell is not None:
            raise ParameterError("mm_per_cell must come with a png, but there is none. Boxes have cells of 1 mm.")

    def arena(self, name: str) -> Arena:
        """Return the walls as an arena of this name."""
        mm_per_cell = self.mm_per_cell or 1.0
        if self.png is None:
            arena = self.box()
        else:
            brightness = _unpacked(self.png, "png", mm_per_cell).brightness
            arena = Arena.from_array(brightness, mm_per_pixel=mm_per_cell, name=name)
        if self.floor is None:
            return arena
        return replace(arena, floor=floor_of(_unpacked(self.floor, "floor", mm_per_cell), mm_per_cell, arena))


@lru_cache(maxsize=4)  # a class is graded in few arenas, and to draw one takes 5 ms
def _wall_lines(cells: bytes, shape: tuple[int, int], mm_per_cell: float) -> list[str]:
    """Return the lines of the walls: those of a box if they are one, else a picture."""
    raster = np.frombuffer(cells, np.uint8).reshape(shape)
    if mm_per_cell == 1.0 and (box := Box.of_raster(raster)) is not None:
        names = ("wall_mm", "rounded_mm", "brightness")
        return [f"size_mm = [{box.width_mm}, {box.height_mm}]", *(f"{name} = {getattr(box, name)}" for name in names)]
    return [f"mm_per_cell = {mm_per_cell!r}", f"png = {_packed(raster)}"]


def _packed(raster: NDArray[np.uint8]) -> str:
    """Return a picture as it stands in a file: a PNG in base64."""
    text = b64encode(encode_picture(raster)).decode()
    rows = "\n".join(text[start : start + _LINE] for start in range(0, len(text), _LINE))
    return f"'''\n{rows}\n'''"


def _unpacked(text: str, name: str, mm_per_cell: float) -> Pixels:
    try:
        data = b64decode("".join(text.split()), validate=True)
    except ValueError as error:
        raise ArenaError(f"{name} must be a PNG file in base64, but: {error}. Save the project again.") from None
    return decode_picture(data, mm_per_cell, name)


@record
class ProjectFile(Places):
    """A project of KiKS: an arena, its robots, and the settings of the simulation."""

    kiks: Literal[1] = field(kw_only=True)
    seed: Seed = 0
    thinking: ThinkingPolicy = "none"
    baud: Baud | None = None
    keeps_baud: Switch = False
    link: LinkName = "cable"
    response: Response | None = None
    noise: Switch = True
    speed: Annotated[Speed | Literal["fastest"], Rule("a number from 0.001 to 1000, or 'fastest'")] = 1.0
    seconds: Seconds | None = None
    supervisor: Program | None = None
    goal: Goal | None = None
    exercise: Exercise | None = None
    case: CaseTables = ()
    name: Text | None = None
    robot: Robots = (ProjectRobot(),)
    walls: ProjectWalls = ProjectWalls()


_READERS: dict[str, Callable[[Path], Arena]] = {
    ".toml": load_arena,
    ".kiks": lambda path: Project.load(path).arena,
    ".kad": load_kad,
    ".yaml": load_ros_map,
    ".yml": load_ros_map,
}


NO_WORLDS = dict.fromkeys(ENDINGS, "a program") | {".mcap": "a recording", ".zip": "an archive", ".txt": "a text"}
"""Endings of files that are neither a project nor an arena, and what they are."""

EXERCISE_FILE = "exercise.kiks"
"""The project in the folder of an exercise."""

EXERCISE_FILES = {"text": "text.md", "template": "template.py"}
"""Files beside it, by what they hold."""


def project_file(path: Path) -> Path:
    """Return the file of a project: in the folder of an exercise it has a name of its own."""
    return path / EXERCISE_FILE if path.is_dir() else path


def _with_files_beside(project: Project, folder: Path) -> Project:
    """Return the project of an exercise with what lies beside it in its folder."""
    beside: dict[str, Any] = {}
    for name, file in EXERCISE_FILES.items():
        if (folder / file).exists():
            what = f"The exercise's {name} {str(folder / file)!r}"
            data = read_file(folder / file, what, bytes_max=4 * LONG_TEXT_MAX, error=ArenaError)
            beside[name] = data.decode("utf-8", errors="replace")
    return replace(project, exercise=replace(project.exercise or Exercise(), **beside)) if beside else project


def load_arena_file(path: Path) -> Arena:
    """Read an arena that comes with KiKS, or a file: see `Arena.load`."""
    is_shipped = not path.exists() and (not path.suffix or path.stem in shipped_arenas())
    if is_shipped:
        known = shipped_arenas()
        if path.as_posix() not in known:
            names = ", ".join(name for name in known if "/" not in name)
            advice = where_from(path, nearest_file(path, known).lstrip())
            what = f"An arena must be a file or one of {names}, but there is no {shown(str(path))}. {advice}"
            raise ArenaError(what.rstrip())
        path = known[path.as_posix()]
    if found := NO_WORLDS.get(path.suffix.lower()):
        raise ArenaError(f"An arena must be an arena file or a picture, but {shown(str(path))} is {found}.")
    arena = _READERS.get(path.suffix.lower(), _picture_alone)(path)
    if not is_shipped and path not in shipped_arenas().values():
        doubt_starts(arena, path, RobotSpec.load("khepera").body.radius_mm)
    return arena


def _picture_alone(path: Path) -> Arena:
    arena = Arena.from_image(path)
    doubt_colours(arena, path)
    return arena

"""The senses of controllers: for each the command that reads it on the wire, and the function that reads it in a batch.

A sense is a compiled function, as controllers and measures are: the loop of a batch calls it at its address. Those that
come with KiKS are in `SENSES` and have names; one of a user's own is an object.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numba import types
from numpy.typing import NDArray

from kiks.control.compiled_function import caller_of, decorator, explained
from kiks.control.recipes import FunctionRecipe, find
from kiks.control.turret_parts import VIEW, TurretPart, head_length, memory_slices, view_of
from kiks.engine.compiling import entry
from kiks.engine.physics.gripper import BARRIER_BROKEN, find_between
from kiks.engine.physics.motor import SPEED_MAX, counter, steps_at
from kiks.engine.scene import open_scene
from kiks.engine.sensing.accelerometer import COUNTS_MAX as ACCELERATION_MAX
from kiks.engine.sensing.accelerometer import sense_acceleration
from kiks.engine.sensing.ambient import sense_ambient
from kiks.engine.sensing.floor import COUNTS, GROUND_COUNTS, sense_floor, sense_ground
from kiks.engine.sensing.microphones import COUNTS_MAX as SOUND_MAX
from kiks.engine.sensing.microphones import sense_sound
from kiks.engine.sensing.proximity import make_readers, sense_linked
from kiks.engine.state import PIXEL_COUNT
from kiks.errors import ParameterError, shown
from kiks.firmware.khepera.kind import KHEPERA
from kiks.firmware.robot_kind import RobotKind
from kiks.meant import nearest
from kiks.model.checks import check_count, check_number
from kiks.model.data_file import check
from kiks.model.robot import GROUND_COUNT, SENSOR_COUNT

# Numba annotates these in part, and not as they are used here.
_types: Any = types

ARGUMENTS = (VIEW, _types.float64[::1])
"""Types of a view and readings."""

call_sense = caller_of(ARGUMENTS)

IN_PACKETS = 0
"""Stands for the address of a sense that a batch reads of many robots together: proximity."""


class Sense(TurretPart):
    r"""A function `(view, readings)` that writes what a command reads: whole numbers, into a float64 array.

    A batch calls it; on the wire the command is sent. Both must give the same numbers. A sense
    that is defined in the class of a turret belongs to it, and robots whose controllers have it carry the turret.

    Args:
        function: The function; see `RobotView` for what it sees.
        command: The command that reads it, such as 'E' or 'T,24,C'.
        readings: Number of its readings.
        most: The largest reading, which is an input of 1 for networks.
        least: The smallest reading.
        zero: The reading that is an input of 0 for networks.
        full: The reading that is an input of 1, if not `most`.
        turret: The turret that answers the command, a name or a class; none for a command of the robot's own.

    Attributes:
        name: Its name.
        command: As above, as all others.
        turret: The turret: a name, a class, or None.
        address: Where a batch calls it.
        recipe: The table that finds it again, of JSON values, or the name of one that stands for it; None for one that
            cannot be imported.

    Example:
        >>> import kiks
        >>> from kiks.firmware.robot_kind import robot_kind
        >>> @kiks.sense(command="K", readings=6, least=-127, most=127)
        ... def status(view, readings):
        ...     readings[:] = 0.0
        >>> status, status.command_for(robot_kind("khepera"))
        (<Sense 'status': K>, 'K')
        >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
        >>> SENSES["positions"].look(sim.world.scene, 0, 0, 0)
        array([0., 0.])
    """

    what, arguments, options, argument_types = "sense", ("view", "readings"), ("readings",), ARGUMENTS

    def __init__(
        self,
        function: Callable[..., Any],
        *,
        command: str,
        readings: int = 1,
        most: float,
        least: float = 0.0,
        zero: float = 0.0,
        full: float | None = None,
        turret: Any = None,
    ) -> None:
        super().__init__(function, command, turret)
        self.size = check_count("readings", readings, least=1)
        self.most, self.least = check_number("most", most), check_number("least", least)
        self.zero = check_number("zero", zero)
        self.full = self.most if full is None else check_number("full", full)
        if self.full == self.zero:
            raise ParameterError(f"full must differ from zero, but both were {self.full:g}. It is an input of 1.")

    @property
    def sizes(self) -> dict[str, int | None]:
        """How many readings it has."""
        return {"readings": self.size}

    def command_for(self, kind: RobotKind) -> str:
        """Return the command that reads it on a kind of robot: each kind has its own for the senses of `SENSES`.

        Raises:
            ParameterError: If that kind of robot has none.
        """
        if SENSES.get(self.name) is not self:
            return self.command
        if self.name not in kind.senses:
            raise ParameterError(
                f"senses must be some of those of this kind of robot ({', '.join(filter(kind.senses.get, SENSES))}), "
                f"but {shown(self.name)} was among them. Leave it out, or take a robot that has it."
            )
        return kind.senses[self.name]

    def look(self, scene: Any, robot: int, tick_count: int, time_ns: int, *, is_noisy: bool = True) -> NDArray[Any]:
        """Return what it reads of a robot in the first world of a scene, float64 [reading].

        Args:
            scene: The scene (`kiks.engine.scene.Scene.record`).
            robot: Index of the robot.
            tick_count: Ticks done.
            time_ns: Time of the reading [ns].
            is_noisy: False for readings free of noise.
        """
        readings = np.zeros(self.size)
        try:
            look(self.address, scene, robot, tick_count, time_ns, is_noisy, self.memory_count, readings)
        except Exception as error:
            raise explained(error, [self]) from None
        return readings


sense = decorator(Sense)
"""Make a sense of a function; a decorator, with the options of `Sense`."""


@entry
def look(
    address: Any, scene: Any, robot: Any, tick_count: Any, time_ns: Any, is_noisy: Any, count: Any, readings: Any
) -> Any:
    """Call a sense for a robot of the first world of a scene; its turret remembers `count` numbers."""
    scene = open_scene(scene[0])
    call_sense(address, (view_of(scene, 0, robot, tick_count, time_ns, is_noisy, 0, count), readings))


# ---- those that come with KiKS ----

_COMMANDS = KHEPERA.senses


@sense(command=_COMMANDS["proximity"], readings=SENSOR_COUNT, most=KHEPERA.counts_max)
def proximity(view: Any, readings: Any) -> None:
    """Read the reflected light of the eight sensors; a batch reads many robots together, which gives the same."""
    readers = make_readers()
    readers.worlds[0], readers.robots[0] = view.world, view.robot
    readers.ticks[0], readers.times_ns[0] = view.tick_count, view.time_ns
    sense_linked(view.scene, readers, 1, view.is_noisy, readings.reshape((1, readings.shape[0])))


@sense(
    command=_COMMANDS["ambient"], readings=SENSOR_COUNT, most=KHEPERA.counts_max, zero=500, full=0
)  # khepera-protocol.md 9.4
def ambient(view: Any, readings: Any) -> None:
    """Read the ambient light. Counts fall in light: an input is 0 in the dark, nearly 1 beside a lamp.

    As shares of the largest count they would be half of full scale in the dark, more than the light of most lamps takes
    off.
    """
    sense_ambient(view.scene, view.world, view.robot, view.tick_count, view.time_ns, view.is_noisy, readings)


@sense(command=_COMMANDS["camera"], readings=PIXEL_COUNT // 4, most=255, turret="k213")  # khepera-protocol.md 10.3
def camera(view: Any, readings: Any) -> None:
    """Read every fourth grey of the last picture of a K213."""
    for number in range(readings.shape[0]):
        readings[number] = view.robots[view.robot].camera_pixels[4 * number]


@sense(
    command=_COMMANDS["positions"], readings=2, least=-(2**31), most=2**31 - 1, full=12_500
)  # a metre (khepera-protocol.md 4.9)
def positions(view: Any, readings: Any) -> None:
    """Read the position counters of the wheels [pulses]; of steppers, the steps sent so far."""
    robot = view.robots[view.robot]
    parameters = view.scene.kinds[robot.kind]
    for wheel in range(2):
        if parameters.steps_per_s_max > 0.0:
            readings[wheel] = steps_at(robot, parameters, wheel, view.tick_count, view.time_ns)
        else:
            readings[wheel] = counter(robot, wheel)


@sense(command=_COMMANDS["speeds"], readings=2, least=-SPEED_MAX, most=SPEED_MAX)
def speeds(view: Any, readings: Any) -> None:
    """Read the speeds that the robot measures [pulses/10 ms]."""
    for wheel in range(2):
        readings[wheel] = view.robots[view.robot].measured_speed[wheel]


@sense(command=_COMMANDS["barrier"], most=BARRIER_BROKEN, turret="gripper")  # khepera-protocol.md 10.2
def barrier(view: Any, readings: Any) -> None:
    """Read the light barrier between the jaws of a gripper."""
    readings[0] = BARRIER_BROKEN if find_between(view.scene, view.world, view.robot) >= 0 else 0


@sense(command=_COMMANDS["floor"], most=COUNTS, turret="floor")
def floor(view: Any, readings: Any) -> None:
    """Read the brightness of the floor under the robot's middle."""
    place = view.x_mm, view.y_mm
    readings[0] = sense_floor(view.scene, view.world, view.robot, *place, view.time_ns, view.is_noisy, 0)


@sense(command="M", readings=GROUND_COUNT, most=GROUND_COUNTS)
def ground(view: Any, readings: Any) -> None:
    """Read the floor left, in the middle and right, and the sensors against cliffs, left and right."""
    pose = view.x_mm, view.y_mm, view.heading_rad
    sense_ground(view.scene, view.world, view.robot, pose, view.time_ns, view.is_noisy, readings)


@sense(command="A", readings=3, least=-ACCELERATION_MAX, most=ACCELERATION_MAX)
def accelerometer(view: Any, readings: Any) -> None:
    """Read the acceleration to the right, ahead and up [768 counts per g]."""
    sense_acceleration(view.scene, view.world, view.robot, view.time_ns, view.is_noisy, readings)


@sense(command="U", readings=3, most=SOUND_MAX)
def microphones(view: Any, readings: Any) -> None:
    """Read the amplitudes that the microphones hear, right, left and behind."""
    sense_sound(view.scene, view.world, view.robot, view.tick_count, view.time_ns, view.is_noisy, readings)


_ALL = proximity, ambient, camera, positions, speeds, barrier, floor, ground, accelerometer, microphones

SENSES = {each.name: each for each in _ALL}
"""The senses that have names. Which of them a kind of robot has, its `RobotKind` says."""

_OF_PLACES = (ambient, camera, barrier, floor, ground, accelerometer, microphones)
"""Of what moves in robots, these see no more than where they are."""

AnySense: TypeAlias = str | Sense
"""A sense of `SENSES` by its name, or one of a user's own."""


def sense_of(given: AnySense) -> Sense:
    """Return a sense."""
    return SENSES[given] if isinstance(given, str) else given


def named(senses: Iterable[AnySense]) -> str:
    """Return the names of some senses, for messages."""
    return ", ".join(each if isinstance(each, str) else each.name for each in senses)


def reading_count(senses: Sequence[AnySense]) -> int:
    """Return the number of readings of some senses together."""
    return sum(sense_of(each).size for each in senses)


def recipes_for(senses: Sequence[AnySense]) -> list[Any]:
    """Return senses as JSON has them: names, and recipes of a user's own; `check_senses` takes them back."""
    return [each if isinstance(each, str) else each.recipe for each in senses]


def _found(given: Mapping[str, Any]) -> Any:
    return find(check(FunctionRecipe, given, "the recipe of a sense"), ".")


def check_senses(senses: AnySense | Sequence[AnySense]) -> tuple[AnySense, ...]:
    """Return some of `SENSES`, or of a user's own."""
    try:
        given = (senses,) if isinstance(senses, str | Sense) else tuple(senses)
    except TypeError:
        raise ParameterError(f"senses must be some of {', '.join(SENSES)}, but they were {shown(senses)}.") from None
    given = tuple(_found(each) if isinstance(each, Mapping) else each for each in given)
    for each in given:
        if not isinstance(each, Sense) and (not isinstance(each, str) or each not in SENSES):
            raise ParameterError(
                f"senses must be some of {', '.join(SENSES)}, but {shown(each)} was among them."
                f"{nearest(each, SENSES)} One of your own is made by @kiks.sense."
            )
    if len(set(given)) != len(given):
        raise ParameterError(f"senses must name each sense once, but they were {named(given)}.")
    return given


class ForControllers(NamedTuple):
    """What becomes of a sense's readings for controllers, which see all kinds of robots in the same way.

    Attributes:
        scale: What they are multiplied by.
        order: Which comes first, second and so on.
    """

    scale: float
    order: tuple[int, ...]


def for_controllers(sense: Sense, kind: RobotKind) -> ForControllers:
    """Return what becomes of the readings of a sense on a kind of robot."""
    order = kind.sensor_order if sense in (proximity, ambient) else tuple(range(sense.size))
    return ForControllers(kind.scales.get(sense.name, 1.0), order)


def conversions_of(senses: Sequence[AnySense], kind: RobotKind) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the scales and orders of all senses on a kind of robot, float64 [sense] and int64 [sense, reading]."""
    each = [for_controllers(sense_of(sense), kind) for sense in senses]
    orders = np.zeros((len(each), max((len(one.order) for one in each), default=0)), np.int64)
    for row, one in zip(orders, each, strict=True):
        row[: len(one.order)] = one.order
    return np.array([one.scale for one in each]), orders


@functools.lru_cache(maxsize=256)
def rows_of(senses: tuple[AnySense, ...], kind: RobotKind) -> NDArray[np.int64]:
    """Return what the loop of a batch knows of senses on a kind of robot, int64 [sense, 7].

    These are where it calls each, `IN_PACKETS` for proximity; the number of its readings; that of the characters of its
    request, and of its reply but for commas and numbers; where the numbers of its turret begin and end; and 1 if it
    may see more of what moves in a robot than where it is.
    """
    parts = [sense_of(each) for each in senses]
    rows = []
    for each, (begin, end) in zip(parts, memory_slices(parts), strict=True):
        address = IN_PACKETS if each is proximity else each.address
        command = each.command_for(kind)
        lengths = len(command) + 1, head_length(command) + 2
        rows.append((address, each.size, *lengths, begin, end, int(each not in _OF_PLACES)))
    return np.array(rows, np.int64).reshape(-1, 7)

"""Simulation: robots at the ends of serial lines, and time that passes when a program lets it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import count
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from kiks.clock.program_clock import ProgramClock
from kiks.clock.sleeping import watch_sleeps
from kiks.engine.sensing.rays import walls_of
from kiks.errors import ParameterError, counted, shown
from kiks.firmware.firmware import Firmware
from kiks.firmware.robot_kind import robot_kind
from kiks.firmware.turret import Turret
from kiks.model.arena import Arena, Ball, Cylinder
from kiks.model.checks import SECONDS_MAX, check_count, check_kind, check_number
from kiks.model.robot import RobotSpec, specs_of
from kiks.sim.event_loop import EventLoop
from kiks.sim.explanation import Explanation, LightExplanation, explain_ambient, explain_proximity
from kiks.sim.free_space import FreeSpace
from kiks.sim.local_line import LocalLine
from kiks.sim.paths import Paths
from kiks.sim.pictures import picture
from kiks.sim.port import CLOSED, VirtualPort
from kiks.sim.run_log import SCORE
from kiks.sim.sensors import counts, readings
from kiks.sim.snapshot import Snapshot, look, proximity_at, trace_rays
from kiks.sim.things import Checkpoint, Things
from kiks.sim.turret_host import Turrets
from kiks.sim.world import World
from kiks.units import ns_from_s, s_from_ns
from kiks.upwards import (
    OpenRecording,
    View,
    copy_simulation,
    plot_simulation,
    record_simulation,
    show_in_browser,
    shown_in_notebooks,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@shown_in_notebooks("kiks.export.notebook", "simulation")
class Simulation:
    r"""Robots in an arena, each at the end of a serial line.

    Time passes only when a program waits for a reply on a port, or calls `run`.

    This class holds the lock, brings the world up to date, and calls its parts, which do neither. Robots are numbered
    from 1, sensors from 0, in the order of the answers to `N` and `O`.

    Args:
        arena: Where the robots drive; the classic 500 x 650 mm box if left out.
        robots: How many there are, 0 for none before `add_robot`; as many as kinds are named if left out.
        seed: Seed of all random numbers; the same seed gives the same run, to the bit.
        thinking: What the program's own computing costs: 'none', 'fixed:MS', 'live', 'live:FACTOR' or 'replay:FILE'.
        robot: Kind of all robots: a name that `RobotSpec.load` knows, a file, or a `RobotSpec`; or a list of such, one
            for each robot.
        response: Proximity sensor model, such as 'thesis' (the page "Sensors"); that of the robot's file if
            left out.

    Attributes:
        world: The arena with all that stands and moves in it.
        lock: Held by every thread that reads or changes the simulation.
        loop: Lets time pass, event by event.
        wires: The robots' serial lines.
        things: Its balls, cylinders and lamps.
        program: What the computing of the program on its ports costs.
        name: The name in its ports' URLs.

    A copy, by `copy.deepcopy` or `pickle`, goes on as the simulation would. It is neither recorded nor shown, and
    has no supervisor.

    Example:
        >>> sim = Simulation(Arena.box(500, 500), seed=1)
        >>> port = sim.port(1)
        >>> port.write(b"D,10,10\n"); port.readline()
        8
        b'd\r\n'
        >>> sim.run(1.0)
        >>> round(sim.time_s, 3)
        1.014
    """

    def __init__(
        self,
        arena: Arena | None = None,
        *,
        robots: int | None = None,
        seed: int = 0,
        thinking: str = "none",
        robot: str | RobotSpec | Sequence[str | RobotSpec] = "khepera",
        response: str | None = None,
    ) -> None:
        if arena is not None:
            _check_arena(arena)
        seed = check_count("seed", seed, 0, 2**63 - 1, "Any small number will do.")
        self._begin(
            World(Arena.default() if arena is None else arena, specs_of(robot, robots, response), seed), thinking
        )

    @classmethod
    def of_world(cls, world: World, thinking: str = "none", program: ProgramClock | None = None) -> Simulation:
        """Return the simulation of a world at its start; the computing on its ports costs what `program` says."""
        sim = cls.__new__(cls)
        sim._begin(world, thinking, program)
        return sim

    def _begin(self, world: World, thinking: str, program: ProgramClock | None = None) -> None:
        self.thinking = thinking
        self.program = ProgramClock(thinking) if program is None else program
        self.world = world
        self.things = Things(self.world)
        self._firmwares: list[Firmware] = []
        self._turrets = Turrets(self.world, self._firmwares)
        self.loop = EventLoop(self.world, self._turrets.sync)
        self.lock, self.wires = self.world.lock, self.loop.wires
        for index in range(self.robot_count):
            self._power_up(index)
        self._paths: Paths | None = None
        self._ports: dict[int, SimPort] = {}
        self.name = f"sim{next(_NUMBERS)}"
        SIMULATIONS[self.name] = self

    def _power_up(self, index: int) -> None:
        """Give a robot its firmware and its serial line."""
        spec = self.world.specs[index]
        firmware = robot_kind(spec.kind).firmware(spec, self.world.state, index, partial(counts, self.world, index))
        firmware.picture = partial(picture, self.world, index)
        self._firmwares.append(firmware)
        self.loop.add_wire(firmware)

    def __repr__(self) -> str:
        robots = counted(self.robot_count, "robot")
        return f"<{type(self).__name__}: {robots} in {shown(self.arena.name)} at {self.time_s:.3f} s, seed {self.seed}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return copy_simulation(self)

    @contextmanager
    def _up_to_date(self) -> Iterator[World]:
        """Hold the lock, and do the ticks that have begun."""
        with self.lock:
            self.sync()
            yield self.world

    @contextmanager
    def _changing(self) -> Iterator[World]:
        """Hold the lock, do the ticks that have begun, and let cameras see what was changed."""
        with self._up_to_date() as world:
            yield world
            world.note_change()
            self._turrets.cameras.retake()

    # ---- what it consists of ----

    @property
    def arena(self) -> Arena:
        """The walls, and what stood in them at the beginning."""
        return self.world.arena

    @property
    def seed(self) -> int:
        """Seed of all random numbers."""
        return self.world.seed

    @property
    def specs(self) -> list[RobotSpec]:
        """The kind of each robot."""
        return self.world.specs

    @property
    def spec(self) -> RobotSpec:
        """The kind of robot 1."""
        return self.world.specs[self.index_of(1)]

    @property
    def robot_count(self) -> int:
        """Number of robots."""
        return self.world.robot_count

    @property
    def lamps(self) -> NDArray[np.float64]:
        """The lamps: x_mm, y_mm, power_w, and 1 for on or 0 for off: float64 [lamp, 4].

        Write to it to move or switch them. A lamp with a NaN position is ignored.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> lamp = sim.add_lamp(250, 300)
            >>> sim.lamps
            array([[250., 300.,   1.,   1.]])
        """
        with self.lock:
            self.sync()
            return self.world.expose_lamps()

    @lamps.setter
    def lamps(self, lamps: NDArray[np.float64]) -> None:
        self.world.lamps = lamps
        self.world.expose_lamps()

    # ---- time ----

    @property
    def now_ns(self) -> int:
        """The simulated time [ns]."""
        return self.world.now_ns

    @property
    def time_s(self) -> float:
        """Simulated time since the start [s]."""
        return s_from_ns(self.world.now_ns)

    def run(self, seconds: float) -> None:
        """Let simulated time pass [s, at most 1e9]: robots drive on, and commands on the line act when they are due.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> kiks.Khepera(sim.port(1)).set_speed(5, 5)
            >>> sim.run(2)
            >>> round(sim.travelled_mm(1))
            79
        """
        passing_ns = ns_from_s(check_number("seconds", seconds, 0, SECONDS_MAX, "Time never runs backwards."))
        with self.lock:
            self.loop.advance_to(self.now_ns + passing_ns)

    def advance_to(self, time_ns: int) -> None:
        """Let time pass up to a time [ns]; does nothing if that has passed already."""
        self.loop.advance_to(time_ns)

    def next_event_ns(self) -> int | None:
        """Return when a robot acts next [ns]; None while all of them wait for characters."""
        return self.loop.next_event_ns()

    def sync(self) -> None:
        """Do the ticks that have begun, take the pictures that are due on the way, and deliver radio messages.

        The engine is behind the clock until the state is read.
        """
        self._turrets.sync()

    # ---- robots ----

    def index_of(self, robot: int) -> int:
        """Return the index of a robot by its number."""
        return self.world.index_of(robot)

    def pose(self, robot: int) -> tuple[float, float, float]:
        """Return where a robot is at this instant: x_mm, y_mm, heading_rad (not wrapped).

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> sim.place(1, 100, 200, 0.25)
            >>> sim.pose(1)
            (100.0, 200.0, 0.25)
        """
        index = self.index_of(robot)
        with self._up_to_date() as world:
            return world.pose(index)

    def poses(self) -> NDArray[np.float64]:
        """Return where all robots are at this instant, float64 [robot, 3]: x_mm, y_mm, heading_rad."""
        with self._up_to_date() as world:
            return world.places()[0]

    def place(self, robot: int, x_mm: float, y_mm: float, heading_rad: float) -> None:
        """Move a robot elsewhere; its wheels and counters do not change.

        Args:
            robot: Its number.
            x_mm: From the arena's lower left corner to the right [mm].
            y_mm: From the arena's lower left corner upwards [mm].
            heading_rad: Counter-clockwise from the x axis [rad]; wrapped to one turn beyond a million. A multiple of
                0.5 from 10 on is an error: it is a heading in degrees.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> sim.place(1, 100, 200, 0.25)
            >>> sim.pose(1)
            (100.0, 200.0, 0.25)
        """
        index = self.index_of(robot)
        with self._changing() as world:
            world.place_robot(index, x_mm, y_mm, heading_rad)

    def add_robot(self, robot: str | RobotSpec = "khepera", *, pose: Sequence[float] | None = None) -> int:
        """Add a robot; return its number.

        It starts where the arena has a start for it, if that is free, else at a random place. Robots, programs and
        bodies that are there do not notice, until they meet it.

        Args:
            robot: Its kind: a name that `RobotSpec.load` knows, a file, or a `RobotSpec`.
            pose: Start pose: x_mm, y_mm, heading_rad; not checked for collisions.

        Example:
            >>> sim = Simulation(Arena.box(500, 500))
            >>> sim.add_robot("khepera_ii")
            2
        """
        (spec,) = specs_of(robot, 1, None)
        with self._changing() as world:
            index = world.add_robot(spec, pose)
            for firmware in self._firmwares:
                firmware.take(world.state)
            self._power_up(index)
            return index + 1

    def fit(self, robot: int, turret: str | Turret) -> Turret:
        r"""Put a turret on a robot; it answers to `T,<its number>,...` from now on (the page "Turrets").

        Args:
            robot: Its number.
            turret: 'k213' (the linear camera), 'gripper', 'radio', 'io' (General I/O), 'battle', 'floor' (a floor
                sensor), or one of your own.

        Returns:
            The turret, which 'io' and some of your own are set and read by.

        Example:
            >>> sim = Simulation()
            >>> camera = sim.fit(1, "k213")
            >>> port = sim.port(1)
            >>> port.write(b"T,2,B\n"); port.readline()
            6
            b't,2,b,1,0\r\n'
        """
        index = self.index_of(robot)
        with self._changing():
            return self._turrets.fit(index, turret)

    def turrets(self, robot: int) -> tuple[Turret, ...]:
        """Return the turrets that a robot carries, in the order in which they were fitted."""
        return tuple(self.wires[self.index_of(robot)].firmware.fitted)

    def port(self, robot: int) -> SimPort:
        r"""Return the computer's end of a robot's line: one object, always the same until it is closed.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> port = sim.port(1)
            >>> _ = port.write(b"E\n")
            >>> port.readline()
            b'e,0,0\r\n'
        """
        index = self.index_of(robot)
        if index not in self._ports or self._ports[index].line is CLOSED:
            self._ports[index] = SimPort(self, robot)
        return self._ports[index]

    def url(self, robot: int) -> str:
        """Return the name under which pyserial opens a robot's port: 'kiks://sim1/1'."""
        return f"kiks://{self.name}/{self.index_of(robot) + 1}"

    def travelled_mm(self, robot: int) -> float:
        """Return the length of a robot's path so far [mm]."""
        forwards_mm, backwards_mm, _ = self.distances_mm()[self.index_of(robot)]
        return float(forwards_mm + backwards_mm)

    def distances_mm(self) -> NDArray[np.float64]:
        """Return how far robots have come [mm], float64 [robot, 3].

        The columns are the way driven forwards, the way driven backwards, and the straight distance from where the
        robot started or was put last.
        """
        with self._up_to_date() as world:
            return world.distances_mm()

    def contacts(self, robot: int) -> int:
        """Return how often a robot has touched something so far: a wall, a robot, a ball or a cylinder."""
        index = self.index_of(robot)
        with self._up_to_date() as world:
            return int(world.state.robots["contact_count"][0, index])

    # ---- walls, balls, cylinders and lamps ----

    def set_arena(self, arena: Arena) -> None:
        """Replace the walls alone by those of an arena.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> sim.set_arena(kiks.Arena.box(800, 600))
            >>> sim.arena.width_mm
            800.0
        """
        _check_arena(arena)
        # These take a while: they are computed before other threads have to wait.
        free_space = FreeSpace(arena, self.world.specs, self.world.state)
        walls_of(arena)
        with self._changing() as world:
            world.set_arena(free_space)

    def add_ball(self, x_mm: float, y_mm: float, **changes: Any) -> int:
        """Add a ball at rest; return its number.

        Args:
            x_mm: Its centre [mm].
            y_mm: Its centre [mm].
            **changes: `radius_mm`, `friction_mm_s2` or `brightness` (1..255 or a material), where not the usual ones.

        Example:
            >>> from kiks import Arena, Simulation
            >>> sim = Simulation(Arena.box(500, 500))
            >>> ball = sim.add_ball(100, 100)
            >>> sim.move_body(ball, 100, 100, speed_mm_s=200.0)
            >>> sim.run(0.5)
            >>> round(float(sim.bodies()["x_mm"][0]), 1)
            197.5
        """
        with self._changing():
            return self.things.add_body(Ball, x_mm, y_mm, changes)

    def add_cylinder(self, x_mm: float, y_mm: float, **changes: Any) -> int:
        """Add a cylinder at rest; return its number. See `add_ball`.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> cylinder = sim.add_cylinder(100, 100, radius_mm=20)
            >>> sim.remove_body(cylinder)
        """
        with self._changing():
            return self.things.add_body(Cylinder, x_mm, y_mm, changes)

    def bodies(self) -> NDArray[np.void]:
        """Return balls and cylinders at this instant: a copy of the records of `kiks.engine.state.BODY`, shape [body].

        Of their fields `number`, `what` (3 a ball, 4 a cylinder), `x_mm`, `y_mm`, `velocity_x` and `velocity_y` [mm/s],
        `radius_mm` and `brightness` are of use.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> ball = sim.add_ball(100, 100)
            >>> sim.bodies()["x_mm"]
            array([100.])
        """
        with self._up_to_date() as world:
            return world.bodies()

    def move_body(
        self, body: int, x_mm: float, y_mm: float, *, speed_mm_s: float = 0.0, heading_rad: float = 0.0
    ) -> None:
        """Move a ball or cylinder elsewhere, or set it rolling.

        Args:
            body: Its number.
            x_mm: Where its centre goes [mm].
            y_mm: Where its centre goes [mm].
            speed_mm_s: How fast it rolls from there [mm/s].
            heading_rad: In which direction it rolls, counter-clockwise from the x axis [rad].

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> ball = sim.add_ball(100, 100)
            >>> sim.move_body(ball, 200, 100, speed_mm_s=100)
            >>> sim.run(1)
            >>> sim.bodies()["x_mm"].round()
            array([290.])
        """
        with self._changing():
            self.things.move_body(body, x_mm, y_mm, speed_mm_s, heading_rad)

    def change_body(self, body: int, **changes: Any) -> None:
        """Change a ball or cylinder: its `radius_mm`, `friction_mm_s2` [mm/s^2] or `brightness`.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> ball = sim.add_ball(100, 100)
            >>> sim.change_body(ball, radius_mm=40, brightness="wood")
            >>> sim.bodies()["radius_mm"]
            array([40.])
        """
        with self._changing():
            self.things.change_body(body, changes)

    def remove_body(self, body: int) -> None:
        """Remove a ball or cylinder."""
        with self._changing():
            self.things.remove_body(body)

    def add_lamp(self, x_mm: float, y_mm: float, power_w: float = 1.0, *, is_on: bool = True) -> int:
        """Add a lamp; return its row in `lamps`, counted from 1.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> lamp = sim.add_lamp(250, 300, power_w=2)
            >>> len(sim.lamps)
            1
        """
        with self._up_to_date():
            return self.things.add_lamp(x_mm, y_mm, power_w, is_on)

    def remove_lamp(self, lamp: int) -> None:
        """Remove a lamp; those below it move up a row."""
        with self._up_to_date():
            self.things.remove_lamp(lamp)

    def checkpoint(self) -> Checkpoint:
        """Return where everything stands, for `reset`.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> start = sim.checkpoint()
            >>> before = sim.pose(1)
            >>> sim.place(1, 100, 100, 0)
            >>> sim.reset(start)
            >>> sim.pose(1) == before
            True
        """
        with self._up_to_date():
            return self.things.checkpoint()

    def reset(self, checkpoint: Checkpoint) -> None:
        """Move everything back to a checkpoint: bodies and lamps added since then go, removed ones come back.

        Time, programs, wheels and counters go on.
        """
        with self._changing():
            self.things.reset(checkpoint)

    # ---- the score ----

    @property
    def score(self) -> Mapping[int | str, float | str]:
        """The score: numbers or texts by a robot's number or by a name; `set_score` writes it."""
        with self.lock:
            return MappingProxyType(dict(self.world.score))

    def set_score(self, what: int | str, value: float | str) -> None:
        """Set an entry of the score, which the desk shows while the run goes on; recordings keep it.

        Args:
            what: The number of the robot whose score it is, or a name, such as 'laps'.
            value: A number or a text.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500))
            >>> sim.set_score(1, 3)
            >>> sim.set_score("best lap", "12.4 s")
            >>> dict(sim.score)
            {1: 3, 'best lap': '12.4 s'}
        """
        with self.lock:
            score = self.world.score
            what = _score_text("what", what) if isinstance(what, str) else self.index_of(what) + 1
            if isinstance(value, str):
                value = _score_text("value", value)
            else:
                number = check_number("value", value, -SCORE_MAX, SCORE_MAX)
                value = int(number) if number.is_integer() else number
            if what not in score and len(score) == SCORE_ENTRIES_MAX:
                raise ParameterError(
                    f"a score must have at most {SCORE_ENTRIES_MAX} entries, but {shown(what)} would be one more. "
                    "Give an entry that is there another value."
                )
            if score.get(what) != value:
                score[what] = value
                if self.loop.recorder is not None:
                    self.loop.recorder.note((SCORE, self.now_ns, 0, 0, 0, json.dumps([what, value]).encode()))

    # ---- what sensors read ----

    def proximity(self, robot: int, *, noise: bool = False) -> list[float]:
        """Return what the eight proximity sensors would read if all were sampled at this instant.

        Args:
            robot: Its number.
            noise: True for the counts that command `N` would report now, with noise and rounding.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> sim.place(1, 250, 460, 1.5708)  # 10 mm before a wall
            >>> [round(count) for count in sim.proximity(1)]
            [3, 1023, 1023, 1023, 1023, 3, 3, 3]
        """
        index = self.index_of(robot)
        with self._up_to_date() as world:
            return readings(world, index, "proximity", noise)

    def proximity_at(self, robot: int, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what `proximity` would return if a robot stood at other poses, float64 [pose, 8].

        Nothing checks whether the robot fits there: a fit asks thousands of times. Poses are float64 [pose, 3]: x_mm,
        y_mm, heading_rad.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> import numpy as np
            >>> poses = np.array([[250, 460, 1.5708], [250, 250, 1.5708]])
            >>> sim.proximity_at(1, poses).shape
            (2, 8)
        """
        index = self.index_of(robot)
        with self._up_to_date() as world:
            return proximity_at(world, index, poses)

    def ambient(self, robot: int, *, noise: bool = False) -> list[float]:
        """Return the same for the light sensors, or the counts of command `O`.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> lamp = sim.add_lamp(250, 300)
            >>> [round(count) for count in sim.ambient(1)]
            [450, 419, 73, 74, 410, 450, 450, 450]
        """
        index = self.index_of(robot)
        with self._up_to_date() as world:
            return readings(world, index, "ambient", noise)

    def rays(self, robot: int) -> NDArray[np.float64]:
        """Return how far each ray of a robot's proximity sensors goes at this instant and pose, float64 [8, 7] [mm].

        The leftmost ray is first; lengths are counted from the sensor, and infinite where nothing is within its reach.
        They are exact, even where the robot's response uses coarser ones.
        """
        index = self.index_of(robot)
        with self._up_to_date() as world:
            lengths_mm, _, _, _ = trace_rays(world, index, 1)
            return np.ascontiguousarray(lengths_mm[0])

    def explain(self, robot: int, sensor: int) -> Explanation:
        """Return why command `N` returns what it returns for a proximity sensor at this instant.

        Example:
            >>> sim = Simulation(Arena.box(200, 200))
            >>> sim.place(1, 40.0, 100.0, 3.14159)
            >>> why = sim.explain(1, 2)
            >>> why.count == sim.proximity(1, noise=True)[2]
            True
            >>> why.rays[3].met, why.rays[3].brightness
            ('wall', 255)
        """
        with self._up_to_date() as world:
            return explain_proximity(world, robot, sensor)

    def explain_light(self, robot: int, sensor: int) -> LightExplanation:
        """Return the same for command `O` and a light sensor."""
        with self._up_to_date() as world:
            return explain_ambient(world, robot, sensor)

    def image(self, robot: int) -> list[float]:
        """Return what a K213 would see at this instant and pose, 64 greys from the left, without noise or rounding."""
        index = self.index_of(robot)
        with self._up_to_date():
            return self._turrets.cameras.expect(index)

    def look(self) -> Snapshot:
        """Return where everything is at this instant, and what all sensors see. This changes nothing."""
        with self._up_to_date() as world:
            return look(world)

    # ---- the run as a whole ----

    def record(self, file: str | Path) -> OpenRecording:
        """Record the run to a file from now on, until `close()` or the end of `with`; `kiks.Recording` reads it.

        The run is the same, to the bit. The page "Recordings" says what can be done with the file.

        Args:
            file: The file, which ends in .mcap; an earlier one is replaced.

        Returns:
            A `kiks.recording.recorder.RunRecorder`, with `mark(note)` for bookmarks.

        Example:
            >>> import tempfile, kiks
            >>> file = tempfile.mkdtemp() + "/run.mcap"
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> with sim.record(file) as recorder:
            ...     sim.run(1)
            ...     recorder.mark("here it turns")
            ...     sim.run(1)
        """
        return record_simulation(self, file)

    def plot(self, *, robot: int = 1) -> Figure:
        """Draw the run that is being recorded: paths, and a robot's odometry, readings, speeds and time.

        Returns:
            A Matplotlib figure, which notebooks show.
        """
        return plot_simulation(self, robot=robot)

    def record_paths(self, every_s: float = 0.1, *, points_max: int | None = None) -> None:
        """Record the paths of all robots, balls and cylinders from now on; earlier records are dropped.

        Args:
            every_s: Time between two points [s]: whole hundredths, at least one.
            points_max: Most points that are kept, from 2. When there are more, every second one is dropped, and from
                then on half as many come; None for all.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> sim.record_paths(every_s=0.1)
            >>> kiks.Khepera(sim.port(1)).set_speed(5, 5)
            >>> sim.run(1)
            >>> sim.paths().shape
            (1, 11, 4)
        """
        ticks = 100 * check_number("every_s", every_s, 0, 1e7, "Take 0.1.")
        if ticks < 1 - 1e-9 or abs(ticks - round(ticks)) > 1e-6:
            raise ParameterError(f"every_s must be a multiple of 0.01 s, but it was {shown(every_s)}. Take 0.1.")
        if points_max is not None:
            check_count("points_max", points_max, 2, 10**9, "Take 10000.")
        with self._up_to_date() as world:
            if self._paths is not None:
                world.unwatch(self._paths)
            self._paths = Paths(round(ticks), world.state, points_max)
            world.watch(self._paths)

    def paths(self) -> NDArray[np.float64]:
        """Return the paths since `record_paths`, float64 [robot, point, 4]: time_s, x_mm, y_mm, heading_rad.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> sim.record_paths(every_s=0.5)
            >>> sim.run(1)
            >>> sim.paths().shape
            (1, 3, 4)
        """
        with self.lock:
            return self._recorded().array()

    def body_paths(self) -> dict[int, list[tuple[float, float]]]:
        """Return where balls and cylinders were since `record_paths`, by their numbers: x_mm, y_mm."""
        with self.lock:
            return self._recorded().of_bodies()

    def _recorded(self) -> Paths:
        self.sync()
        if self._paths is None:
            raise ParameterError("paths must be recorded before they are asked for. Call record_paths() first.")
        return self._paths

    def state_hash(self) -> str:
        """Return 16 hexadecimal digits that any two equal runs agree on."""
        with self._up_to_date() as world:
            return world.state.hash()

    def show(
        self,
        *,
        speed: float | None = 1.0,
        is_alive: bool = False,
        port: int | None = None,
        browser: bool = True,
        address: str | None = None,
    ) -> View:
        """Show this simulation in a browser and print its address; in a notebook, below the cell.

        The run stays the same, to the bit, unless a user changes something.

        Args:
            speed: Simulated seconds per real second from now on; None for full speed.
            is_alive: Whether time passes by itself, in a thread; else only when the program lets it.
            port: TCP port of the page, on this computer only; 8123, or a free one, if left out.
            browser: False for its address alone.
            address: The address under which a browser reaches the page, if the program runs on another computer, such
                as `https://school.example/user/ada/proxy/{port}/`; the variable `KIKS_ADDRESS`, or that of
                `jupyter-server-proxy` on a JupyterHub, if left out.

        Returns:
            What is shown, with its `url`; `close()` ends it.

        Raises:
            LinkError: If the page cannot be served there.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> shown = sim.show(browser=False)  # doctest: +ELLIPSIS
            The desk: http://127.0.0.1:...
            >>> shown.url.startswith("http://127.0.0.1:")
            True
            >>> shown.close()
        """
        return show_in_browser(self, speed=speed, is_alive=is_alive, port=port, browser=browser, address=address)


class SimPort(VirtualPort):
    """The computer's end of a robot's line in a simulation of this process.

    Attributes:
        sim: The simulation.
        robot: Number of the robot, from 1.
    """

    def __init__(self, sim: Simulation, robot: int) -> None:
        super().__init__(LocalLine(sim.loop, robot), sim.program)
        watch_sleeps(sim, sim.world)
        self.sim = sim
        self.robot = robot

    def __reduce__(self) -> tuple[Any, ...]:
        return Simulation.port, (self.sim, self.robot), {"timeout": self.timeout, "write_timeout": self.write_timeout}

    def __setstate__(self, timeouts: dict[str, float | None]) -> None:
        self.timeout, self.write_timeout = timeouts["timeout"], timeouts["write_timeout"]

    def __repr__(self) -> str:
        state = "" if self.is_open else ", closed"
        return f"<{type(self).__name__}: robot {self.robot} of {self.sim.name}, {self.baudrate} bit/s{state}>"


SIMULATIONS: WeakValueDictionary[str, Simulation] = WeakValueDictionary()
"""The simulations of this process that are alive, by name, the oldest first."""

_NUMBERS = count(1)

SCORE_ENTRIES_MAX, SCORE_TEXT_MAX, SCORE_MAX = 16, 40, 1e9
"""Most entries of a score, characters of a name or text in it, and its largest number."""


def _score_text(name: str, text: str) -> str:
    if 0 < len(text) <= SCORE_TEXT_MAX and text.isprintable():
        return text
    raise ParameterError(
        f"{name} of a score must be a line of 1 to {SCORE_TEXT_MAX} characters, but it was {shown(text)}. Shorten it."
    )


def _check_arena(arena: object) -> None:
    """Check that this is an arena."""
    check_kind("arena", arena, Arena, "Give kiks.Arena.load('office'), or load a file with it.")

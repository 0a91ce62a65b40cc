"""Simulation: owns the state, the loop and the random streams, and lets time pass."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kiks.clock.program import Program
from kiks.engine import ambient, contact, proximity, step
from kiks.engine.networks import networks_for
from kiks.engine.numbers import uniform
from kiks.engine.parameters import pack
from kiks.engine.scene import enter_everybody, make_scene
from kiks.engine.state import State
from kiks.errors import ParameterError, nearest
from kiks.firmware.khepera import Firmware
from kiks.firmware.turret import Turret
from kiks.model.arena import PAD, Arena
from kiks.model.robot import SENSOR_COUNT, RobotSpec
from kiks.sim.cameras import Cameras
from kiks.sim.table import TABLE
from kiks.sim.wire import Wire
from kiks.units import TICK_NS, ns_from_s, s_from_ns

if TYPE_CHECKING:
    from kiks.ports.memory import SimPort

STREAM_PLACE = 4
"""Random stream of the places of robots for which the arena gives no start pose."""


class Simulation:
    r"""Robots in an arena, each at the end of a serial line.

    Time passes only when somebody lets it: a program that waits for a reply on a port, or `run`. Robots in one world
    do not see or touch each other yet.

    Args:
        arena: Where the robots drive; the classic 500 x 650 mm box if left out.
        robots: How many there are.
        seed: Seed of all random numbers; the same seed gives the same run, to the bit.
        thinking: What the program's own computing costs: 'none', 'fixed:MS', 'live', 'live:FACTOR' or 'replay:FILE'.
        robot: Kind of all robots: a name that `RobotSpec.load` knows, a file, or a `RobotSpec`.
        response: What makes counts of their proximity sensors' rays, such as 'thesis' or 'fast' (docs/sensors.md); what
            the robot's file says if left out.

    Attributes:
        lamps: The arena's lamps, float64 [lamp, 4]: x_mm, y_mm, power_w, and 1 for on or 0 for off. Write to it to
            move or switch them.

    Raises:
        ParameterError: If a number is out of range or a name unknown.
        ArenaError: If the arena has no free place for a robot.

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
        robots: int = 1,
        seed: int = 0,
        thinking: str = "none",
        robot: str | RobotSpec = "khepera",
        response: str | None = None,
    ) -> None:
        if not isinstance(arena, Arena | None):
            raise ParameterError(
                f"arena must be a kiks.Arena, but it was {arena!r}. Read a file with kiks.Arena.load(path)."
            )
        if not isinstance(robots, int) or not 1 <= robots <= 1000:
            raise ParameterError(
                f"robots must be a whole number from 1 to 1000, but it was {robots!r}. Say how many you need."
            )
        if not isinstance(seed, int) or not 0 <= seed < 2**63:
            raise ParameterError(
                f"seed must be a whole number from 0 to 2^63 - 1, but it was {seed!r}. Any small number will do."
            )
        self.arena = Arena.default() if arena is None else arena
        self.seed = seed
        self.thinking = thinking
        self.program = Program(thinking)
        spec = robot if isinstance(robot, RobotSpec) else RobotSpec.load(robot)
        self.spec = spec if response is None else spec.with_changes(proximity__response=response)
        self.robot_count = robots
        self.lock = threading.RLock()
        self.now_ns = 0
        self.state = State.empty(world_count=1, robot_count=robots)
        self._kinds = pack(self.spec)
        self._scene = make_scene(self.state, self._kinds, self.arena.width_mm, self.arena.height_mm)
        self._networks = networks_for(self.spec.proximity.response)
        self._ground = (self.arena.clearance, float(self.arena.mm_per_cell), PAD)
        self.sight = (
            self.arena.clearance,
            self.arena.surface,
            self.arena.faces,
            float(self.arena.mm_per_cell),
            PAD,
        )
        self.lamps = np.array(self.arena.lamps, np.float64).reshape(-1, 4)
        self._counts = np.zeros(SENSOR_COUNT, np.int64)
        self._expected = np.zeros(SENSOR_COUNT, np.float64)
        self._cameras = Cameras(self)
        self.wires = [Wire(self._firmware(index)) for index in range(robots)]
        self._ports: dict[int, SimPort] = {}
        for index in range(robots):
            self._put(index, *self._start(index))
        self.name = TABLE.enter(self)

    def _firmware(self, index: int) -> Firmware:
        return Firmware(
            self.spec,
            self.state,
            index,
            sense_proximity=partial(self._sense_proximity, index),
            sense_ambient=partial(self._sense_ambient, index),
        )

    def _sense_proximity(self, index: int, is_noisy: bool = True) -> list[Any]:
        return self._sense(proximity.read_proximity, self._networks, index, is_noisy)

    def _sense_ambient(self, index: int, is_noisy: bool = True) -> list[Any]:
        return self._sense(ambient.read_ambient, self.lamps, index, is_noisy)

    def _sense(self, read: Callable[..., Any], given: NDArray[Any], index: int, is_noisy: bool) -> list[Any]:
        """Return what an entry of the engine reads, which besides what rays meet needs one thing more."""
        out = self._counts if is_noisy else self._expected
        read(
            self._scene,
            self.sight,
            given,
            self.state.tick_count,
            self.now_ns,
            self.seed,
            index,
            is_noisy,
            out,
        )
        return out.tolist()

    def _start(self, index: int) -> tuple[float, float, float]:
        """Return the arena's start pose for a robot, else a free place: the roomiest for the first."""
        if index < len(self.arena.starts):
            return self.arena.starts[index]
        roomiest = self.arena.find_start(self.spec.body.radius_mm)
        if index == 0:
            return roomiest
        for attempt in range(1000):
            x, y, turn = (uniform(self.seed, 0, index, STREAM_PLACE, attempt, axis) for axis in range(3))
            x, y = x * self.arena.width_mm, y * self.arena.height_mm
            if self.arena.free_for(x, y, self.spec.body.radius_mm):
                return x, y, 2 * math.pi * turn
        return roomiest

    # ---- time ----

    @property
    def time_s(self) -> float:
        """Simulated time since the start [s]."""
        return s_from_ns(self.now_ns)

    def run(self, seconds: float) -> None:
        """Let simulated time pass: robots drive on, and commands on the line act when they are due.

        Args:
            seconds: How long [s].

        Raises:
            ParameterError: If it is negative or not finite.
        """
        if not (isinstance(seconds, int | float) and math.isfinite(seconds) and seconds >= 0):
            raise ParameterError(
                f"seconds must be a finite number of at least 0, but it was {seconds!r}. Time never runs backwards."
            )
        with self.lock:
            self.advance_to(self.now_ns + ns_from_s(seconds))

    def advance_to(self, time_ns: int) -> None:
        """Let time pass up to a time [ns]; nothing happens if it is over already."""
        wire = self._next_wire()
        while wire.next_ns is not None and wire.next_ns <= time_ns:
            if wire.next_ns > self.now_ns:
                self.now_ns = wire.next_ns
            self.sync()
            wire.act(self.now_ns)
            wire = self._next_wire()
        if time_ns > self.now_ns:
            self.now_ns = time_ns

    def next_event_ns(self) -> int | None:
        """Return when a robot does something next [ns], None while all of them wait for characters."""
        return self._next_wire().next_ns

    def _next_wire(self) -> Wire:
        """Return the wire that acts first; of two at the same instant the one with the lower number."""
        first = self.wires[0]
        if self.robot_count > 1:
            for wire in self.wires:
                if wire.next_ns is not None and (first.next_ns is None or wire.next_ns < first.next_ns):
                    first = wire
        return first

    def sync(self) -> None:
        """Do the ticks that have begun: the engine is behind the clock until somebody looks."""
        if self._cameras:
            self._cameras.sync()
        self.tick_to(self.now_ns)

    def tick_to(self, time_ns: int) -> None:
        """Do the ticks that have begun up to a time [ns]."""
        ticks = -(-time_ns // TICK_NS) - self.state.tick_count
        if ticks > 0:
            step.advance(self._scene, self._ground, self.seed, self.state.tick_count, ticks)
            self.state.tick_count += ticks

    # ---- robots ----

    def _index(self, robot: int) -> int:
        if not isinstance(robot, int) or not 1 <= robot <= self.robot_count:
            numbers = "robot 1" if self.robot_count == 1 else f"robots 1 to {self.robot_count}"
            raise ParameterError(
                f"robot must be the number of one there is, but it was {robot!r}. This simulation has {numbers}."
            )
        return robot - 1

    def port(self, robot: int) -> SimPort:
        """Return the computer's end of a robot's line: one object, always the same.

        Args:
            robot: Number of the robot, from 1.

        Raises:
            ParameterError: If there is no such robot.
        """
        from kiks.ports.memory import SimPort

        index = self._index(robot)
        if index not in self._ports:
            self._ports[index] = SimPort(self, robot)
        return self._ports[index]

    def url(self, robot: int) -> str:
        """Return the name under which pyserial opens a robot's port: 'kiks://sim1/1'.

        Raises:
            ParameterError: If there is no such robot.
        """
        return f"kiks://{self.name}/{self._index(robot) + 1}"

    def fit(self, robot: int, turret: str | Turret) -> None:
        r"""Put a turret on a robot; it answers to `T,<its number>,...` from now on.

        Args:
            robot: Number of the robot, from 1.
            turret: 'k213', the linear camera, or an object of your own.

        Raises:
            ParameterError: If there is no such robot or turret.

        Example:
            >>> sim = Simulation()
            >>> sim.fit(1, "k213")
            >>> port = sim.port(1)
            >>> port.write(b"T,2,B\n"); port.readline()
            6
            b't,2,b,1,0\r\n'
        """
        index = self._index(robot)
        if isinstance(turret, str) and turret != "k213":
            raise ParameterError(
                f"turret must be 'k213' or an object of your own, but it was {turret!r}.{nearest(turret, ['k213'])} "
                f"kiks.firmware.turret.Turret says what such an object must be able to do."
            )
        with self.lock:
            self.sync()
            fitted = self._cameras.fit(index) if isinstance(turret, str) else turret
            self.wires[index].firmware.turrets[fitted.number] = fitted

    def pose(self, robot: int) -> tuple[float, float, float]:
        """Return where a robot is at this very instant: x_mm, y_mm, heading_rad (not wrapped).

        Raises:
            ParameterError: If there is no such robot.
        """
        index = self._index(robot)
        with self.lock:
            self.sync()
            x_mm, y_mm, heading_rad = proximity.pose_of(self.state.robots, self.state.tick_count, self.now_ns, index)
        return x_mm, y_mm, heading_rad

    def place(self, robot: int, x_mm: float, y_mm: float, heading_rad: float) -> None:
        """Lift a robot and put it down somewhere else; its wheels and counters do not notice.

        Args:
            robot: Number of the robot, from 1.
            x_mm: From the arena's lower left corner to the right.
            y_mm: From the arena's lower left corner upwards.
            heading_rad: Counter-clockwise from the x axis.

        Raises:
            ParameterError: If there is no such robot, a number is not finite, or a wall is in the way.
        """
        index = self._index(robot)
        for name, value in (("x_mm", x_mm), ("y_mm", y_mm), ("heading_rad", heading_rad)):
            if not math.isfinite(value):
                raise ParameterError(f"{name} must be finite, but it was {value!r}.")
        gap_mm = contact.clearance_of_disc(*self._ground, float(x_mm), float(y_mm), self.spec.body.radius_mm)
        inside = 0 <= x_mm <= self.arena.width_mm and 0 <= y_mm <= self.arena.height_mm
        if gap_mm < -0.01 or not inside:
            raise ParameterError(
                f"the place of robot {robot} must be free, but at ({x_mm:g}, {y_mm:g}) mm "
                f"a wall is {-gap_mm:.1f} mm inside it. "
                f"The arena is {self.arena.width_mm:g} x {self.arena.height_mm:g} mm; the robot needs a radius of "
                f"{self.spec.body.radius_mm:g} mm."
            )
        with self.lock:
            self.sync()
            self._put(index, float(x_mm), float(y_mm), float(heading_rad))
            self._cameras.replace(index)

    def _put(self, index: int, x_mm: float, y_mm: float, heading_rad: float) -> None:
        robot: Any = self.state.robots[0, index]
        robot["x_mm"], robot["y_mm"], robot["heading_rad"] = x_mm, y_mm, heading_rad
        robot["trail"][:] = (x_mm, y_mm, heading_rad)
        enter_everybody(self._scene)

    def proximity(self, robot: int, *, noise: bool = False) -> list[float]:
        """Return what the eight proximity sensors would read at this instant and pose, without waiting for their round.

        Args:
            robot: Number of the robot, from 1.
            noise: True for the counts that command `N` would report now, with noise and rounding.

        Raises:
            ParameterError: If there is no such robot.
        """
        index = self._index(robot)
        with self.lock:
            self.sync()
            return [float(count) for count in self._sense_proximity(index, noise)]

    def ambient(self, robot: int, *, noise: bool = False) -> list[float]:
        """Return what the eight light sensors would read at this instant and pose, without waiting for their round.

        Args:
            robot: Number of the robot, from 1.
            noise: True for the counts that command `O` would report now, with noise and rounding.

        Raises:
            ParameterError: If there is no such robot.
        """
        index = self._index(robot)
        with self.lock:
            self.sync()
            return [float(count) for count in self._sense_ambient(index, noise)]

    def image(self, robot: int) -> list[float]:
        """Return what a K213 would see at this instant and pose, 64 greys from the left, without noise or rounding.

        Raises:
            ParameterError: If there is no such robot.
        """
        index = self._index(robot)
        with self.lock:
            self.sync()
            return self._cameras.expect(index)

    def travelled_mm(self, robot: int) -> float:
        """Return the length of a robot's path so far [mm].

        Raises:
            ParameterError: If there is no such robot.
        """
        index = self._index(robot)
        with self.lock:
            self.sync()
            return float(self.state.robots["travelled_mm"][0, index])

    def contacts(self, robot: int) -> int:
        """Return how often a robot has met a wall so far.

        Raises:
            ParameterError: If there is no such robot.
        """
        index = self._index(robot)
        with self.lock:
            self.sync()
            return int(self.state.robots["contact_count"][0, index])

    def state_hash(self) -> str:
        """Return 16 hexadecimal digits that any two equal runs agree on."""
        with self.lock:
            self.sync()
            return self.state.hash()

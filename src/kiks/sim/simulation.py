"""Simulation: robots at the ends of serial lines, and time that passes when somebody lets it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kiks.clock.gate import Gate
from kiks.clock.program_clock import ProgramClock
from kiks.engine.sensing import ambient, proximity
from kiks.engine.sensing.thesis_networks import networks_for
from kiks.errors import ParameterError, shown
from kiks.firmware.k213 import K213
from kiks.firmware.khepera import Firmware
from kiks.firmware.radio import Radio, deliver
from kiks.firmware.turret import Turret
from kiks.model.arena import Arena
from kiks.model.checks import CLOCK_END_NS, SECONDS_MAX, check_count, check_number
from kiks.model.robot import SENSOR_COUNT, RobotSpec, specs_of
from kiks.sim.cameras import Cameras
from kiks.sim.explanation import Explanation, LightExplanation, explain_ambient, explain_proximity
from kiks.sim.registry import REGISTRY
from kiks.sim.snapshot import Snapshot, look, trace_rays
from kiks.sim.things import Things
from kiks.sim.turret_host import RobotSite, first_memory, named
from kiks.sim.wire import Agenda, Wire
from kiks.sim.world import check_arena, check_kinds
from kiks.units import ns_from_s

if TYPE_CHECKING:
    from kiks.desk.server.show import Shown
    from kiks.ports.memory import SimPort


class Simulation(Things):
    r"""Robots in an arena, each at the end of a serial line.

    Time passes only when somebody lets it: a program that waits for a reply on a port, or `run`.

    Args:
        arena: Where the robots drive; the classic 500 x 650 mm box if left out.
        robots: How many there are; as many as kinds are named if left out.
        seed: Seed of all random numbers; the same seed gives the same run, to the bit.
        thinking: What the program's own computing costs: 'none', 'fixed:MS', 'live', 'live:FACTOR' or 'replay:FILE'.
        robot: Kind of all robots: a name that `RobotSpec.load` knows, a file, or a `RobotSpec`; or a list of such, one
            for each robot.
        response: What makes counts of their proximity sensors' rays, such as 'thesis' or 'fast' (docs/sensors.md); what
            the robot's file says if left out.

    Attributes:
        gate: Where its time passes while somebody watches; None while nobody does.
        networks: What the responses of its robots need besides rays.

    Raises:
        ParameterError: If a number is out of range or a name unknown.
        ArenaError: If the arena has no free place for a robot, a ball or a cylinder.

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
            check_arena(arena)
        check_kinds(robot, response)
        robots = None if robots is None else check_count("robots", robots, 1, 1000, "Say how many you need.")
        seed = check_count("seed", seed, 0, 2**63 - 1, "Any small number will do.")
        self.thinking = thinking
        self.program = ProgramClock(thinking)
        self.gate: Gate | None = None
        self._cameras = Cameras(self)
        super().__init__(Arena.default() if arena is None else arena, specs_of(robot, robots, response), seed)
        self.spec = self.specs[0]
        self.networks = networks_for(*(spec.proximity.response for spec in self.specs))
        self._counts = np.zeros(SENSOR_COUNT, np.int64)
        self._expected = np.zeros(SENSOR_COUNT, np.float64)
        self._radios: dict[int, Radio] = {}
        self._agenda = Agenda()
        self.wires = [Wire(self._firmware(index), self._agenda, index) for index in range(self.robot_count)]
        self._ports: dict[int, SimPort] = {}
        self.name = REGISTRY.enter(self)

    def _firmware(self, index: int) -> Firmware:
        return Firmware(
            self.specs[index],
            self.state,
            index,
            sense_proximity=partial(self._sense_proximity, index),
            sense_ambient=partial(self._sense_ambient, index),
        )

    def _sense_proximity(self, index: int, is_noisy: bool = True) -> list[Any]:
        return self._sense(proximity.read_proximity, self.networks, index, is_noisy)

    def _sense_ambient(self, index: int, is_noisy: bool = True) -> list[Any]:
        return self._sense(ambient.read_ambient, self.lamps, index, is_noisy)

    def _sense(self, read: Callable[..., Any], given: NDArray[Any], index: int, is_noisy: bool) -> list[Any]:
        """Return what an entry of the engine reads, which besides what rays meet needs one thing more."""
        if not isinstance(is_noisy, bool):
            raise ParameterError(f"noise must be True or False, but it was {shown(is_noisy)}.")
        out = self._counts if is_noisy else self._expected
        read(
            self.scene,
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

    # ---- time ----

    def run(self, seconds: float) -> None:
        """Let simulated time pass: robots drive on, and commands on the line act when they are due.

        Args:
            seconds: How long [s], at most 1e9.

        Raises:
            ParameterError: If it is negative, too long or no number.
        """
        passing_ns = ns_from_s(check_number("seconds", seconds, 0, SECONDS_MAX, "Time never runs backwards."))
        with self.lock:
            self.advance_to(self.now_ns + passing_ns)

    def advance_to(self, time_ns: int) -> None:
        """Let time pass up to a time [ns]; nothing happens if it is over already.

        Raises:
            ParameterError: If it is no whole number, or beyond the end of the clock.
        """
        if not (time_ns.__class__ is int and time_ns <= CLOCK_END_NS):
            time_ns = check_count("time_ns", time_ns, -CLOCK_END_NS, CLOCK_END_NS)
        gate = self.gate
        if gate is not None and gate.is_up:
            while (until_ns := gate.admit(self.now_ns, time_ns)) < time_ns:
                self._advance_to(until_ns)
        self._advance_to(time_ns)

    def _advance_to(self, time_ns: int) -> None:
        wire = self._agenda.first(self.wires)
        while wire.next_ns is not None and wire.next_ns <= time_ns:
            if wire.next_ns > self.now_ns:
                self.now_ns = wire.next_ns
            self.sync()
            wire.act(self.now_ns)
            wire = self._agenda.first(self.wires)
        if time_ns > self.now_ns:
            self.now_ns = time_ns

    def next_event_ns(self) -> int | None:
        """Return when a robot does something next [ns], None while all of them wait for characters."""
        return self._agenda.first(self.wires).next_ns

    def sync(self) -> None:
        """Do the ticks that have begun; let cameras take the pictures that are due on the way, and messages arrive."""
        if self._cameras:
            self._cameras.sync()
        super().sync()
        if self._radios:
            deliver(self._radios, self.now_ns)

    # ---- to be seen ----

    def show(
        self, *, speed: float | None = 1.0, is_alive: bool = False, port: int | None = None, browser: bool = True
    ) -> Shown:
        """Show this world in a browser, to be watched, paused and touched, and say where; in a notebook below the cell.

        Looking changes nothing: the run is the same, to the bit, unless somebody reaches in.

        Args:
            speed: Simulated seconds in a real one from now on; None for as fast as possible.
            is_alive: Whether time passes by itself, in a thread; else it does when the program lets it.
            port: TCP port of the page, on this computer only; 8123, or a free one, if left out.
            browser: False for its address alone.

        Returns:
            What is shown, with its `url`; `close()` ends it.

        Raises:
            LinkError: If the page cannot be served there.
            ParameterError: If the speed is out of range, or the desk is open on another port.
        """
        from kiks.desk.server.show import show

        return show(self, speed=speed, is_alive=is_alive, port=port, browser=browser)

    # ---- robots ----

    def add_robot(self, robot: str | RobotSpec = "khepera") -> int:
        """Put one more robot into the world; return its number.

        It starts where the arena has a start for it, if that is free, else at a random place. Robots, programs and
        bodies that are there do not notice, until they meet it.

        Args:
            robot: Its kind: a name that `RobotSpec.load` knows, a file, or a `RobotSpec`.

        Raises:
            ParameterError: If there is no such kind.
            ArenaError: If there is no free place for it.

        Example:
            >>> sim = Simulation(Arena.box(500, 500))
            >>> sim.add_robot("khepera_ii")
            2
        """
        check_kinds(robot)
        (spec,) = specs_of(robot, 1, None)
        with self.lock:
            self.sync()
            index = self._add_robot(spec)
            for wire in self.wires:
                wire.firmware.take(self.state)
            self._cameras.take()
            self.networks = networks_for(*(spec.proximity.response for spec in self.specs))
            self.wires.append(Wire(self._firmware(index), self._agenda, index))
            self._enter()
            return index + 1

    def port(self, robot: int) -> SimPort:
        """Return the computer's end of a robot's line: one object, always the same.

        Args:
            robot: Number of the robot, from 1.

        Raises:
            ParameterError: If there is no such robot.
        """
        from kiks.ports.memory import SimPort

        index = self.index_of(robot)
        if index not in self._ports:
            self._ports[index] = SimPort(self, robot)
        return self._ports[index]

    def url(self, robot: int) -> str:
        """Return the name under which pyserial opens a robot's port: 'kiks://sim1/1'.

        Raises:
            ParameterError: If there is no such robot.
        """
        return f"kiks://{self.name}/{self.index_of(robot) + 1}"

    def fit(self, robot: int, turret: str | Turret) -> Turret:
        r"""Put a turret on a robot; it answers to `T,<its number>,...` from now on (docs/turrets.md).

        Args:
            robot: Number of the robot, from 1.
            turret: 'k213' (the linear camera), 'gripper', 'radio', 'io' (General I/O), 'battle', or one of your own.

        Returns:
            The turret, which 'io' and some of your own are set and read by.

        Raises:
            ParameterError: If there is no such robot or turret, or the robot has one of its number already.

        Example:
            >>> sim = Simulation()
            >>> camera = sim.fit(1, "k213")
            >>> port = sim.port(1)
            >>> port.write(b"T,2,B\n"); port.readline()
            6
            b't,2,b,1,0\r\n'
        """
        index = self.index_of(robot)
        with self.lock:
            self.sync()
            firmware = self.wires[index].firmware
            fitted = named(turret, partial(self._cameras.camera, index))
            there = [each for each in firmware.fitted if each.number == fitted.number]
            if there:
                raise ParameterError(
                    f"turret must be one that robot {robot} has not got, but {shown(there[0].name)} has its number, "
                    f"{fitted.number}. Give a turret of your own another, 24 to 31."
                )
            fitted.fit(RobotSite(self, index, fitted, first_memory(fitted, firmware.fitted)))
            firmware.fit(fitted)
            if isinstance(fitted, Radio):
                self._radios = fitted.site.turrets(Radio)
            elif isinstance(fitted, K213):
                self._cameras.fit(index, fitted)
        return fitted

    def turrets(self, robot: int) -> tuple[Turret, ...]:
        """Return the turrets that a robot carries, in the order in which they were fitted.

        Raises:
            ParameterError: If there is no such robot.
        """
        return tuple(self.wires[self.index_of(robot)].firmware.fitted)

    def _look_again(self) -> None:
        super()._look_again()
        self._cameras.look_again()

    def proximity(self, robot: int, *, noise: bool = False) -> list[float]:
        """Return what the eight proximity sensors would read at this instant and pose, without waiting for their round.

        Args:
            robot: Number of the robot, from 1.
            noise: True for the counts that command `N` would report now, with noise and rounding.

        Raises:
            ParameterError: If there is no such robot.
        """
        index = self.index_of(robot)
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
        index = self.index_of(robot)
        with self.lock:
            self.sync()
            return [float(count) for count in self._sense_ambient(index, noise)]

    def rays(self, robot: int) -> NDArray[np.float64]:
        """Return how far each ray of a robot's proximity sensors goes at this instant and pose, float64 [8, 7] [mm].

        The leftmost ray is first; lengths are counted from the sensor, and infinite where nothing is within its reach.
        They are exact, however roughly the robot's response takes them.

        Raises:
            ParameterError: If there is no such robot.
        """
        index = self.index_of(robot)
        with self.lock:
            self.sync()
            lengths_mm, _, _, _ = trace_rays(self, index, 1)
            return np.ascontiguousarray(lengths_mm[0])

    def explain(self, robot: int, sensor: int) -> Explanation:
        """Return why command `N` returns what it returns for a proximity sensor at this instant.

        Args:
            robot: Number of the robot, from 1.
            sensor: Index of the sensor in the answer to `N`, from 0.

        Raises:
            ParameterError: If there is no such robot or sensor.

        Example:
            >>> sim = Simulation(Arena.box(200, 200))
            >>> sim.place(1, 40.0, 100.0, 3.14159)
            >>> why = sim.explain(1, 2)
            >>> why.count == sim.proximity(1, noise=True)[2]
            True
            >>> why.rays[3].met, why.rays[3].brightness
            ('wall', 255)
        """
        with self.lock:
            self.sync()
            return explain_proximity(self, self.networks, robot, sensor)

    def explain_light(self, robot: int, sensor: int) -> LightExplanation:
        """Return why command `O` returns what it returns for a light sensor at this instant.

        Args:
            robot: Number of the robot, from 1.
            sensor: Index of the sensor in the answer to `O`, from 0.

        Raises:
            ParameterError: If there is no such robot or sensor.
        """
        with self.lock:
            self.sync()
            return explain_ambient(self, robot, sensor)

    def look(self) -> Snapshot:
        """Return where everybody is at this instant, and what all sensors see; looking changes nothing."""
        with self.lock:
            self.sync()
            return look(self, self.networks)

    def image(self, robot: int) -> list[float]:
        """Return what a K213 would see at this instant and pose, 64 greys from the left, without noise or rounding.

        Raises:
            ParameterError: If there is no such robot.
        """
        index = self.index_of(robot)
        with self.lock:
            self.sync()
            return self._cameras.expect(index)

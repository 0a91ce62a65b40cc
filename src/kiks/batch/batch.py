"""Many worlds at once, on all cores."""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kiks.batch.callbacks import NO_DECIDERS, deciders_of
from kiks.batch.initial_state import CAMERA, InitialState
from kiks.batch.kernel_args import Worlds
from kiks.batch.loop import roll_out
from kiks.batch.loop_timing import Timing
from kiks.batch.measure_slots import MeasureSlots
from kiks.batch.rollouts import Rollouts
from kiks.control.actuators import NOTHING, WHEELS, AnyActuator, check_actuators, order_rows_of, orders_of
from kiks.control.compiled_function import Compiled, explained
from kiks.control.controller import Controller
from kiks.control.measure import Measure
from kiks.control.robot_controllers import RobotControllers
from kiks.control.senses import AnySense, check_senses, conversions_of, reading_count, rows_of, sense_of
from kiks.control.turret_parts import turrets_of
from kiks.engine.bunch import worlds_in_bunch
from kiks.engine.scene import Scene, enter_worlds
from kiks.engine.simd.lanes import LANES
from kiks.engine.state import State
from kiks.errors import ParameterError, counted, shown
from kiks.firmware.robot_kind import RobotKind, robot_kind
from kiks.model.arena import Arena
from kiks.model.array_checks import array_of, check_numbers
from kiks.model.checks import SECONDS_MAX, check_count, check_kind, check_number
from kiks.model.robot import RobotSpec
from kiks.units import NS_PER_S, ns_from_s
from kiks.upwards import shown_in_notebooks

BLOCKS_PER_THREAD = 4
"""Blocks of worlds per thread: with several, no thread waits long for the slowest one."""

UNLIMITED = 2**62
"""More half loops than a run has, and a time [ns] after its end."""

STEP_BLOCK = 64
"""Fewest worlds per thread for a single step, which takes some microseconds per world."""


Method = TypeVar("Method", bound=Callable[..., Any])


def _alone(method: Method) -> Method:
    """Let one thread after the other call a method of a batch: they share its arrays."""

    @functools.wraps(method)
    def call(batch: Batch, *args: Any, **options: Any) -> Any:
        with batch._lock:
            return method(batch, *args, **options)

    return call  # type: ignore[return-value]


@shown_in_notebooks("kiks.export.notebook", "arenas")
class Batch:
    """Many worlds with the same number of robots, each with its own seed, start poses and kinds of robots.

    A world agrees to the bit with a `kiks.Simulation` of the same seed whose robots `kiks.drive` drives with the same
    `timing`: the same readings, the same poses, the same hash; `kiks.verify` compares them. Threads may share a batch;
    they take turns.

    Args:
        arena: One arena for all worlds, or several, which the worlds take in turn. All arenas must hold the same number
            of balls and cylinders.
        worlds: Number of worlds.
        robot: Kind of the robots: one for all, one for each world (such as a family), or, with several robots in a
            world, a list for each world. A kind is the name of a robot file or a `kiks.RobotSpec`.
        robots: Number of robots in each world.
        seed: Seed of world 0, from which the other seeds count up; or a seed for each world, int64 [world].
        starts: Start poses: x_mm, y_mm, heading_rad, float64 [world, robot, 3] or anything that broadcasts to it; the
            start poses of a simulation with the world's seed if left out.
        senses: Readings that `reset` and `step` return, as for `kiks.Controller`; `run` uses its controller's. Robots
            carry the turrets that their senses need; a camera takes a picture every 200 ms.
        actuators: Actuators that `step` takes outputs for, likewise.
        measures: Measures for step-by-step use, see `values`, and for a `run` that names no others.
        timing: Timing of the control loop.
        response: Response of the proximity sensors, if not that of the robots' files.
        threads: Number of threads; the number of cores if left out. Results do not depend on it.

    Attributes:
        notes: State slots of the measures for step-by-step use, float64 [world, robot, note].
        has_own_starts: Whether a world has start poses that were given, not those of a simulation, bool [world].

    Example:
        >>> import kiks
        >>> @kiks.controller(parameters=2)
        ... def ahead(sensors, memory, parameters, wheels):
        ...     wheels[:] = parameters
        >>> batch = kiks.Batch(kiks.Arena.box(1000, 1000), worlds=3, starts=(500, 500, 0))
        >>> rollouts = batch.run(ahead, [[5, 5], [0, 0], [-5, 5]], seconds=1, measures=[kiks.measures.path_mm])
        >>> rollouts.values[:, 0, 0].round(1)
        array([34.6,  0. ,  0.5])
        >>> batch.take_arenas(np.array([1]), [0])
        >>> batch.reset().shape, batch.step(np.full((3, 1, 2), 5.0)).shape
        ((3, 1, 8), (3, 1, 8))
        >>> batch.state_of(0).hash() == batch.state_hash(0)
        True
    """

    def __init__(
        self,
        arena: Arena | Sequence[Arena],
        worlds: int,
        *,
        robot: str | RobotSpec | Sequence[Any] = "khepera",
        robots: int = 1,
        seed: int | ArrayLike = 0,
        starts: ArrayLike | None = None,
        senses: AnySense | Sequence[AnySense] = ("proximity",),
        actuators: AnyActuator | Sequence[AnyActuator] = (WHEELS,),
        measures: Sequence[Measure] = (),
        timing: Timing | None = None,
        response: str | None = None,
        threads: int | None = None,
    ) -> None:
        self._lock = threading.RLock()
        self.timing = Timing() if timing is None else check_kind("timing", timing, Timing)
        self._initial_state = initial = InitialState(arena, worlds, robot, robots, response)
        self.arenas, self.arena_indices = initial.arenas, initial.arena_indices
        self.specs, self.networks = initial.specs, initial.networks
        self.world_count, self.robot_count = len(self.arena_indices), initial.robot_count
        self.threads = check_count("threads", (os.cpu_count() or 1) if threads is None else threads, 1, 4096)
        self.senses = check_senses(senses)
        self.actuators = check_actuators(actuators)
        orders = orders_of(self.actuators)
        self._parts = (*map(sense_of, self.senses), *orders)
        self._turrets = [turrets_of(self._parts)] * self.robot_count
        self.state = State.empty(
            world_count=self.world_count, robot_count=self.robot_count, body_count=initial.body_count
        )
        self._lamps = initial.lamps[self.arena_indices]
        self.seeds = initial.seeds_of(seed)
        self._starts = initial.starts_of(self.seeds, starts)
        self.has_own_starts = np.full(self.world_count, starts is not None)
        self._scenes = self._make_scenes()
        self._watching = MeasureSlots(measures, self.senses, "the batch")
        shape = self.state.robots.shape
        self.notes = np.zeros((*shape, self._watching.note_count))
        parts = (
            *(self.timing.line(self.specs[0]), rows_of(self.senses, self._kind)),
            *conversions_of(self.senses, self._kind),
            np.full(self.robot_count, len(self.senses)),
            np.full(self.robot_count, CAMERA in self._turrets[0]),
            *(np.zeros(self.world_count, np.int64) for _ in range(5)),
            *(np.zeros((*shape, count)) for count in (reading_count(self.senses), 2 + len(orders))),
            np.zeros(shape, np.int64),
            *(np.zeros((*shape, 0)), np.zeros((*shape, 0)), self.notes),
            *(order_rows_of(self._parts), np.full(self.robot_count, len(orders))),
            np.full((*shape, len(orders)), NOTHING),
            *(each[self.arena_indices] for each in initial.switches),
            np.zeros(self.world_count, np.int64),
        )
        self._worlds = Worlds._make(parts)
        self._is_sensed = False
        self._reset_worlds(np.arange(self.world_count), self._turrets)

    @property
    def _kind(self) -> RobotKind:
        # One program drives all robots of a world, by the letters of the first.
        return robot_kind(self.specs[0].kind)

    def _make_scenes(self) -> list[Scene]:
        scene = Scene(self.state, self._initial_state.kinds, self.arenas, self.networks, self._lamps, self.seeds)
        return [scene.in_arena(arena) for arena in self.arenas]

    def __getstate__(self) -> dict[str, Any]:
        with self._lock:
            return {name: part for name, part in vars(self).items() if name not in ("_lock", "_pool", "_scenes")}

    def __setstate__(self, parts: dict[str, Any]) -> None:
        vars(self).update(parts)
        self._lock, self._scenes = threading.RLock(), self._make_scenes()
        self._worlds = self._worlds._replace(
            senses=rows_of(self.senses, self._kind), orders=order_rows_of(self._parts)
        )  # which are addresses

    def __repr__(self) -> str:
        robots = counted(self.robot_count, "robot")
        return f"<Batch: {counted(self.world_count, 'world')} of {robots} in {counted(len(self.arenas), 'arena')}>"

    # ---- all at once ----

    @_alone
    def run(
        self,
        controller: Controller | Sequence[Controller],
        parameters: Any = (),
        *,
        seconds: float,
        measures: Sequence[Measure] | None = None,
        until: Measure | None = None,
    ) -> Rollouts:
        """Reset all worlds, let controllers drive the robots, and return the values of the measures.

        Args:
            controller: The controller of all robots, or a list with one for each robot of a world. The senses of each
                must come first among those of the one that has the most.
            parameters: Its parameters: float64 [parameter] for all robots, [world, parameter] for all of a world, or
                [world, robot, parameter]. With a list of controllers, a list with the parameters of each: [parameter]
                or [world, parameter].
            seconds: Simulated time after which no loop begins [s].
            measures: The measures; those of the batch if left out.
            until: A measure that ends the trial of a world: no further loop begins there once its first note is above
                zero for one of its robots.

        Example:
            >>> import kiks
            >>> batch = kiks.Batch(kiks.Arena.box(500, 500), 3, seed=1)
            >>> rollouts = batch.run(kiks.controllers.linear(), [0.5] * 18, seconds=2, measures=[kiks.measures.path_mm])
            >>> rollouts.values.shape
            (3, 1, 1)
        """
        until_ns = ns_from_s(check_number("seconds", seconds, 0, SECONDS_MAX))
        measures = self._watching.measures if measures is None else measures
        worlds, watching, roll = self._begin(controller, parameters, measures, until)
        roll(0, UNLIMITED, until_ns)
        names = tuple(name for each in measures for name in each.value_names)
        return Rollouts(watching.values(worlds.notes), worlds.steps.copy(), names, self.seeds.copy())

    @_alone
    def loops(
        self, controller: Controller | Sequence[Controller], parameters: Any = (), *, seconds: float
    ) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Do what `run` does, one control loop at a time: reset all worlds at once, and yield after each loop.

        `poses`, `times_s` and `state_hash` then are those of its end. A world whose time is over stays as it is.

        Args:
            controller: As for `run`.
            parameters: As for `run`.
            seconds: As for `run` [s].

        Returns:
            For each loop the readings, float64 [world, robot, sensor], and the outputs that were sent,
            float64 [world, robot, output]; copies.

        Example:
            >>> import kiks
            >>> batch = kiks.Batch(kiks.Arena.box(500, 500), 3, starts=(250, 250, 0))
            >>> loops = batch.loops(kiks.controllers.linear(), [0.5, 0.5] + [0.0] * 16, seconds=0.5)
            >>> [round(batch.poses[0, 0, 0]) for readings, outputs in loops]  # where world 0's robot is
            [252, 255, 259, 263, 267]
        """
        until_ns = ns_from_s(check_number("seconds", seconds, 0, SECONDS_MAX))
        worlds, _, roll = self._begin(controller, parameters)

        def yielded() -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
            while worlds.begins_ns.min() < until_ns:
                with self._lock:
                    roll(0, 2, until_ns)
                yield worlds.sensors.copy(), worlds.wheels.copy()

        return yielded()

    def _begin(
        self,
        controller: Controller | Sequence[Controller],
        parameters: Any,
        measures: Sequence[Measure] = (),
        until: Measure | None = None,
    ) -> tuple[Any, MeasureSlots, Callable[[int, int, int], None]]:
        """Reset all worlds; return them with their controllers, the measures, and a function that does halves of loops.

        That takes the first half, the first one not to do, and a time at and after which no loop begins [ns].
        """
        driving = RobotControllers(controller, parameters, self.world_count, self.robot_count)
        watching = MeasureSlots(measures, driving.common_senses, driving.names, until)
        shape = (self.world_count, self.robot_count)
        self._reset_worlds(np.arange(self.world_count), driving.turrets)
        self._is_sensed = False
        scales, sensor_orders = conversions_of(driving.senses, self._kind)
        worlds = self._worlds._replace(
            senses=rows_of(driving.senses, self._kind),
            scales=scales,
            sensor_orders=sensor_orders,
            sense_counts=driving.sense_counts,
            has_camera=np.array([CAMERA in each for each in driving.turrets]),
            sensors=np.zeros((*shape, reading_count(driving.senses))),
            memory=np.zeros((*shape, driving.memory_count)),
            parameters=driving.parameters,
            notes=np.zeros((*shape, watching.note_count)),
            wheels=np.zeros((*shape, 2 + len(driving.orders))),
            orders=order_rows_of(driving.parts),
            order_counts=driving.order_counts,
            sent=np.full((*shape, len(driving.orders)), NOTHING),
        )
        deciders = deciders_of(driving.controllers, driving.parameter_counts)
        functions = [*driving.controllers, *driving.parts, *watching.measures]
        callbacks = deciders, watching.watchers, watching.until_note

        def roll(first: int, end: int, until_ns: int) -> None:
            self._on_all_cores(worlds, (first, end, until_ns), callbacks, functions)

        return worlds, watching, roll

    # ---- step by step ----

    @_alone
    def take_arenas(self, worlds: NDArray[np.int64], arenas: Sequence[int]) -> None:
        """Give worlds other arenas of the batch, with the lamps of these; `reset` begins there.

        Args:
            worlds: Indices of the worlds, int64 [index].
            arenas: For each of them the index of its arena.
        """
        self.arena_indices[worlds] = arenas
        hung = self._initial_state.lamps[arenas]
        if (missing := hung.shape[1] - self._lamps.shape[1]) > 0:  # a user has set fewer lamps, or more
            self.lamps = np.pad(self._lamps, ((0, 0), (0, missing), (0, 0)))
        self._lamps[worlds] = 0.0
        self._lamps[worlds, : hung.shape[1]] = hung
        ticks, codes = self._initial_state.switches
        self._worlds.switch_ticks[worlds], self._worlds.switch_codes[worlds] = ticks[arenas], codes[arenas]

    @_alone
    def reset(
        self, worlds: ArrayLike | None = None, *, seeds: ArrayLike | None = None, starts: ArrayLike | None = None
    ) -> NDArray[np.float64]:
        """Reset worlds to their initial state, and let their robots sense for the first time.

        Args:
            worlds: Indices of the worlds [index], or a bool for each, bool [world]; all if left out.
            seeds: New seeds of these worlds, int64 [chosen world].
            starts: New start poses of their robots, float64 [chosen world, robot, 3].

        Returns:
            The last readings of all robots of all worlds, float64 [world, robot, sensor]; a copy.
        """
        chosen = np.arange(self.world_count)
        if worlds is not None:
            try:
                given = np.atleast_1d(np.asarray(worlds))
                chosen = chosen[given.astype(np.int64) if given.size == 0 else given]
            except (IndexError, TypeError, ValueError, OverflowError):
                given = np.zeros((0, 0))
            if given.ndim != 1:
                raise ParameterError(
                    f"worlds must be numbers from 0 to {self.world_count - 1}, or a bool for each world, but they were "
                    f"{shown(worlds)}."
                )
        if seeds is not None:
            self.seeds[chosen] = self._initial_state.check_seeds(seeds, len(chosen))
        if starts is not None or seeds is not None:
            self._starts[chosen] = self._initial_state.starts_of(self.seeds[chosen], starts, chosen)
            self.has_own_starts[chosen] = starts is not None
        self._reset_worlds(chosen, self._turrets)
        if len(chosen) and (self._is_sensed or worlds is None):
            self._do_halves(0, 1, chosen)
            self._is_sensed = self._is_sensed or worlds is None
        return np.array(self._worlds.sensors)

    @_alone
    def step(self, wheels: ArrayLike) -> NDArray[np.float64]:
        """Send all robots their speeds, wait for the next loop, and let them sense again.

        Args:
            wheels: Speeds of the left and right wheels [pulses/10 ms], and a number for each other output, float64
                [world, robot, output]; rounded and cut, the speeds to +-127, when they are sent.

        Returns:
            The readings of the robots, float64 [world, robot, sensor]; a copy.
        """
        given = array_of(wheels)
        if given is None or given.shape != self._worlds.wheels.shape:
            wanted = self._worlds.wheels.shape
            found = "they were no numbers" if given is None else f"their shape was {given.shape}"
            raise ParameterError(f"wheels must be [world, robot, output], here {wanted}, but {found}.")
        if not self._is_sensed:
            raise ParameterError("reset() must be called before the first step(), and after a run().")
        if np.isnan(given).any():
            raise ParameterError("wheels must be numbers, but some were none. Look at what your program has divided.")
        self._worlds.wheels[...] = given
        self._do_halves(1, 3)
        return np.array(self._worlds.sensors)

    # ---- state ----

    @property
    def lamps(self) -> NDArray[np.float64]:
        """The lamps: x_mm, y_mm, power_w, and 1 for on or 0 for off, float64 [world, lamp, 4].

        Write to the array to move or switch lamps; a lamp with a place of NaN lights nothing.
        """
        return self._lamps

    @lamps.setter
    @_alone
    def lamps(self, lamps: ArrayLike) -> None:
        given = check_numbers("lamps", lamps, (self.world_count, None, 4))
        switched = max((switch.lamp for arena in self.arenas for switch in arena.lamp_switches), default=0)
        if given.shape[1] < switched:
            raise ParameterError(
                f"lamps must be at least {switched} in each world, as arenas switch so many, but they were "
                f"{given.shape[1]}."
            )
        self._lamps = given
        for scene in self._scenes:
            scene.set_lamps(self._lamps)

    @property
    @_alone
    def times_s(self) -> NDArray[np.float64]:
        """Start time of the present loop of each world [s], float64 [world]."""
        times_s: NDArray[np.float64] = self._worlds.begins_ns / NS_PER_S
        return times_s

    @property
    @_alone
    def poses(self) -> NDArray[np.float64]:
        """Poses of robots at the end of the last tick, float64 [world, robot, 3]: x_mm, y_mm, heading_rad."""
        robots = self.state.robots
        return np.stack([robots["x_mm"], robots["y_mm"], robots["heading_rad"]], axis=-1)

    @property
    @_alone
    def values(self) -> NDArray[np.float64]:
        """Values of the measures after the steps so far, float64 [world, robot, measure]."""
        return self._watching.values(self.notes)

    @_alone
    def state_hash(self, world: int) -> str:
        """Return the hash of a world's state, 16 hexadecimal digits, as a simulation in the same state has it."""
        return self.state_of(world).hash()

    @_alone
    def state_of(self, world: int) -> State:
        """Return a copy of a world's state, the same as a simulation in that state has."""
        world = check_count("world", world, 0, self.world_count - 1)
        robots: Any = self.state.robots[world : world + 1].copy()
        # A simulation numbers only the kinds of its own robots.
        kinds = robots["kind"][0].tolist()
        robots["kind"] = [list(dict.fromkeys(kinds)).index(kind) for kind in kinds]
        return State(robots, self.state.bodies[world : world + 1].copy(), int(self._worlds.ticks[world]))

    # ---- inside ----

    def _reset_worlds(self, chosen: NDArray[np.int64], turrets: Sequence[tuple[Any, ...]]) -> None:
        """Reset worlds to their initial state; each robot carries some turrets."""
        self._initial_state.reset(self.state, chosen, self._starts[chosen])
        self._initial_state.fit(self.state, chosen, turrets)
        worlds = self._worlds
        for count in (worlds.ticks, worlds.begins_ns, worlds.watched_ns, worlds.sensed_ns, worlds.steps):
            count[chosen] = 0
        self.notes[chosen], worlds.sent[chosen] = 0.0, NOTHING
        if worlds.switch_ticks.shape[1]:
            worlds.switched[chosen] = 0
            hung = self._initial_state.lamps[self.arena_indices[chosen], : self._lamps.shape[1], 3]
            self._lamps[chosen, : hung.shape[1], 3] = hung
        enter_worlds(self._scenes[0].record, chosen)

    def _do_halves(self, first: int, end: int, chosen: NDArray[np.int64] | None = None) -> None:
        """Do halves of control loops with the present speeds of the wheels: even halves sense, odd halves act."""
        span, callbacks = (first, end, UNLIMITED), (NO_DECIDERS, self._watching.watchers, self._watching.until_note)
        functions = [*self._parts, *self._watching.measures]
        # A measure that fails leaves worlds in the middle of a loop.
        is_sensed, self._is_sensed = self._is_sensed, False
        self._on_all_cores(self._worlds, span, callbacks, functions, chosen=chosen, least=STEP_BLOCK)
        self._is_sensed = is_sensed

    def _on_all_cores(
        self,
        worlds: Any,
        span: tuple[int, int, int],
        callbacks: tuple[NDArray[np.int64], NDArray[np.int64], int],
        functions: Sequence[Compiled],
        *,
        chosen: NDArray[np.int64] | None = None,
        least: int = LANES,
    ) -> None:
        """Run `roll_out` in threads on blocks of at least `least` worlds; it calls some functions of users."""
        blocks = list(self._blocks(np.arange(self.world_count) if chosen is None else chosen, least))
        left, errors = iter(blocks), list[Exception]()

        def work() -> None:
            # Threads take blocks from one list until it is empty: an iterator gives each to one of them.
            for scene, numbers in left:
                try:
                    roll_out(scene.record, worlds, worlds_in_bunch(self.robot_count), numbers, span, callbacks)
                except Exception as error:
                    errors.append(explained(error, functions))
                    break

        helpers = [self._pool.submit(work) for _ in range(min(self.threads, len(blocks)) - 1)]
        work()
        for helper in helpers:
            # All blocks are taken. A helper that has not begun has no work, and in a forked process it never begins.
            if not helper.cancel():
                helper.result()
        if errors:
            raise errors[0]

    @functools.cached_property
    def _pool(self) -> ThreadPoolExecutor:
        return ThreadPoolExecutor(self.threads)

    def _blocks(self, chosen: NDArray[np.int64], least: int) -> Iterator[tuple[Scene, NDArray[np.int64]]]:
        """Yield blocks of worlds: the scene with their common arena, and the indices of the worlds."""
        length = max(-(-len(chosen) // (self.threads * BLOCKS_PER_THREAD)), least)
        length = -(-length // LANES) * LANES  # so that no lane is padding
        for index, scene in enumerate(self._scenes):
            here = chosen[self.arena_indices[chosen] == index]
            for first in range(0, len(here), length):
                yield scene, np.ascontiguousarray(here[first : first + length])

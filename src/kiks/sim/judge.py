"""The judge of a run: looks at a project's goal while the run goes on, and says how it has ended."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from kiks.control import measures
from kiks.control.measure import NEEDS, Measure, moment_of
from kiks.control.senses import AnySense, for_controllers, sense_of
from kiks.errors import KiksError, ParameterError, shown
from kiks.firmware.robot_kind import robot_kind
from kiks.meant import nearest
from kiks.model.arena import Arena
from kiks.model.checks import check_count, check_number
from kiks.model.formula import Formula, Term
from kiks.model.goal import Goal, number_of
from kiks.model.robot import SENSOR_COUNT
from kiks.sim.sensors import readings
from kiks.sim.simulation import SCORE_MAX, Simulation
from kiks.units import TICK_NS, ns_from_s, s_from_ns

LOOK_S = 0.1
"""Simulated time between two looks of the judge [s]: that of a control loop of a program on a 9600 baud line."""

SHOWN_S = 1.0
"""Simulated time between two changes of the points that people see [s]."""

POINTS, RESULT = "points", "result"
"""Entries of the score that the judge writes."""


OWN_NAMES = {
    "time_s": "Simulated time [s].",
    "is_solved": "1 if the goal is solved, else 0.",
    "is_over": "1 at the end of a run that is neither solved nor failed, else 0.",
    "wall_mm": "The gap to the nearest wall [mm].",
    "proximity(2)": "What a proximity sensor reads, without noise.",
    "light(2)": "What a light sensor reads, without noise.",
    'score("laps")': "A number that the supervisor has counted.",
    "held_s(wall_mm < 40)": "For how long a condition has held without a break [s].",
    "total_s(wall_mm < 40)": "For how long a condition has held in all [s].",
}
"""Names of formulas besides measures, as they are typed, with what they mean."""

_SENSES = {"proximity": "proximity", "light": "ambient"}
"""Names of formulas for what a sensor reads, and of the sense."""


def goal_names() -> dict[str, str]:
    """Return what formulas of goals may name, as it is typed, with what each means.

    Example:
        >>> goal_names()["contacts"]
        'How often it has met something.'
    """
    found = {}
    for name in measures.__all__:
        made = getattr(measures, name)
        described, typed = made, name
        if isinstance(made, Measure):
            described = made.kernel
        else:
            needed = inspect.signature(made).parameters.values()
            names = [each.name for each in needed if each.default is each.empty and each.name != "arena"]
            typed += f"({', '.join(names)})"
        found[typed] = (inspect.getdoc(described) or "").split("\n")[0]
    return OWN_NAMES | found


@dataclass(frozen=True)
class Judgement:
    """How a run has done.

    Attributes:
        is_solved: Whether the goal was reached.
        is_failed: Whether the run had failed, so that it could not be reached any more.
        points: The points.
        time_s: Simulated time at which it was decided [s].
    """

    is_solved: bool
    is_failed: bool
    points: float
    time_s: float

    def __str__(self) -> str:
        how = "solved" if self.is_solved else "failed" if self.is_failed else "not solved"
        return f"{how} after {self.time_s:.1f} s"


class Judge:
    """Judges a run by a goal; `supervise` is its supervisor.

    Args:
        sim: The world.
        goal: The goal.

    Attributes:
        judgement: How the run has done; None until it is decided.
        doubts: Sentences about formulas that hold before anything has moved.

    Example:
        >>> from kiks import Arena, Khepera, Simulation
        >>> sim = Simulation(Arena.box(500, 500), seed=1)
        >>> judge = Judge(sim, Goal(solved="path_mm > 100", points="20 - time_s"))
        >>> Khepera(sim.port(1)).set_speed(10, 10)
        >>> for wait_s in judge.supervise(sim):
        ...     sim.run(wait_s)
        >>> str(judge.judgement)
        'solved after 1.3 s'
    """

    def __init__(self, sim: Simulation, goal: Goal) -> None:
        self.judgement: Judgement | None = None
        self._sim = sim
        sim.index_of(goal.robot)
        self._is_solved, self._is_over = False, False
        self._looked_ns: int | None = None
        self._began_ns = sim.now_ns
        self._formulas = goal.formulas()
        # What is wrong with a formula is said before the run, of which this look is no part.
        terms = self._terms_of(goal)
        terms.look(0)
        values = {name: terms.number(formula, name) for name, formula in self._formulas.items()}
        self.doubts = tuple(
            f"the goal's {name}, {shown(self._formulas[name].text)}, is true before anything has moved."
            for name in ("solved", "failed")
            if values[name]
        )
        # Anew: measures have noted that look.
        self._terms = self._terms_of(goal)

    def _terms_of(self, goal: Goal) -> _GoalTerms:
        terms = _GoalTerms(
            self._sim,
            goal.robot,
            {
                "time_s": lambda: self._sim.time_s,
                "is_solved": lambda: float(self._is_solved),
                "is_over": lambda: float(self._is_over),
            },
        )
        for name, formula in self._formulas.items():
            try:
                terms.add(formula)
            except KiksError as error:
                raise ParameterError(f"the goal's {name} {error}") from None
        return terms

    def _number(self, name: str) -> float:
        """Return the value of a formula at the last look."""
        return self._terms.number(self._formulas[name], name)

    def supervise(self, sim: Simulation) -> Generator[float, None, None]:
        """Look at the goal until it is solved or has failed; see `kiks.sim.supervision.Supervision`."""
        shown_ns = 0
        while True:
            yield LOOK_S
            if self.judgement is not None:
                continue  # a person lets the world go on
            self._look()
            if self._is_solved or self._number("failed"):
                self.end()
                return
            if sim.now_ns >= shown_ns:
                shown_ns = sim.now_ns + ns_from_s(SHOWN_S)
                sim.set_score(POINTS, self._number("points"))

    def end(self) -> Judgement:
        """Decide, if that is not done yet, write the result into the score, and return it."""
        if self.judgement is None:
            # The run may end between two looks; a second look at one instant would count its measures twice.
            if self._sim.now_ns != self._looked_ns:
                self._look()
            is_failed = not self._is_solved and self._number("failed") != 0
            self._is_over = not (self._is_solved or is_failed)
            self._solve()  # again, as a goal may ask for `is_over`
            points = round(self._number("points"), 3)
            points = int(points) if points.is_integer() else points
            self.judgement = Judgement(self._is_solved, is_failed, points, self._sim.time_s)
            self._sim.set_score(POINTS, points)
            self._sim.set_score(RESULT, str(self.judgement))
        return self.judgement

    def _look(self) -> None:
        now_ns = self._sim.now_ns
        passed_ns = now_ns - (self._began_ns if self._looked_ns is None else self._looked_ns)
        self._looked_ns = now_ns
        self._terms.look(passed_ns)
        self._solve()

    def _solve(self) -> None:
        # What is solved stays so: a robot that has reached its place may leave it.
        self._is_solved = self._is_solved or self._number("solved") != 0


class Condition:
    """A formula as goals have them, watched while a run goes on, to find where it became true last.

    Args:
        text: The formula.
        robot: The robot whose measures count.
        sim: A world like those in which it is watched; what is wrong with the formula is said at once.

    Attributes:
        text: The formula.
        look: Looks once more, where the run has come to.
        before_ns: The last instant before it became true last, at which it was not [ns]; None if it has not.
    """

    def __init__(self, text: str, robot: int, sim: Simulation) -> None:
        self.text, self._robot = shown(text), robot
        self._formula = Formula(text)
        self.look: Callable[[], None] = lambda: None
        self.before_ns: int | None = None
        next(self.looks(sim))

    def looks(self, sim: Simulation) -> Generator[float, None, None]:
        """Look at each tick; see `kiks.sim.supervision.Supervision`."""
        terms = _GoalTerms(sim, self._robot, {"time_s": lambda: sim.time_s})
        try:
            terms.add(self._formula)
        except KiksError as error:
            raise ParameterError(f"the formula {error}") from None
        was_true, looked_ns = False, sim.now_ns

        def look() -> None:
            nonlocal was_true, looked_ns
            terms.look(sim.now_ns - looked_ns)
            is_true = terms.number(self._formula, "formula") != 0
            if is_true and not was_true:
                self.before_ns = looked_ns
            was_true, looked_ns = is_true, sim.now_ns

        self.look = look
        while True:
            look()
            yield s_from_ns(TICK_NS)


Watch = Callable[[int], Any]
"""What looks at the world for a term of a formula and returns its value; it gets the time since it looked [ns]."""


class _GoalTerms:
    """The terms of a goal's formulas in a world: each looks once at an instant, whichever formulas have it.

    Args:
        sim: The world.
        robot: The robot whose measures count.
        own: The values of the judge's own names, which change without a look.
    """

    def __init__(self, sim: Simulation, robot: int, own: dict[str, Callable[[], float]]) -> None:
        self._sim, self._robot, self._own = sim, robot, own
        self._watches: dict[Term, Watch] = {}
        self._values: dict[Term, Any] = {}
        self._moments: dict[tuple[int, tuple[AnySense, ...]], Any] = {}

    def add(self, formula: Formula) -> None:
        """Add the terms of a formula."""
        for term in formula.terms:
            if term.condition is not None:
                self.add(term.condition)  # before the timer: it looks before
            if term not in self._watches and str(term) not in self._own:
                self._watches[term] = self._watch(term)

    def look(self, passed_ns: int) -> None:
        """Let all terms look at the world once; the last look was some time ago [ns]."""
        self._moments.clear()  # they are shared by the measures of one look
        for term, watch in self._watches.items():
            self._values[term] = watch(passed_ns)

    def number(self, formula: Formula, name: str) -> float:
        """Return the value of a formula at the last look, with the judge's own names as they are now.

        Args:
            formula: The formula.
            name: What messages call it.
        """
        own = self._own
        values = [tell() if (tell := own.get(str(term))) else self._values[term] for term in formula.terms]
        what = f"the goal's {name}"
        value = number_of(formula, values, what, f"at {self._sim.time_s:.1f} s")
        return check_number(what, value, -SCORE_MAX, SCORE_MAX)

    def _watch(self, term: Term) -> Watch:
        """Return what looks at the world for a term."""
        sim = self._sim
        if term.condition is not None:
            return self._timer(term.condition, is_broken=term.name == "held_s")
        named: dict[str, Any] = dict(term.named)
        robot = sim.index_of(named.pop("robot", self._robot)) + 1
        if term.name == "wall_mm" and not (term.arguments or named):
            radius_mm = sim.specs[robot - 1].body.radius_mm
            return lambda _: sim.world.free_space.wall_gap_mm(*sim.pose(robot)[:2], radius_mm)
        if (sense := _SENSES.get(term.name)) is not None and len(term.arguments) == 1 and not named:
            number = check_count(f"the sensor of {term.name}", term.arguments[0], 0, SENSOR_COUNT - 1)
            return lambda _: readings(sim.world, robot - 1, sense, is_noisy=False)[number]
        if term.name == "score" and len(term.arguments) == 1 and not (named or isinstance(term.arguments[0], float)):
            what = term.arguments[0]
            return lambda _: _counted(sim, what)
        measure = _measure(term, named, sim.arena)
        # A measure of what is not there has a number all the same, such as 0, which would decide the goal.
        if not NEEDS[measure.needs](_moment(sim, robot, (), 0.0)):
            raise ParameterError(
                f"must ask for what is there, but {shown(str(term))} is about {measure.needs}, and this world has none."
            )
        return self._measured(measure, robot)

    def _measured(self, measure: Measure, robot: int) -> Watch:
        """Return what lets a measure look at a robot."""
        notes, key = np.zeros(measure.note_count), (robot, tuple(measure.senses))

        def watch(passed_ns: int) -> float:
            if key not in self._moments:
                self._moments[key] = _moment(self._sim, *key, s_from_ns(passed_ns))
            measure.kernel(self._moments[key], notes)
            return float(measure.value(notes[None, None]).item())

        return watch

    def _timer(self, condition: Formula, *, is_broken: bool) -> Watch:
        """Return what counts for how long a condition holds [s], from anew when it was broken, or in all."""
        held_ns = 0

        def watch(passed_ns: int) -> float:
            nonlocal held_ns
            # What holds now counts as having held since the last look.
            if self.number(condition, "condition"):
                held_ns += passed_ns
            elif is_broken:
                held_ns = 0
            return s_from_ns(held_ns)

        return watch


_TYPED = {typed.partition("(")[0]: typed for typed in OWN_NAMES}


def _measure(term: Term, named: dict[str, Any], arena: Arena) -> Measure:
    """Return the measure that a term names."""
    known = [*measures.__all__, *_TYPED]
    if (typed := _TYPED.get(term.name)) is not None:
        raise ParameterError(f"must use {term.name} as in {typed!r}, but it was {shown(str(term))}.")
    if term.name not in measures.__all__:
        raise ParameterError(
            f"must name measures, but {shown(str(term))} is none.{nearest(term.name, known)} The page "
            '"Controllers and measures" lists them.'
        )
    made = getattr(measures, term.name)
    if isinstance(made, Measure):
        if term.arguments or named:
            raise ParameterError(f"must use {term.name} without arguments, but it was {shown(str(term))}.")
        return made
    given = (arena, *term.arguments) if "arena" in inspect.signature(made).parameters else term.arguments
    try:
        return cast(Measure, made(*given, **named))
    except TypeError as error:
        what = f"{shown(str(term))}: {str(error).removesuffix('.')}."
        raise ParameterError(f"must use {term.name} as its reference says, but {what}") from None


def _moment(sim: Simulation, robot: int, senses: Sequence[AnySense], period_s: float) -> Any:
    """Return what a measure sees of a robot now. Its readings are free of noise: the judge sees what is the case.

    Readings and speeds are as controllers have them, so a measure means the same for each kind of robot.
    """
    sim.sync()
    world, kind = sim.world, robot_kind(sim.specs[robot - 1].kind)
    read: list[float] = []
    for sense in senses:
        values, seen = readings(world, robot - 1, sense, is_noisy=False), for_controllers(sense_of(sense), kind)
        read += [seen.scale * values[place] for place in seen.order]
    record: Any = world.state.robots.view(np.recarray)[0, robot - 1]
    # A stepper's set point may be beyond what its motors, and controllers, can do.
    wheels = np.clip(record.speed_setpoint, -kind.speed_max, kind.speed_max) / kind.speed_scale
    around = world.state.bodies[0], world.lamps
    times_s = sim.time_s, period_s
    return moment_of.py_func(times_s, np.array(read), wheels, record, record, *around, robot - 1, sim.poses())


def _counted(sim: Simulation, what: int | str) -> float:
    """Return an entry of the score; 0 before anything has counted it."""
    value = sim.score.get(what, 0)
    if isinstance(value, str):
        raise ParameterError(f"the goal must use numbers of the score, but {shown(what)} is {shown(value)}.")
    return value

"""Public calls of Python with hostile arguments, one after the other, and whether the world still turns after them."""

from __future__ import annotations

import inspect
import math
import random
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import chdir, suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache, partial
from typing import Any

import gymnasium
import numpy as np
from tools.campaigns.files import drive
from tools.campaigns.hostile import hostile_value
from tools.campaigns.runner import Campaign, Play, judge

import kiks
from kiks.clock.thinking import parse_thinking
from kiks.control.controllers import KINDS
from kiks.learn.evaluation import evaluate
from kiks.learn.gymnasium_envs import KheperaEnv, KheperaVectorEnv
from kiks.learn.pettingzoo_env import KheperaTeam
from kiks.model.arena import Ball, Cylinder, Lamp, Pose
from kiks.model.exercise import Cases, Exercise
from kiks.model.goal import Goal
from kiks.model.project import Project, ProjectRobot
from kiks.sim.drag import Drags
from kiks.sim.from_project import simulation_of
from kiks.sim.simulation import Simulation

CALLS = 100_000
"""Calls of all subjects together."""

CALLS_PER_CASE = 4
"""Most hostile calls of a case."""

DURATIONS = ("seconds", "every_s", "period_s", "think_s", "timeout", "poll_s", "time_ns", "speed_mm_s", "TIMEOUT")
"""What may be so long that waiting for it is right: of these only what no clock can hold."""

DURATION_MAX, DURATION_ENDLESS = 5.0, 1e12

INTERNAL = (
    "sync",
    "tick_to",
    "freedom",
    "check_start_poses",
    "show",
    "run_until",
    "with_traceback",
    "add_note",
    "prepare",
    "start_poses",
    "split",
    "parameters_of",
    "individual",
    "random_starts",
    "of_world",
    "take_arenas",
)
"""Public names that programs have no use for, or that open a browser."""


@dataclass(frozen=True)
class Subject:
    """Things that belong together.

    Args:
        calls: What can be called, with what a good call gives it.
        check: Whether all still works afterwards.
    """

    calls: Mapping[str, tuple[Callable[..., Any], dict[str, Any]]]
    check: Callable[[], object] = lambda: None


def hostile_argument(rng: random.Random, name: str) -> Any:
    """Return a hostile value for a parameter."""
    second = 10**9 if name == "time_ns" else 1
    while True:
        value = hostile_value(rng)
        is_number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
        is_waited_for = is_number and DURATION_MAX * second < value < DURATION_ENDLESS * second
        if name not in DURATIONS or not is_waited_for:
            return value


def arguments(rng: random.Random, call: Callable[..., Any], good: dict[str, Any]) -> dict[str, Any]:
    """Return what a call is given: one or two of its arguments are hostile."""
    parameters = [each for each in inspect.signature(call).parameters.values() if each.kind is not each.VAR_POSITIONAL]
    named = [each.name for each in parameters if each.kind is not each.VAR_KEYWORD]
    free = any(each.kind is each.VAR_KEYWORD for each in parameters)
    choices = list(dict.fromkeys([*named, *good])) if free else named
    needed = {each.name for each in parameters if each.default is each.empty and each.name in named}
    chosen = set(rng.sample(choices, min(rng.choice((1, 1, 2)), len(choices))))
    given = {name: good[name] for name in choices if name in good and (name in needed or rng.random() < 0.3)}
    for name in chosen | (needed - set(good)):
        given[name] = hostile_argument(rng, name)
    if free and call.__module__ != __name__ and rng.random() < 0.05:
        given["nonsense"] = 1
    return given


def _methods(
    thing: object, good: Mapping[str, Any], **special: dict[str, Any]
) -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Return the public methods of a thing, each with what a good call gives it."""
    found = {}
    for name in dir(thing):
        if name.startswith("_") or name in INTERNAL or not callable(getattr(type(thing), name, None)):
            continue
        method = getattr(thing, name)
        known = {**good, **special.get(name, {})}
        taken = inspect.signature(method).parameters
        free = special.get(name, {})
        found[name] = method, {key: value for key, value in known.items() if key in taken or key in free}
    return found


# ---- subjects ----


@cache
def _box() -> kiks.Arena:
    return kiks.Arena.box(300, 300)


@cache
def _standing() -> kiks.Arena:
    return replace(_box(), starts=(Pose(100.0, 100.0, 0.5), Pose(200.0, 200.0, 0.5)))


def _world() -> Simulation:
    sim = Simulation(_standing(), robots=2, seed=1)
    sim.add_ball(100.0, 200.0)
    sim.add_lamp(50.0, 50.0)
    return sim


_PLACE = {"robot": 1, "x_mm": 150.0, "y_mm": 120.0, "heading_rad": 0.7}


def _simulation(rng: random.Random) -> Subject:
    sim = _world()
    good = _PLACE | {
        "body": 1, "lamp": 1, "seconds": 0.02, "speed_mm_s": 10.0, "sensor": 2, "turret": "k213", "every_s": 0.1,
        "power_w": 1.0,
        "is_on": True, "arena": _box(), "checkpoint": sim.checkpoint(), "time_ns": 10**7, "seed": 1, "noise": True,
    }  # fmt: skip
    body = {"radius_mm": 10.0, "friction_mm_s2": 10.0, "brightness": 100}

    def write_lamps(row: Any, column: Any, value: Any) -> None:
        sim.lamps[int(row) % len(sim.lamps), int(column) % 4] = value

    calls = _methods(sim, good, add_robot={"robot": "khepera"}, add_ball=body, add_cylinder=body)
    calls["Simulation"] = (
        Simulation,
        {
            "arena": _box(),
            "robots": 2,
            "seed": 3,
            "thinking": "none",
            "robot": "khepera",
            "response": "thesis",
            "link": "wifi",
        },
    )
    hands = Drags(sim)
    hands.grab("a", "robot", 0)
    calls["grab"] = partial(hands.grab, "b", "robot"), {"index": 1}
    calls["drag"] = partial(hands.move, "a"), {"x_mm": 140.0, "y_mm": 130.0}
    calls["turn"] = partial(hands.turn, "a"), {"heading_rad": 0.7}
    # Documented as an array to be written to: whatever NumPy takes, the engine has to live with.
    value = rng.choice((math.nan, math.inf, 1e308, -1e20, 5e-324, 0.0))
    calls["lamps"] = partial(write_lamps, 0, rng.randrange(4), value), {}
    return Subject(calls, lambda: drive(sim))


def _khepera(rng: random.Random) -> Subject:
    sim = _world()
    sim.fit(1, "k213")
    robot = kiks.Khepera(sim.port(1))
    good = {
        "left": 5, "right": -5, "kp": 1, "ki": 2, "kd": 3, "speed": 4, "acceleration": 5, "channel": 1, "led": 0,
        "action": 2, "address": 3,
        "data": 7, "text": "N", "number": 2, "order": "N", "seconds": 0.02, "poll_s": 0.02, "wait": False,
        "request": b"N", "count": 8,
    }  # fmt: skip
    calls = _methods(robot, good)
    calls["Khepera"] = kiks.Khepera, {"port": sim.port(1), "baud": 9600}
    return Subject(calls, lambda: drive(sim))


def _epuck(rng: random.Random) -> Subject:
    sim = Simulation(_standing(), robot=("epuck", "khepera"), seed=1)
    robot = kiks.EPuck(sim.port(1))
    good = {
        "left": 500, "right": -500, "mode": "grey", "width": 20, "height": 10, "zoom": 4, "led": 3, "is_on": True,
        "number": 2, "text": "N", "seconds": 0.02, "request": b"N", "count": 8,
    }  # fmt: skip
    calls = _methods(robot, good)
    calls["EPuck"] = kiks.EPuck, {"port": sim.port(1), "baud": 115200}
    return Subject(calls, lambda: drive(sim))


def _functions(rng: random.Random) -> Subject:
    # Those of the case before.
    kiks.kclose([])
    sim = _world()
    ref = kiks.kopen([-1, 9600, 1])
    calls: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
        "kopen": (kiks.kopen, {"settings": [-2, 9600, 1]}), "ksend": (kiks.ksend, {"text": "N\n", "ref": ref,
        "timeout": 1.0}),
        "ktime": (kiks.ktime, {"port": ref}), "kclose": (kiks.kclose, {"ref": ref}), "pause": (kiks.pause,
        {"seconds": 0.01}),
        "drive": (kiks.drive, {"port": sim.port(2), "controller": _controller(), "parameters": [0.1] * 18,
        "seconds": 0.2, "period_s": 0.1, "baud": 9600, "kind": "khepera"}),
        "evaluate": (evaluate, {"work": _task(), "candidates": np.zeros((1, 18)), "seeds": np.array([1]),
        "executor": None}),
        "parse_thinking": (parse_thinking, {"text": "none"}),
    }  # fmt: skip
    return Subject(calls, lambda: drive(sim))


def _arena(rng: random.Random) -> Subject:
    arena, array = _box(), np.zeros((120, 130), np.uint8)
    made = kiks.Arena
    good = {
        "width_mm": 200, "height_mm": 200, "wall_mm": 5, "rounded_mm": 10, "brightness": 99, "mm_per_pixel": 1.0,
        "name": "a", "columns": 3,
        "rows": 3, "path_mm": 120, "seed": 1, "radius_mm": 20.0, "x_mm": 100.0, "y_mm": 100.0,
        "path": "/nonexistent/a.png",
    }  # fmt: skip
    calls = _methods(arena, good, from_array={"brightness": array})
    things = {"starts": (Pose(100.0, 100.0, 0.0),), "lamps": (), "balls": (), "cylinders": ()}
    calls["Arena"] = made, {"brightness": array, "mm_per_cell": 1.0, "name": "a", **things}

    def with_things(x_mm: Any, y_mm: Any, third: Any, fourth: Any, fifth: Any) -> None:
        kinds = {"starts": (Pose, 3), "lamps": (Lamp, 4), "balls": (Ball, 5), "cylinders": (Cylinder, 5)}
        label = rng.choice(list(kinds))
        kind, count = kinds[label]
        drive(
            Simulation(made(array, 1.0, "a", **{label: (kind(*(x_mm, y_mm, third, fourth, fifth)[:count]),)}), seed=1)
        )

    calls["things"] = with_things, {"x_mm": 60.0, "y_mm": 60.0, "third": 10.0, "fourth": 10.0, "fifth": 100}
    return Subject(calls)


def _robot(rng: random.Random) -> Subject:
    spec = kiks.RobotSpec.load(rng.choice(("khepera", "khepera_ii", "epuck", "epuck2")))
    sections = [each.name for each in fields(spec) if is_dataclass(getattr(spec, each.name))]
    section = rng.choice(sections)
    key = rng.choice([each.name for each in fields(getattr(spec, section))])
    value = getattr(getattr(spec, section), key)

    def changed(value: Any) -> None:
        drive(Simulation(_box(), robot=spec.with_changes(**{f"{section}__{key}": value}), seed=1))

    def one_changed(value: Any) -> None:
        many = list(getattr(getattr(spec, section), key))
        many[rng.randrange(len(many))] = value
        changed(tuple(many))

    calls = _methods(spec, {"name_or_path": "khepera", "response": "thesis"}, with_changes={f"{section}__{key}": value})
    calls["changed"] = changed, {"value": value}
    if isinstance(value, tuple) and value:
        calls["one_changed"] = one_changed, {"value": value[0]}
    return Subject(calls)


@cache
def _controller() -> Any:
    return kiks.controllers.linear()


@cache
def _task() -> Any:
    return kiks.tasks.avoid(seconds=0.5, worlds=4, controller=_controller())


def _control(rng: random.Random) -> Subject:
    good = {
        "neurons": 2, "period_s": 0.1, "time_constant_s": 0.4, "senses": ("proximity",), "speed_limit": 5.0,
        "units": 2, "feedback": False, "per": "neuron",
        "hidden": (3,), "controller": _controller(), "count": 2, "seed": 1, "folder": ".", "recipe": {"kind": "linear"},
        "arena": _box(), "square_mm": 50.0, "x_mm": 50.0, "y_mm": 50.0, "radius_mm": 50.0, "missed_s": 9.0,
        "side": "left", "counts": 300.0,
    }  # fmt: skip
    found = {}
    wanted = (*KINDS, "random_parameters", "from_recipe", "recipe_for")
    wanted += ("coverage", "gathered", "goal_mm", "near_light_share", "reached_s", "wall_following")
    wanted += ("closest_mm", "largest_group")
    for name in wanted:
        call = getattr(kiks.controllers, name, None) or getattr(kiks.measures, name)
        found[name] = call, {key: value for key, value in good.items() if key in inspect.signature(call).parameters}
    return Subject(found)


def _batch(rng: random.Random) -> Subject:
    batch = kiks.Batch(_box(), 3, seed=1, threads=1, senses=("proximity", "ambient"))
    good = {
        "arena": _box(), "worlds": 3, "robot": "khepera", "robots": 1, "seed": 1, "starts": np.array([[[100.0, 100.0,
        0.0]]] * 3),
        "senses": ("proximity",), "measures": (), "timing": kiks.Timing(), "response": None, "threads": 1,
        "seeds": [1, 2, 3],
        "controller": _controller(), "parameters": [0.1] * 18, "seconds": 0.2, "world": 1, "wheels": np.zeros((3, 1,
        2)),
    }  # fmt: skip
    calls = _methods(batch, good, reset={"worlds": [0, 1]})
    taken = inspect.signature(kiks.Batch).parameters
    calls["Batch"] = kiks.Batch, {key: value for key, value in good.items() if key in taken}
    if rng.random() < 0.5:
        calls = {name: calls[name] for name in ("step", "reset", "run")}

    batch.reset()

    def step_on() -> None:
        batch.reset()
        for _ in range(2):
            batch.step(np.full((3, 1, 2), 4.0))
        batch.state_hash(0)

    return Subject(calls, step_on)


def _learning(rng: random.Random) -> Subject:
    task = _task()
    evolution = kiks.Evolution(task, "ga", seed=1, population=4)
    champion = kiks.Champion(task.controller, (0.1,) * 18)
    sim = _world()
    good = {
        "task": task, "algorithm": "ga", "seed": 1, "population": 4, "opponents": 2, "folder": None,
        "values": np.arange(4.0),
        "generations": 1, "each": None,
        "executor": None, "seconds": 0.5, "candidates": np.zeros((1, 18)), "seeds": np.array([1]),
        "threads": 1, "measure": "contacts",
        "low": 0.0, "high": 1.0, "cells": 10, "period_s": 0.1, "baud": 9600, "think_s": 0.01, "path": "champion.toml",
        "arena": _box(),
        "robots": 1, "port": sim.port(1), "name": "avoid", "spec": sim.spec, "controller": task.controller,
    }  # fmt: skip
    changes = {
        "seconds": 1.0,
        "worlds": 3,
        "robots": 1,
        "robot": "khepera",
        "starts": "random",
        "timing": kiks.Timing(),
        "axes": (),
    }
    calls: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {}
    for thing, label in ((evolution, "evolution"), (champion, "champion"), (task, "task")):
        known = _methods(thing, good, with_changes=changes)
        calls |= {
            f"{label}.{name}": call
            for name, call in known.items()
            if name not in ("fitness", "controller", "run", "drive")
        }
    for made in (kiks.Evolution, kiks.Axis, kiks.Timing):
        calls[made.__name__] = made, {key: good[key] for key in inspect.signature(made).parameters}
    calls["tasks.load"] = kiks.tasks.load, {"name": "avoid", "controller": None}
    calls["tasks.avoid"] = kiks.tasks.avoid, changes
    if rng.random() < 0.7:
        evolution.ask()

    def use_timing(period_s: Any, baud: Any, think_s: Any) -> None:
        timing = kiks.Timing(period_s=period_s, baud=baud, think_s=think_s)
        batch = kiks.Batch(_box(), 1, timing=timing, threads=1)
        if timing.period_s < 1.0:
            batch.step(np.zeros((1, 1, 2)))

    calls["timing"] = use_timing, {"period_s": 0.1, "baud": 9600, "think_s": 0.01}
    return Subject(calls)


def _environments(rng: random.Random) -> Subject:
    if rng.random() < 0.5:
        env: Any = KheperaEnv("Avoid", threads=1)
        good: dict[str, Any] = {"action": np.zeros(2, np.float32), "seed": 1, "options": None}
    else:
        env = KheperaVectorEnv(2, "Avoid", threads=1)
        good = {"actions": np.zeros((2, 2), np.float32), "seed": 1, "options": None}
    env.reset(seed=1)
    calls = {name: (getattr(env, name), {key: value for key, value in good.items() if key in taken}) for name,
    taken in (
        ("reset", ("seed", "options")), ("step", ("action", "actions")), ("step", ("action", "actions")),
    )}  # fmt: skip
    calls["KheperaEnv"] = (
        KheperaEnv,
        {"task": "Avoid", "render_mode": None, "arenas": (_box(),), "timing": kiks.Timing(), "robot": "khepera"},
    )

    taken = {"task": "Avoid", "robots": 2, "max_cycles": 9, "seed": 1, "threads": 1}
    calls["KheperaTeam"] = (
        KheperaTeam,
        {key: taken[key] for key in inspect.signature(KheperaTeam).parameters & taken.keys()},
    )

    def go_on() -> None:
        env.reset(seed=1)
        env.step(good.get("action", good.get("actions")))

    return Subject(calls, go_on)


def _project(rng: random.Random) -> Subject:
    good = {
        "arena": _box(), "robots": (ProjectRobot(),), "seed": 1, "thinking": "none", "baud": 9600, "link": "bluetooth",
        "response": "thesis", "noise": True,
        "speed": 1.0, "kind": "khepera", "turrets": ("k213",), "name": "a", "program": "a.py", "arguments": ("a",),
        "brightness": 99, "kind_name": "Mine", "changes": {"body": {"diameter_mm": 60.0}}, "seconds": 5.0,
        "supervisor": None, "keeps_baud": False, "goal": Goal(solved="path_mm > 9"), "cases": (Cases(seed=(1, 2)),),
        "exercise": Exercise("a"),
    }  # fmt: skip

    def project(**settings: Any) -> None:
        made = Project(**settings)
        Project.from_bytes(made.to_bytes())
        if len(made.robots) < 5 and made.thinking == "none":
            drive(simulation_of(made))

    def robot(**settings: Any) -> None:
        project(robots=(ProjectRobot(**settings),))

    return Subject({
        "project": (project, {key: good[key] for key in inspect.signature(Project).parameters}),
        "robot": (robot, {key: good[key] for key in inspect.signature(ProjectRobot).parameters}),
    })  # fmt: skip


def _port(rng: random.Random) -> Subject:
    sim = _world()
    port = sim.port(1)
    port.timeout = 1.0
    good = {"data": b"N\n", "size": 4, "expected": b"\n", "holder": "me", "seconds": 0.01}

    def set_baudrate(value: Any) -> None:
        port.baudrate = value

    def set_timeout(TIMEOUT: Any) -> None:
        port.timeout = TIMEOUT
        port.write(b"N\n")
        port.read_until(b"\n")

    def on_port(call: Callable[..., Any], *given: Any, **named: Any) -> None:
        try:
            call(*given, **named)
        except (TypeError, ValueError) as error:
            if isinstance(error, kiks.KiksError):
                raise
            # As pyserial has it: programs run unchanged.
        finally:
            port.timeout = 1.0

    calls = _methods(port, good)
    calls = {name: (_signed_as(call, partial(on_port, call)), known) for name, (call, known) in calls.items()}
    calls["baudrate"] = set_baudrate, {"value": 9600}
    calls["timeout"] = _signed_as(set_timeout, partial(on_port, set_timeout)), {"TIMEOUT": 1.0}
    return Subject(calls, lambda: drive(sim))


def _signed_as(call: Callable[..., Any], wrapped: Callable[..., Any]) -> Callable[..., Any]:
    def same(**given: Any) -> Any:
        return wrapped(**given)

    same.__signature__ = inspect.signature(call)  # type: ignore[attr-defined]
    return same


SUBJECTS: dict[str, tuple[Callable[[random.Random], Subject], float]] = {
    "simulation": (_simulation, 0.3), "khepera": (_khepera, 0.1), "epuck": (_epuck, 0.1),
    "port": (_port, 0.05), "functions": (_functions,
    0.08),
    "arena": (_arena, 0.1), "robot": (_robot, 0.1), "control": (_control, 0.05), "batch": (_batch, 0.07),
    "learning": (_learning, 0.05),
    "environments": (_environments, 0.05), "project": (_project, 0.05),
}  # fmt: skip
"""What is called, and its share of all calls."""


def _prepare(make: Callable[[random.Random], Subject]) -> Play:
    """Return what plays a case of a subject, with everything compiled."""
    subject = make(random.Random(0))
    subject.check()

    def play(rng: random.Random) -> int:
        try:
            subject = make(rng)
        except kiks.KiksError as error:
            raise RuntimeError("what is sound must not be refused") from error
        count = rng.randint(1, CALLS_PER_CASE)
        # Calls may write files.
        with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder, chdir(folder):
            for _ in range(count):
                call, good = rng.choice(list(subject.calls.values()))
                given = arguments(rng, call, good)
                judge(partial(_tolerantly, call, given))
            judge(subject.check)
        return count

    return play


def _tolerantly(call: Callable[..., Any], given: dict[str, Any]) -> None:
    # What Gymnasium itself checks, it refuses in its own way.
    with suppress(gymnasium.error.Error):
        call(**given)


def campaigns() -> Iterator[Campaign]:
    """Yield one for each subject."""
    for name, (make, share) in SUBJECTS.items():
        cases = round(CALLS * share / ((1 + CALLS_PER_CASE) / 2))
        yield Campaign(f"calls.{name}", cases, partial(_prepare, make), memory_mb=6000)

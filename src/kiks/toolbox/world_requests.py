"""The requests of the toolbox for robots and objects: their poses, paths and speeds, and how to move and add them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from kiks.engine.scalar_math import uniform
from kiks.engine.state import BALL
from kiks.errors import ParameterError, shown
from kiks.sim.free_space import ATTEMPTS
from kiks.sim.simulation import Simulation
from kiks.toolbox.matlab_arenas import place_mm, user_place
from kiks.toolbox.session_client import SessionClient
from kiks.toolbox.wire_format import matrix_text, number_text, numbers_text, parse_numbers

STREAM_SPAWN = 6
"""Random stream of random places and headings."""

LIGHT_ROW, BALL_ROW, CYLINDER_ROW = 1, 2, 3
"""Types of objects in lists and in kiks_spawn."""

ANGLE_MAX = 1e6
"""Largest angle [rad]; a larger number has too few digits left for a heading."""


def parse_port(word: str) -> int:
    """Parse the number of a port; 1 stands for port -1."""
    if not (word.isascii() and word.isdigit() and len(word) < 10):
        raise ParameterError(f"a port must be a whole number, -1, -2 and so on, but it was {shown(word)}.")
    return int(word)


# ---- robots ----


def _ask_robot(client: SessionClient, number: int, ask: Callable[[Simulation, int], str], nothing: str) -> str:
    """Return what a function says of a port's robot, or something else if it has none."""

    def asked(sim: Simulation) -> str:
        robot = client.robot(number)
        return nothing if robot is None else ask(sim, robot)

    return client.do(asked)


def ask_pose(client: SessionClient, words: str) -> str:
    """Return the x, y and heading [rad] of a port's robot; an empty text if it has none."""
    number = parse_port(words)
    if not client.session.has_begun:
        return ""

    def pose(sim: Simulation, robot: int) -> str:
        x_mm, y_mm, heading_rad = sim.pose(robot)
        return numbers_text((*user_place(sim.arena, x_mm, y_mm), heading_rad))

    return _ask_robot(client, number, pose, "")


def ask_pulse(client: SessionClient, words: str) -> str:
    """Return the way of a wheel for a pulse [mm] of port -1's robot, else of robot 1; an empty text without a robot."""
    session = client.session
    if session.given is not None:
        return number_text(session.given.pulse_mm)
    if session.desk is None or not session.world.robot_count:
        return ""
    return number_text(session.world.specs[(client.robot(1) or 1) - 1].body.pulse_mm)


def ask_path(client: SessionClient, words: str) -> str:
    """Return the path of a port's robot since the port was opened, x in row 1 and y in row 2."""
    number = parse_port(words)
    opened = client.openings.get(number)

    def path(sim: Simulation, robot: int) -> str:
        paths = sim.paths()
        # A robot that came after the recording began has no path yet.
        points: Any = paths[robot - 1] if robot <= len(paths) else np.empty((0, 4))
        if opened is not None:
            points = points[points[:, 0] >= opened.opened_ns * 1e-9 - 1e-9]
        points = points[~np.isnan(points[:, 1])]
        x, y = user_place(sim.arena, points[:, 1], points[:, 2])
        # A resolution of a micrometre keeps the line short.
        return matrix_text(np.round(np.vstack([x, y]), 3))

    client.session.trace()
    return _ask_robot(client, number, path, "2 0")


def ask_distances(client: SessionClient, words: str) -> str:
    """Return how far a port's robot has driven forwards and backwards, and its distance from the start [mm]."""
    number = parse_port(words)
    opened = client.openings.get(number)

    def distances(sim: Simulation, robot: int) -> str:
        forwards_mm, backwards_mm, straight_mm = sim.distances_mm()[robot - 1].tolist()
        if opened is not None:
            x_mm, y_mm, _ = sim.pose(robot)
            forwards_mm, backwards_mm = forwards_mm - opened.way_mm[0], backwards_mm - opened.way_mm[1]
            straight_mm = math.hypot(x_mm - opened.start_mm[0], y_mm - opened.start_mm[1])
        return numbers_text((forwards_mm, backwards_mm, straight_mm))

    return _ask_robot(client, number, distances, "0 0 0")


def ask_set_robot(client: SessionClient, words: str) -> str:
    """Move a port's robot to a place, the first robot of a world without one; return 1, or 0 if it is not free."""
    word, _, rest = words.partition(" ")
    number = parse_port(word)
    x, y, angle = parse_numbers(rest.split(), 3, "x, y and angle")
    _check_angle(angle)

    def set_robot(sim: Simulation) -> str:
        robot = client.robot(number) if sim.robot_count else client.take_robot(number)
        if robot is None:
            raise ParameterError(f"port {-number} must have a robot, but it has none. Open it with kiks_kopen.")
        turn = uniform(sim.seed, 0, 0, STREAM_SPAWN, sim.now_ns, 0)
        heading_rad = 2 * math.pi * turn if math.isnan(angle) else angle
        return _is_done(lambda: sim.place(robot, *place_mm(sim.arena, x, y), heading_rad))

    return client.do(set_robot)


# ---- objects ----


def ask_objects(client: SessionClient, words: str) -> str:
    """Return a row for each lamp, ball and cylinder: type, x, y, speed, angle."""

    def objects(sim: Simulation) -> str:
        rows = [(LIGHT_ROW, *user_place(sim.arena, *lamp[:2]), 0.0, 0.0) for lamp in sim.world.lamps.tolist()]
        for body in sim.bodies():
            x, y = user_place(sim.arena, float(body["x_mm"]), float(body["y_mm"]))
            velocity = float(body["velocity_x"]), float(body["velocity_y"])
            angle = math.atan2(velocity[1], velocity[0])
            rows.append((BALL_ROW if body["what"] == BALL else CYLINDER_ROW, x, y, math.hypot(*velocity), angle))
        return matrix_text(np.array(rows, np.float64).reshape(-1, 5))

    return client.do(objects)


def ask_set_object(client: SessionClient, words: str) -> str:
    """Move an object to a place and set its speed; return 1, or 0 if the place is not free."""
    number, x, y, speed, angle = parse_numbers(words.split(), 5, "row, x, y, speed and angle")
    _check_angle(angle)

    def set_object(sim: Simulation) -> str:
        lamps, bodies = sim.lamps, sim.bodies()
        _check_row(number, len(lamps) + len(bodies))
        row = int(number) - 1
        if row < len(lamps):
            x_mm, y_mm = _filled(place_mm(sim.arena, x, y), lamps[row, :2].tolist())
            is_inside = 0 <= x_mm <= sim.arena.width_mm and 0 <= y_mm <= sim.arena.height_mm
            if is_inside:
                lamps[row, :2] = x_mm, y_mm
            return str(int(is_inside))
        body: Any = bodies[row - len(lamps)]
        here, velocity = (float(body["x_mm"]), float(body["y_mm"])), (body["velocity_x"], body["velocity_y"])
        there = _filled(place_mm(sim.arena, x, y), here)
        speed_mm_s = math.hypot(*velocity) if math.isnan(speed) else speed
        heading_rad = math.atan2(velocity[1], velocity[0]) if math.isnan(angle) else angle
        if speed_mm_s < 0:
            speed_mm_s, heading_rad = -speed_mm_s, heading_rad + math.pi

        def roll_from(place: tuple[float, float]) -> None:
            sim.move_body(int(body["number"]), *place, speed_mm_s=min(speed_mm_s, 1000.0), heading_rad=heading_rad)

        is_moved = _is_done(lambda: roll_from(there))
        if is_moved == "0":
            # Speed and angle are set even if the place is not free (kiks-behaviour.md 1.4).
            _is_done(lambda: roll_from(here))
        return is_moved

    return client.do(set_object)


def ask_spawn(client: SessionClient, words: str) -> None:
    """Add an object to the world."""
    kind, x, y = parse_numbers(words.split(), 3, "type, x and y")
    if kind not in (LIGHT_ROW, BALL_ROW, CYLINDER_ROW):
        raise ParameterError(f"type must be 1 (light), 2 (ball) or 3 (cylinder), but it was {kind:g}.")
    settings = client.session.settings
    brightness = {BALL_ROW: settings.ball, CYLINDER_ROW: settings.cylinder}.get(int(kind))

    def places(sim: Simulation) -> Iterator[tuple[float, float]]:
        """Yield the place that was given, or the middle for a thing, and then random ones."""
        width_mm, height_mm = sim.arena.width_mm, sim.arena.height_mm
        if not math.isnan(x) and not math.isnan(y):
            x_mm, y_mm = place_mm(sim.arena, x, y)
            if not (0 <= x_mm <= width_mm and 0 <= y_mm <= height_mm):
                raise ParameterError(
                    f"a place must lie in the arena, x from 1 to {width_mm:g} and y from 1 to {height_mm:g}, but it "
                    f"was ({x:g}, {y:g})."
                )
            yield x_mm, y_mm
        elif kind != LIGHT_ROW:
            yield width_mm / 2, height_mm / 2
        there = len(sim.world.lamps) + len(sim.bodies())
        for attempt in range(ATTEMPTS):
            shares = [uniform(sim.seed, 0, there, STREAM_SPAWN, attempt, axis) for axis in (1, 2)]
            place = shares[0] * width_mm, shares[1] * height_mm
            # A lamp may hang anywhere, but is useful over the floor only.
            if kind != LIGHT_ROW or sim.arena.clearance_at_mm(*place) > 0:
                yield place

    def spawn(sim: Simulation) -> None:
        add: Any = {LIGHT_ROW: sim.add_lamp, BALL_ROW: sim.add_ball, CYLINDER_ROW: sim.add_cylinder}[int(kind)]
        greys = {} if brightness is None else {"brightness": brightness}
        for place in places(sim):
            if _is_done(partial(add, *place, **greys)) == "1":
                return
        raise ParameterError("there must be room for one more object, but none was found. Take something away.")

    client.do(spawn)
    _show_objects(client)


def ask_delete(client: SessionClient, words: str) -> None:
    """Remove the objects of some rows."""
    numbers = parse_numbers(words.split(), len(words.split()), "rows")

    def delete(sim: Simulation) -> None:
        lamp_count, bodies = len(sim.world.lamps), sim.bodies()
        for number in numbers:
            _check_row(number, lamp_count + len(bodies))
        # From below, so that the rows above stay where they are.
        for row in sorted({int(number) for number in numbers}, reverse=True):
            if row > lamp_count:
                sim.remove_body(int(bodies[row - lamp_count - 1]["number"]))
            else:
                sim.remove_lamp(row)

    client.do(delete)
    _show_objects(client)


def _show_objects(client: SessionClient) -> None:
    """Tell browsers which objects there are now, and take a checkpoint with them."""
    if client.session.desk is not None:
        client.session.desk.renew_scene()
    client.session.mark()


def _check_row(number: float, count: int) -> None:
    if number not in range(1, count + 1):
        raise ParameterError(f"row must be one of the {count} that kiks_siminfo_objects lists, but it was {number:g}.")


def _filled(wanted: tuple[float, float], present: Any) -> tuple[float, float]:
    """Return the wanted place, with the present coordinate for each that is NaN."""
    x_mm, y_mm = (old if math.isnan(new) else new for new, old in zip(wanted, present, strict=True))
    return float(x_mm), float(y_mm)


def _is_done(act: Callable[[], object]) -> str:
    """Call a function; return 1, or 0 if a place is not free."""
    try:
        act()
    except ParameterError:
        return "0"
    return "1"


def _check_angle(angle: float) -> None:
    if abs(angle) > ANGLE_MAX:
        raise ParameterError(f"an angle must be from -{ANGLE_MAX:g} to {ANGLE_MAX:g} rad, but it was {angle:g}.")


WORLD_REQUESTS: dict[str, Callable[[SessionClient, str], str | None]] = {
    "pulse": ask_pulse,
    "pose": ask_pose,
    "path": ask_path,
    "distances": ask_distances,
    "set_robot": ask_set_robot,
    "objects": ask_objects,
    "set_object": ask_set_object,
    "spawn": ask_spawn,
    "delete": ask_delete,
}
"""Handlers of the requests about a world, by name."""

"""Why a sensor reads what it reads, in numbers and in plain words: `Simulation.explain`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from kiks.engine.parameters import RAY_COUNT
from kiks.engine.sensing import ambient, explain
from kiks.engine.sensing.observe import NOTHING
from kiks.firmware.robot_kind import robot_kind
from kiks.model.checks import check_count
from kiks.model.robot import SENSOR_COUNT
from kiks.sim.world import World
from kiks.upwards import shown_in_notebooks

RESPONSES = {
    "reflection": "the light that comes back along each ray, and the share of it above a threshold",
    "thesis": "the thesis's networks, trained on a real robot",
    "fast": "the thesis's table, which takes lengths in steps of 10 mm",
    "curve": "counts against distance as they were measured on a real robot",
}
"""One-line description of each sensor model (the page "Sensors")."""


@dataclass(frozen=True)
class SeenRay:
    """One of a proximity sensor's seven rays.

    Attributes:
        angle_deg: Its direction, counter-clockwise from where the robot looks [deg].
        length_mm: From the sensor to what it met, as the response takes it [mm]; infinite for nothing.
        met: What it met: 'wall', 'robot 2', 'ball 1', 'cylinder 1' or 'nothing'.
        brightness: Of what it met, 1 black to 255 white; 0 for nothing.
        incidence_deg: Angle of incidence [deg], 0 if the ray hits a surface squarely; NaN if it hits nothing.
        contribution_counts: How much less the sensor would expect if this ray met nothing. Responses are no sums: the
            contributions of all rays may come to more or less than the whole.
    """

    angle_deg: float
    length_mm: float
    met: str
    brightness: int
    incidence_deg: float
    contribution_counts: float


@shown_in_notebooks("kiks.export.notebook", "sentences")
@dataclass(frozen=True, kw_only=True)
class SensorExplanation:
    """What explanations of both kinds of readings have.

    `what` is what messages call such a sensor.

    Attributes:
        robot: Number of the robot, from 1.
        sensor: Index of the sensor, from 0.
        name: What it is called: 'left 90' and so on.
        age_ms: How long ago it was sampled: each sensor has an instant of its own [ms].
        step_counts: Steps of the converter.
        maximum_counts: Its end.
        count: What the robot's command returns.
    """

    what: ClassVar[str] = "sensor"

    robot: int
    sensor: int
    name: str
    age_ms: float
    step_counts: float
    maximum_counts: float
    count: int

    def __repr__(self) -> str:
        return (
            f"<{type(self).__name__}: {self.what} {self.sensor} ({self.name}) of robot {self.robot} reads {self.count}>"
        )


@dataclass(frozen=True, kw_only=True, repr=False)
class Explanation(SensorExplanation):
    """Why command N returns a count for a sensor at this instant.

    `baseline_counts + response_counts + scatter_counts + jitter_counts`, rounded to whole steps of `step_counts` and
    cut off at 0 and `maximum_counts`, is `count`. Other attributes are those of `SensorExplanation`.

    Attributes:
        reach_mm: How far its rays go [mm].
        rays: The seven rays, the leftmost first.
        response: The name of what makes counts of rays.
        gain: The sensor's own, on the light where the response has light, else on the counts.
        baseline_counts: What it expects with nothing near.
        response_counts: What it expects above that.
        scatter_counts: Noise in proportion to the reading.
        jitter_counts: Noise that is there with nothing near, too.
    """

    reach_mm: float
    rays: tuple[SeenRay, ...]
    response: str
    gain: float
    baseline_counts: float
    response_counts: float
    scatter_counts: float
    jitter_counts: float

    @property
    def expected_counts(self) -> float:
        """The sensor's mean reading here, before noise and rounding."""
        return self.baseline_counts + self.response_counts

    def text(self) -> str:
        """Return it in plain sentences, one a line."""
        lines = [f"Sensor {self.sensor} ({self.name}) of robot {self.robot} reads {self.count}."]
        met = [ray for ray in self.rays if ray.brightness > 0]
        if met:
            nearest_mm = min(ray.length_mm for ray in met)
            lines.append(
                f"It looked {self.age_ms:.1f} ms ago. {_how_many(len(met))} met {_listed(met)}, "
                f"{nearest_mm:.1f} mm away where that is nearest."
            )
        else:
            lines.append(f"It looked {self.age_ms:.1f} ms ago and saw nothing within {self.reach_mm:.0f} mm.")
        lines.append(
            f"With nothing near it reads {self.baseline_counts:.1f} on average. For its rays the response "
            f"{self.response!r} ({RESPONSES[self.response]}) adds {self.response_counts:.1f}: "
            f"{self.expected_counts:.1f} are expected."
        )
        most = max(self.rays, key=lambda ray: abs(ray.contribution_counts))
        # Less than half a count changes no reading.
        if abs(most.contribution_counts) >= 0.5:
            lines.append(
                f"The ray at {_angle(most.angle_deg)} matters most: without it, "
                f"{self.expected_counts - most.contribution_counts:.1f} would be expected."
            )
        elif abs(self.response_counts) >= 0.5:
            lines.append("No ray matters by itself: without any one of them, it would be as much.")
        if self.gain != 1.0:
            lines.append(f"This sensor's own gain, {self.gain:g}, is counted in.")
        lines.append(_noise_line(self.scatter_counts + self.jitter_counts, self.expected_counts, self.count))
        if self.count >= self.maximum_counts:
            lines.append(f"That is the most that it can read: {self.maximum_counts:.0f}.")
        return "\n".join(lines)


@dataclass(frozen=True)
class SeenLamp:
    """A lamp, as one light sensor sees it.

    Attributes:
        lamp: Its row in `Simulation.lamps`, counted from 1.
        distance_mm: From the sensor [mm].
        angle_deg: Off the sensor's axis, 0 straight ahead [deg].
        power_w: Its power [W].
        state: 'seen', 'off', 'behind the sensor', 'behind the robot itself' or 'hidden by wall', 'hidden by ball 1' ...
        contribution_counts: How much more the sensor would expect without it: light makes readings smaller.
    """

    lamp: int
    distance_mm: float
    angle_deg: float
    power_w: float
    state: str
    contribution_counts: float


@dataclass(frozen=True, kw_only=True, repr=False)
class LightExplanation(SensorExplanation):
    """Why command O returns a count for a sensor at this instant.

    `expected_counts + noise_counts`, rounded to whole steps and cut off as `Explanation` says, is `count`. Other
    attributes are those of `SensorExplanation`.

    Attributes:
        lamps: All lamps, in their order.
        unlit_counts: What it expects without any lamp.
        expected_counts: What it expects with the lamps that it sees.
        noise_counts: What chance added.
    """

    what = "light sensor"

    lamps: tuple[SeenLamp, ...]
    unlit_counts: float
    expected_counts: float
    noise_counts: float

    def text(self) -> str:
        """Return it in plain sentences, one a line."""
        lines = [
            f"Light sensor {self.sensor} ({self.name}) of robot {self.robot} reads {self.count}; less is brighter."
        ]
        lines.append(f"Without any lamp it reads {self.unlit_counts:.0f} on average.")
        if not self.lamps:
            lines.append("There is no lamp in the arena.")
        for lamp in self.lamps:
            where = f"Lamp {lamp.lamp} ({lamp.power_w:g} W)"
            if lamp.state == "seen":
                lines.append(
                    f"{where} shines on it from {lamp.distance_mm:.0f} mm, {lamp.angle_deg:.0f} degrees off its axis; "
                    f"without it, {self.expected_counts + lamp.contribution_counts:.0f} would be expected."
                )
            else:
                lines.append(f"{where} does not shine on it: it is {lamp.state}.")
        lines.append(_noise_line(self.noise_counts, self.expected_counts, self.count))
        return "\n".join(lines)


def explain_proximity(world: World, robot: int, sensor: int) -> Explanation:
    """Return why N returns what it returns for a sensor in a world whose ticks are done."""
    index = world.index_of(robot)
    _check_sensor(sensor)
    rays, met = np.empty((RAY_COUNT, 5)), np.empty(RAY_COUNT, np.int64)
    *common, reach_mm, gain, baseline, response, scatter, jitter = explain.explain_proximity(
        world.scene, index, sensor, world.state.tick_count, world.now_ns, (rays, met)
    )
    names = ["nothing" if disc == NOTHING else world.free_space.name_of(disc) for disc in met.tolist()]
    return Explanation(
        **_common(world, index, sensor, *common),
        reach_mm=reach_mm,
        rays=tuple(
            SeenRay(angle_deg, length_mm, name, int(brightness), incidence_deg, contribution)
            for name, (angle_deg, length_mm, brightness, incidence_deg, contribution) in zip(
                names, rays.tolist(), strict=True
            )
        ),
        response=world.specs[index].proximity.response,
        gain=gain,
        baseline_counts=baseline,
        response_counts=response,
        scatter_counts=scatter,
        jitter_counts=jitter,
    )


def explain_ambient(world: World, robot: int, sensor: int) -> LightExplanation:
    """Return why O returns what it returns for a sensor in a world whose ticks are done."""
    index = world.index_of(robot)
    _check_sensor(sensor)
    lamps, why = np.empty((len(world.lamps), 4)), np.empty((len(world.lamps), 2), np.int64)
    *common, unlit, expected, noise = explain.explain_ambient(
        world.scene, index, sensor, world.state.tick_count, world.now_ns, (lamps, why)
    )
    states = [_lamp_state(world, *each) for each in why.tolist()]
    return LightExplanation(
        **_common(world, index, sensor, *common),
        lamps=tuple(
            SeenLamp(lamp, distance_mm, angle_deg, power_w, state, contribution)
            for lamp, (state, (distance_mm, angle_deg, power_w, contribution)) in enumerate(
                zip(states, lamps.tolist(), strict=True), 1
            )
        ),
        unlit_counts=unlit,
        expected_counts=expected,
        noise_counts=noise,
    )


def _common(
    world: World, index: int, sensor: int, age_ms: float, step_counts: float, maximum_counts: float, count: int
) -> dict[str, Any]:
    """Return the fields of a `SensorExplanation`."""
    return {
        "robot": index + 1,
        "sensor": sensor,
        "name": robot_kind(world.specs[index].kind).sensor_names[sensor],
        "age_ms": age_ms,
        "step_counts": step_counts,
        "maximum_counts": maximum_counts,
        "count": count,
    }


def _check_sensor(sensor: int) -> None:
    check_count("sensor", sensor, 0, SENSOR_COUNT - 1, "0 looks to the left, 2 and 3 ahead, 6 and 7 back.")


def _lamp_state(world: World, how: int, hider: int) -> str:
    if how == explain.HIDDEN:
        return f"hidden by {world.free_space.name_of(hider)}"
    return {
        ambient.FACING: "seen",
        ambient.BEHIND: "behind the sensor",
        ambient.BEHIND_BODY: "behind the robot itself",
        explain.OFF: "off",
    }[how]


def _how_many(ray_count: int) -> str:
    if ray_count == RAY_COUNT:
        return "All of its seven rays"
    return "One of its seven rays" if ray_count == 1 else f"{ray_count} of its seven rays"


def _listed(rays: list[SeenRay]) -> str:
    """Return what rays met, nearest things first."""
    nearest_first = sorted(rays, key=lambda ray: ray.length_mm)
    *others, last = dict.fromkeys("a wall" if ray.met == "wall" else ray.met for ray in nearest_first)
    return f"{', '.join(others)} and {last}" if others else last


def _angle(angle_deg: float) -> str:
    side = "to the left" if angle_deg > 0 else "to the right"
    return "0 degrees, straight ahead" if abs(angle_deg) < 0.5 else f"{abs(angle_deg):.0f} degrees {side}"


def _noise_line(noise: float, expected: float, count: int) -> str:
    verb = "added" if noise >= 0 else "took off"
    return f"Chance {verb} {abs(noise):.1f}: that makes {expected + noise:.1f}, which the converter gives as {count}."

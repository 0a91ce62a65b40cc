"""A robot as its firmware sees it: registers, sensors, turrets and the speed of its line."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from kiks.engine.state import MODE_SPEED, ROBOT, State
from kiks.firmware.receiver import Receiver
from kiks.firmware.turret import Turret
from kiks.model.robot import RobotSpec
from kiks.units import SENSOR_SLOT_NS


class Robot:
    """The parts of one robot that commands act on: its record of the state, its sensors, turrets and line.

    Args:
        spec: What kind of robot it is.
        state: The world's state, which has a record for each robot.
        number: Index of the robot's record.
        sense_proximity: Returns the eight counts latched at this time.
        sense_ambient: The same for light.

    Attributes:
        receiver: Makes lines of the characters that arrive.
        fitted: All turrets.
        turrets: Those that answer orders, by their numbers.
        dictated: An order for a turret, and the robot's reply to it, if the program that sends it says that, too.
        baud: Speed of the line now [bit/s]; the tool `serial` changes it.
        selected_baud: Speed that the mode selector asks for [bit/s]: the robot reads it at a reset.
        hinted: What a person has had a hint about: it comes once.
    """

    def __init__(
        self,
        spec: RobotSpec,
        state: State,
        number: int,
        *,
        sense_proximity: Callable[[], list[int]],
        sense_ambient: Callable[[], list[int]],
    ) -> None:
        self.spec = spec
        self.number = number
        self.sense_proximity = sense_proximity
        self.sense_ambient = sense_ambient
        self.receiver = Receiver(keeps_empty_lines=spec.quirks.answer_empty_lines)
        self.fitted: list[Turret] = []
        self.turrets: dict[int, Turret] = {}
        self.dictated: tuple[bytes, bytes] | None = None
        self.hinted: set[bytes] = set()
        self.now_ns = 0
        self.selected_baud = spec.firmware.baud
        self.demo_wakes_ns: int | None = None
        self.take(state)
        self.reset()

    def take(self, state: State) -> None:
        """Use the arrays of a state; call again when they are replaced."""
        self.robots = state.robots
        # Writable views of this robot's fields: a field of one number has shape [1], the others keep their own.
        fields: dict[str, Any] = {}
        for name in ROBOT.names or ():
            column = state.robots[name][0]
            fields[name] = column[self.number] if column.ndim > 1 else column[self.number : self.number + 1]
        self.view = SimpleNamespace(**fields)

    def fit(self, turret: Turret) -> None:
        """Add a turret; one without a number answers no orders."""
        self.fitted.append(turret)
        if turret.number >= 0:
            self.turrets[turret.number] = turret

    # ---- power ----

    def reset(self) -> None:
        """Reset the firmware to its defaults (khepera-protocol.md 6.7); the body stays where it is."""
        view, reset = self.view, self.spec.reset
        for name in ("target_pulses", "trajectory_pulses", "trajectory_speed", "error_sum", "last_error", "pwm"):
            getattr(view, name)[:] = 0
        for name in ("speed_setpoint", "pwm_setpoint", "on_target", "led", "bus", "slip_pulses", "slip_count"):
            getattr(view, name)[:] = 0
        view.motor_mode[:] = MODE_SPEED
        view.counter_offset[:] = -view.pulse_count
        view.speed_gains[:] = reset.speed_gains
        view.position_gains[:] = reset.position_gains
        view.profile_speed[:] = reset.profile_speed_pulses
        view.profile_acceleration[:] = reset.profile_acceleration
        self.baud = self.selected_baud
        self.demo_wakes_ns = None
        for turret in self.fitted:
            turret.reset()

    def scanned_sensor(self) -> int:
        """Return the sensor that is being sampled now."""
        return self.now_ns // SENSOR_SLOT_NS % 8

    def start_demo(self) -> None:
        """Start the demonstration that avoids obstacles without a host (khepera-protocol.md 6.9)."""
        self.demo_wakes_ns = self.now_ns

"""What the e-puck's program remembers, and what it does with that: the part that lines and requests share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from kiks.engine.state import State
from kiks.firmware.epuck.personality import PERSONALITIES
from kiks.firmware.firmware import Firmware
from kiks.model.checks import check_choice
from kiks.model.robot import RobotSpec

Numbers = tuple[int, ...]

_FIELDS = {
    "i4": {"held": 2, "P": 2, "offset": 2},
    "u4": {"sums": 8},
    "i2": {"zero": 8, "B": 1, "F": 1, "L": 2, "J": 4, "corner": 2, "T": 1, "W": 3, "X": 1},
    "u1": {"readings_left": 1, "task": 1, "ring": 8, "body": 1, "front": 1, "colours": 12, "selector": 1, "free": 1},
}

MEMORY = np.dtype([(name, kind, (count,)) for kind, fields in _FIELDS.items() for name, count in fields.items()])
"""What the program remembers, laid over the field `registers` of a robot's record.

A capital letter is a command, with the numbers that it got last: what a line leaves out keeps its value. So `J` is
the mode, width, height and zoom of pictures; `Y` has the first two of `W`; `D`, the speed that was asked for
[steps/s], is the set point of the motors. The others are: what a stop has `held` back of that; `offset` of the
counters from the steps that were sent, modulo 2^32; `sums` of the proximity readings of a calibration, and how many
are left; the `zero` of the sensors that it gives; the `corner` of pictures on the camera's sensor; the `task` that
`wake` goes on with; the LEDs, 0 off and 1 on: the `ring` clockwise from ahead, `body` and `front`; red, green and
blue [%] of the LEDs 1, 3, 5 and 7 of the second e-puck; and how far the `selector` is turned on from
`SELECTOR_START`.
"""

SELECTOR_START = 3
"""The position in which the first e-puck runs this program on Bluetooth (epuck-protocol.md 0)."""

_RESTING, _CALIBRATING, _CALIBRATING_SILENTLY, _STARTING = range(4)

CALIBRATION_READINGS = 100
"""Of which the mean becomes the zero (epuck-protocol.md 6.2). They are spread evenly over the time of a calibration."""

CALIBRATION_NS = 2_000_000_000
"""How long a calibration takes [ns] (epuck-protocol.md 9.4 suggests it)."""

RESET_NS = 400_000_000
"""How long a reset takes [ns] [?].

Source: epuck-protocol.md 9.4 suggests 0.5 s; it has to be less, as pyePuck waits no longer for the text (7).
"""

SOUND_NS = 1_000_000_000
"""How long each sound lasts [ns] [?]: no source has the lengths of the samples."""

LOUDNESS_COUNTS = 500.0
"""How loud each sound is: what a microphone at 100 mm hears [?]."""

CALIBRATED = b"k, Calibration finished\r\n"

START_TEXT = b'\f\aWELCOME to the SerCom protocol on e-Puck\r\nthe EPFL education robot type "H" for help\r\n'


def wrap(value: int, bits: int) -> int:
    """Return the low bits of a whole number as a signed one.

    Example:
        >>> wrap(32_768, 16), wrap(-5, 16)
        (-32768, -5)
    """
    half = 1 << bits - 1
    return (value + half) % (2 * half) - half


def switched(led: int, action: int) -> int:
    """Return what becomes of a LED: 0 switches it off, 1 on, and any other number over."""
    return action if action in (0, 1) else int(not led)


class EPuckRobot(Firmware):
    """An e-puck's memory, without its commands.

    Attributes:
        personality: The version of its program.
        layout: What it remembers, over the registers.
        memory: Writable views of its fields.
    """

    layout = MEMORY

    def __init__(self, spec: RobotSpec, state: State, number: int, sense: Callable[[str], list[int]]) -> None:
        version = spec.firmware.protocol_version
        check_choice("firmware.protocol_version", version, PERSONALITIES)
        self.personality = PERSONALITIES[version]
        super().__init__(spec, state, number, sense)

    def take(self, state: State) -> None:
        """Use the arrays of a state; call again when they are replaced."""
        super().take(state)
        record = self.view.registers.view(self.layout)[0]
        # A batch sets the speeds by the set point alone, so `D` is no copy of it.
        fields = {name: record[name] for name in self.layout.names or ()}
        self.memory: Any = SimpleNamespace(**fields, D=self.view.speed_setpoint)

    def reset(self) -> None:
        """Set everything to what it is when the power comes, but for the selector; the body stays where it is.

        A personality that begins calibrated has the zeros that it would measure with nothing near.
        """
        selector = int(self.memory.selector[0])
        self.view.registers[:] = 0
        self.memory.selector[:] = selector
        self.memory.J[:] = 1, 40, 40, 8
        self.memory.corner[:] = 160, 80
        if self.personality.begins_calibrated:
            self.memory.zero[:] = [round(counts) for counts in self.spec.proximity.baseline_counts]
        self.view.speed_setpoint[:] = 0
        self.play(0)
        self.baud = self.selected_baud
        self.wakes_ns = None

    @property
    def will_speak(self) -> bool:
        """Whether a calibration or a reset is under way, which a text may end."""
        return self.wakes_ns is not None

    @property
    def selector(self) -> int:
        """Position of the selector, 0 to 15; write to it."""
        return (int(self.memory.selector[0]) + SELECTOR_START) % 16

    @selector.setter
    def selector(self, position: int) -> None:
        self.memory.selector[:] = (position - SELECTOR_START) % 16

    # ---- what commands do ----

    def remember(self, slot: str, numbers: Sequence[int]) -> list[int]:
        """Put arguments into the memory of a command, as many as there are, and return all that are there."""
        stored = getattr(self.memory, slot)
        if slot == "D":
            stored += self.memory.held
            self.memory.held[:] = 0
        bits = min(self.personality.int_bits, 8 * stored.itemsize)
        if numbers:
            stored[: len(numbers)] = [wrap(number, bits) for number in numbers[: len(stored)]]
        values: list[int] = stored.tolist()
        return values

    def set_speeds(self, left: int, right: int) -> Numbers:
        """Turn the wheels until the next command that moves them; the motors clamp the speeds [steps/s]."""
        self.view.speed_setpoint[:] = left, right
        return ()

    def set_counters(self, left: int, right: int) -> Numbers:
        """Set the counters of steps; nothing moves."""
        steps = self.sense("positions")
        self.memory.offset[:] = wrap(left - steps[0], 32), wrap(right - steps[1], 32)
        return ()

    def counters(self) -> Numbers:
        """Return the counters of steps, as an `int` of the robot holds them."""
        pairs = zip(self.sense("positions"), self.memory.offset.tolist(), strict=True)
        return tuple(wrap(steps + offset, self.personality.int_bits) for steps, offset in pairs)

    def proximity(self, *, is_calibrated: bool = True) -> list[int]:
        """Return the proximity readings, without their zeros or as they are."""
        readings = self.sense("proximity")
        if not is_calibrated:
            return readings
        readings = [reading - zero for reading, zero in zip(readings, self.memory.zero.tolist(), strict=True)]
        return [max(reading, 0) for reading in readings] if self.personality.clamps_proximity else readings

    def play(self, sound: int) -> Numbers:
        """Begin a sound, or stop the one that plays."""
        is_sound = 1 <= sound <= 5
        self.view.loudness[:] = LOUDNESS_COUNTS if is_sound else 0.0
        self.view.sound_ends_ns[:] = self.now_ns + SOUND_NS if is_sound else 0
        return ()

    def calibrate(self, *, is_silent: bool = False) -> None:
        """Begin to measure the zeros of the proximity sensors; the end is announced if it was asked for on the line."""
        self.memory.sums[:] = 0
        self.memory.readings_left[:] = CALIBRATION_READINGS
        self.memory.task[:] = _CALIBRATING_SILENTLY if is_silent else _CALIBRATING
        self.wakes_ns = self.now_ns + CALIBRATION_NS // CALIBRATION_READINGS
        self._show_calibration(1)

    def restart(self) -> None:
        """Reset the robot, and send the start text when that is done."""
        self.reset()
        self.set_counters(0, 0)
        self.memory.task[:] = _STARTING
        self.wakes_ns = self.now_ns + RESET_NS

    def wake(self, now_ns: int) -> bytes:
        """Go on with a calibration or a reset; return the text that ends it."""
        self.now_ns, self.wakes_ns = now_ns, None
        memory, task = self.memory, int(self.memory.task[0])
        if task in (_CALIBRATING, _CALIBRATING_SILENTLY):
            memory.sums += np.array(self.sense("proximity"), np.uint32)
            memory.readings_left -= 1
            if memory.readings_left[0]:
                self.wakes_ns = now_ns + CALIBRATION_NS // CALIBRATION_READINGS
                return b""
            memory.zero[:] = memory.sums // CALIBRATION_READINGS
            self._show_calibration(0)
        memory.task[:] = _RESTING
        if task == _STARTING:
            return b"Selector pos %d\r\n" % self.selector * self.personality.tells_selector + START_TEXT
        return CALIBRATED if task == _CALIBRATING else b""

    def _show_calibration(self, led: int) -> None:
        if self.personality.shows_calibration:
            self.memory.ring[:] = led

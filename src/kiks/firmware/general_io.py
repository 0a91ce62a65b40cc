"""The General I/O turret: eight digital inputs, eight outputs, three analogue inputs (khepera-protocol.md 10.6).

It is not intelligent: a program reads its inputs with `R,32` and `I,3` to `I,5`, and writes its outputs with
`W,data,32`. What hangs on its other side is yours:

    io = sim.fit(1, "io")
    io.inputs = 0b00000101
    io.set_analog(3, 2.5)
    print(io.outputs)
"""

from __future__ import annotations

from collections.abc import Sequence

from kiks.errors import ParameterError
from kiks.firmware.turret import Shape, Turret

ADDRESS = 32
"""Its place on the extension bus (khepera-protocol.md 10.1)."""

CHANNELS = (3, 4, 5)
"""Its analogue inputs (khepera-protocol.md 10.6)."""

VOLTS_PER_COUNT = 0.004
"""Of an analogue input [V] (khepera-protocol.md 4.10)."""

COUNTS_MAX = 1023


class GeneralIO(Turret):
    """Wires to and from the world outside."""

    number = -1
    name = "General I/O"

    @property
    def outputs(self) -> int:
        """What the program wrote last, a byte; 0 at the beginning and after a reset."""
        return int(self.site.record["bus"][ADDRESS])

    @property
    def inputs(self) -> int:
        """What the program reads, a byte; write to it.

        Raises:
            ParameterError: If it is set to anything but a whole number from 0 to 255.
        """
        return int(self.site.record["bus_inputs"][ADDRESS])

    @inputs.setter
    def inputs(self, value: int) -> None:
        if not isinstance(value, int) or not 0 <= value <= 255:
            raise ParameterError(f"inputs must be a whole number from 0 to 255, but it was {value!r}. One bit a wire.")
        with self.site.lock:
            self.site.record["bus_inputs"][ADDRESS] = value

    def set_input(self, wire: int, is_high: bool) -> None:
        """Set one digital input.

        Args:
            wire: Which, 0 to 7; 0 is the lowest bit of the byte.
            is_high: What it carries.

        Raises:
            ParameterError: If there is no such wire.
        """
        if not isinstance(wire, int) or not 0 <= wire <= 7:
            raise ParameterError(f"wire must be a whole number from 0 to 7, but it was {wire!r}. There are eight.")
        with self.site.lock:
            self.inputs = self.inputs | 1 << wire if is_high else self.inputs & ~(1 << wire)

    def set_analog(self, channel: int, volts: float) -> None:
        """Set an analogue input; it reads from 0 to 4.09 V, and its end beyond.

        Args:
            channel: 3, 4 or 5, as in command `I`.
            volts: Its voltage [V].

        Raises:
            ParameterError: If there is no such channel, or the voltage is not a number.
        """
        if channel not in CHANNELS:
            raise ParameterError(f"channel must be 3, 4 or 5, but it was {channel!r}. Command I has the same numbers.")
        if not isinstance(volts, int | float) or volts != volts:
            raise ParameterError(f"volts must be a number, but it was {volts!r}. Inputs read 0 to 4.09 V.")
        counts = min(max(volts, 0.0) / VOLTS_PER_COUNT, float(COUNTS_MAX))
        with self.site.lock:
            self.site.record["analog_inputs"][channel - CHANNELS[0]] = int(counts + 0.5)

    def shapes(self) -> Sequence[Shape]:
        """Return a board, and a red dot for each output that is high."""
        board = Shape(((-20.0, -18.0), (20.0, -18.0), (20.0, 18.0), (-20.0, 18.0)), "#207040")
        dots = [Shape(((12.0, 14.0 - 4.0 * k),), "#e03020", 1.5) for k in range(8) if self.outputs >> k & 1]
        return (board, *dots)

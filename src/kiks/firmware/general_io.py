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

from kiks.firmware.turret import Shape, Turret
from kiks.model.checks import check_count, check_number

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
        """The last byte that the program wrote; 0 at the start and after a reset."""
        return int(self.site.record["bus"][ADDRESS])

    @property
    def inputs(self) -> int:
        """The byte that the program reads; write to it."""
        return int(self.site.record["bus_inputs"][ADDRESS])

    @inputs.setter
    def inputs(self, value: int) -> None:
        byte = check_count("inputs", value, 0, 255, "One bit a wire.")
        with self.site.lock:
            self.site.record["bus_inputs"][ADDRESS] = byte

    def set_input(self, wire: int, is_high: bool) -> None:
        """Set one digital input.

        Args:
            wire: Which, 0 to 7; 0 is the lowest bit of the byte.
            is_high: What it carries.
        """
        wire = check_count("wire", wire, 0, 7, "There are eight.")
        with self.site.lock:
            self.inputs = self.inputs | 1 << wire if is_high else self.inputs & ~(1 << wire)

    def set_analog(self, channel: int, volts: float) -> None:
        """Set an analogue input; it reads from 0 to 4.09 V, and its end beyond.

        Args:
            channel: 3, 4 or 5, as in command `I`.
            volts: Its voltage [V].
        """
        channel = check_count("channel", channel, CHANNELS[0], CHANNELS[-1], "Command I has the same numbers.")
        volts = check_number("volts", volts, advice="Inputs read 0 to 4.09 V.")
        counts = min(max(volts, 0.0) / VOLTS_PER_COUNT, float(COUNTS_MAX))
        with self.site.lock:
            self.site.record["analog_inputs"][channel - CHANNELS[0]] = int(counts + 0.5)

    def status(self) -> str:
        """Return its wires."""
        return f"inputs {self.inputs:08b}, outputs {self.outputs:08b}"

    def shapes(self) -> Sequence[Shape]:
        """Return a board, and a red dot for each output that is high."""
        board = Shape(((-20.0, -18.0), (20.0, -18.0), (20.0, 18.0), (-20.0, 18.0)), "#207040")
        dots = [Shape(((12.0, 14.0 - 4.0 * k),), "#e03020", 1.5) for k in range(8) if self.outputs >> k & 1]
        return (board, *dots)

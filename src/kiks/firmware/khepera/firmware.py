"""The Khepera's firmware: a line comes in, a reply goes out; never an exception (khepera-protocol.md 3.2 to 3.4)."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable

from kiks.engine.state import MODE_SPEED, State
from kiks.errors import shown
from kiks.firmware.firmware import Firmware
from kiks.firmware.khepera import tools
from kiks.firmware.khepera.commands import COMMANDS, PROTOCOL_ERROR, CommandRefusedError, Reply, set_speed
from kiks.firmware.khepera.hints import hint_for
from kiks.firmware.receiver import LINE_LIMIT, Receiver
from kiks.model.robot import RobotSpec

UNKNOWN = b"Command not found\r\n"

_log = logging.getLogger("kiks.robot")

DEMO_PERIOD_NS = 20_000_000
"""Period of the demonstration of mode 0 [ns]: one sensor round."""

_COMMANDS = {command.letter.encode(): (command.act, len(command.parameters)) for command in COMMANDS}
_NUMBER = re.compile(rb"[ \t]*([+-]?[0-9]+)[ \t]*")


class KheperaFirmware(Firmware):
    r"""The firmware of one Khepera.

    Example:
        >>> from kiks.engine.state import State
        >>> from kiks.model.robot import RobotSpec
        >>> state = State.empty(world_count=1, robot_count=1)
        >>> robot = KheperaFirmware(RobotSpec.load("khepera"), state, 0, lambda sense: [0] * 8)
        >>> robot.execute(b"D,5,5", 0), robot.execute(b"D,5", 0), robot.execute(b"M", 0)
        (b'd\r\n', b'z,Protocol error\r\n', b'Command not found\r\n')
    """

    def __init__(self, spec: RobotSpec, state: State, number: int, sense: Callable[[str], list[int]]) -> None:
        self.receiver = Receiver(keeps_empty_lines=spec.quirks.answer_empty_lines)
        super().__init__(spec, state, number, sense)

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
        self.wakes_ns = None
        for turret in self.fitted:
            turret.reset()

    # ---- a line ----

    def execute(self, line: bytes, now_ns: int) -> bytes:
        """Carry out a line without its terminator, at a time [ns]; return the reply with CR LF, or nothing."""
        self.now_ns = now_ns
        quirks = self.spec.quirks
        if not line:
            return self._unknown() if quirks.answer_empty_lines else b""
        if len(line) > LINE_LIMIT:
            return self._unknown()
        words = line.split(b",")
        letter = words[0]
        if quirks.accept_lower_case:
            letter = letter.upper()
        try:
            if letter in _COMMANDS:
                act, count = _COMMANDS[letter]
                if letter == b"T":
                    # A turret of a user's own may not be here in a replay: its recorded reply stands for it.
                    if self.dictated is not None and line == self.dictated[0]:
                        return self.dictated[1] + b"\r\n"
                    values = act(self, *self._message(words[1:]))
                else:
                    # Commands without parameters ignore what follows the comma; for the others the count must fit.
                    values = act(self, *numbers(words[1:], count)) if count else act(self)
                return self._reply(letter.lower(), values)
        except CommandRefusedError as refused:
            refusal: bytes = refused.args[0]
            self._hint(line, refusal)
            return refusal
        answer = tools.run(self, line)
        if answer is None:
            self._hint(line, UNKNOWN)
            return self._unknown()
        return answer

    def _reply(self, letter: bytes, values: Reply) -> bytes:
        if values:
            return letter + b"," + ",".join(map(str, values)).encode() + b"\r\n"
        if letter == b"d" and self.spec.quirks.d_reply_trailing_comma:
            return b"d,\r\n"
        return letter + b"\r\n"

    def _message(self, words: list[bytes]) -> tuple[int | str, ...]:
        """Return a turret's number, an order for it and the order's numbers (khepera-protocol.md 4.18)."""
        if len(words) < 2:
            raise CommandRefusedError(PROTOCOL_ERROR)
        order = words[1].strip(b" \t")
        if self.spec.quirks.accept_lower_case:
            order = order.upper()
        if len(order) != 1 or not b"A" <= order <= b"Z":
            raise CommandRefusedError(PROTOCOL_ERROR)
        return (*numbers(words[:1], 1), order.decode(), *numbers(words[2:], len(words) - 2))

    def _hint(self, line: bytes, answer: bytes) -> None:
        """Say once for each kind of refusal how the command is written: the robot does not."""
        if self.gives_hints and answer not in self.hinted and (hint := hint_for(line)):
            self.hinted.add(answer)
            said, text = answer.decode().strip(), shown(line.decode("latin-1"))
            _log.warning("robot %d answered %r to %s. %s", self.number + 1, said, text, hint)

    def _unknown(self) -> bytes:
        return b"z," + UNKNOWN if self.spec.quirks.unknown_command_with_z else UNKNOWN

    # ---- the demonstration of mode 0 ----

    def wake(self, now_ns: int) -> bytes:
        """Take one step: Braitenberg's vehicle 3 with K-Team's weights (khepera-protocol.md 6.9)."""
        self.now_ns = now_ns
        s = self.sense("proximity")
        first = (-5 * s[0] - 15 * s[1] - 18 * s[2] + 6 * s[3] + 4 * s[4] + 4 * s[5] + 3 * s[6] + 5 * s[7]) / 400
        second = (4 * s[0] + 4 * s[1] + 6 * s[2] - 18 * s[3] - 15 * s[4] - 5 * s[5] + 5 * s[6] + 3 * s[7]) / 400
        set_speed(self, round(0.7 * (20 + second)), round(0.7 * (20 + first)))
        self.wakes_ns = now_ns + DEMO_PERIOD_NS
        return b""


def numbers(words: list[bytes], count: int) -> list[int]:
    """Return decimal integers, blanks around them allowed, as many as a command takes.

    Raises:
        CommandRefusedError: If there are more or fewer, or one is no decimal integer.
    """
    if len(words) != count:
        raise CommandRefusedError(PROTOCOL_ERROR)
    values = []
    for word in words:
        if word.isdigit():
            values.append(int(word))
            continue
        match = _NUMBER.fullmatch(word)
        if match is None:
            raise CommandRefusedError(PROTOCOL_ERROR)
        values.append(int(match[1]))
    return values

"""What a person probably meant by a line that the robot has refused: for a hint beside the robot's own answer."""

from __future__ import annotations

import re

from kiks.firmware.khepera.commands import COMMANDS

_PARAMETERS = {command.letter: command.parameters for command in COMMANDS if command.letter != "T"}
_NUMBER = r"[+-]?[0-9]+(?:\.[0-9]*)?"
_BETWEEN = r"[\s,;:=()\"']*"
_LETTER = re.compile(rf"{_BETWEEN}([A-Za-z])(?![A-Za-z])")
_LINE = re.compile(rf"{_BETWEEN}([A-Za-z])((?:{_BETWEEN}{_NUMBER})*){_BETWEEN}(?:\\[rn])*")


def hint_for(line: bytes) -> str:
    r"""Return how a command is written that was refused; empty if it is like none.

    Example:
        >>> hint_for(b"d,0,0"), hint_for(b"D 5.0 -5.0"), hint_for(b"D,5")
        ("Did you mean 'D,0,0'?", "Did you mean 'D,5,-5'?", "It is written 'D,left,right'.")
        >>> hint_for(b"D,five,5"), hint_for(b"forward")
        ("It is written 'D,left,right'.", '')
    """
    text = line.decode("latin-1")
    found = _LINE.fullmatch(text) or _LETTER.match(text)
    if found is None or (letter := found[1].upper()) not in _PARAMETERS:
        return ""
    numbers = [str(round(float(each))) for each in re.findall(_NUMBER, text)]
    is_whole = found.re is _LINE and len(numbers) == len(_PARAMETERS[letter])
    written = ",".join([letter, *(numbers if is_whole else _PARAMETERS[letter])])
    return f"Did you mean {written!r}?" if is_whole else f"It is written {written!r}."

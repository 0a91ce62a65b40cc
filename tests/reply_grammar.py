"""Which reply the protocol allows to which line: an oracle that knows khepera-protocol.md and nothing of the firmware.

Method: for each command letter and tool a list of pairs of regular expressions, request and reply; the first request
that matches the whole rest of the line decides. What no pair matches is a protocol error for a letter and unknown for
anything else. The robot has all quirks off and all turrets of `tests.session_player.TURRETS`.
"""

import re

END = rb"\r\n"
TEXT = rb"[ -~]+" + END

UNKNOWN = re.compile(rb"Command not found\r\n")
PROTOCOL_ERROR = re.compile(rb"z,Protocol error\r\n")
NO_TURRET = re.compile(rb"z,Turret order not supported\r\n")

LINE_LIMIT = 256


def at_most(limit: int) -> bytes:
    """Return an expression for the decimal numbers from 0 to a limit, without leading zeros."""
    digits = str(limit)
    choices = ["0"]
    for place, digit in enumerate(digits):
        left = len(digits) - place - 1
        first = 1 if place == 0 else 0
        if place == 0 and left:
            choices.append(f"[1-9][0-9]{{0,{left - 1}}}")
        if int(digit) > first:
            choices.append(f"{digits[:place]}[{first}-{int(digit) - 1}][0-9]{{{left}}}")
    return f"(?:{'|'.join([*choices, digits])})".encode()


def signed(limit: int) -> bytes:
    """Return an expression for a number of a reply from -limit to limit; zero has no sign."""
    return rb"(?:-(?!0))?" + at_most(limit)


def within(limit: int) -> bytes:
    """Return an expression for a number of a request from 0 to a limit, in any spelling that the robot accepts."""
    return rb"[ \t]*(?:\+?0*" + at_most(limit) + rb"|-0+)[ \t]*"


def values(expression: bytes, count: int) -> bytes:
    """Return an expression for this many numbers, a comma before each."""
    return b"(?:," + expression + b"){%d}" % count


NUMBER = rb"[ \t]*[+-]?[0-9]+[ \t]*"
NATURAL = rb"[ \t]*(?:\+?[0-9]+|-0+)[ \t]*"
COUNTER = rb"(?:" + signed(2**31 - 1) + rb"|-2147483648)"
SPEED = signed(1000)
COUNTS = at_most(1023)
ANY = rb"(?:,.*)?"

Pairs = list[tuple[re.Pattern[bytes], re.Pattern[bytes]]]


def _pairs(*pairs: tuple[bytes, bytes]) -> Pairs:
    return [(re.compile(request, re.DOTALL), re.compile(reply + END)) for request, reply in pairs]


STATUS = b"," + at_most(1) + b"," + at_most(2) + rb"," + signed(2**31 - 1)

LETTERS: dict[bytes, Pairs] = {
    b"A": _pairs((values(NATURAL, 3), b"a")),
    b"B": _pairs((ANY, rb"b,[0-9]\.[0-9]{2},[0-9]\.[0-9]{2}")),
    b"C": _pairs((values(NUMBER, 2), b"c")),
    b"D": _pairs((values(NUMBER, 2), b"d")),
    b"E": _pairs((ANY, b"e" + values(SPEED, 2))),
    b"F": _pairs((values(NATURAL, 3), b"f")),
    b"G": _pairs((values(NUMBER, 2), b"g")),
    b"H": _pairs((ANY, b"h" + values(COUNTER, 2))),
    b"I": _pairs((b"," + within(6), b"i," + COUNTS)),
    b"J": _pairs((values(NUMBER, 4), b"j")),
    b"K": _pairs((ANY, b"k" + STATUS + STATUS)),
    b"L": _pairs((b"," + within(1) + b"," + within(2), b"l")),
    b"N": _pairs((ANY, b"n" + values(COUNTS, 8))),
    b"O": _pairs((ANY, b"o" + values(COUNTS, 8))),
    b"P": _pairs((values(NUMBER, 2), b"p")),
    b"R": _pairs((b"," + within(63), b"r," + at_most(255))),
    b"T": [],
    b"W": _pairs((b"," + NUMBER + b"," + within(63), b"w")),
}

BYTE = at_most(255)
BITS = at_most(7)
LEVEL = at_most(255) + b"," + BYTE
PLACE = b"," + at_most(999)
ENERGY = b"," + at_most(100) + b"," + at_most(35) + b"," + at_most(9)

ORDERS: dict[int, dict[bytes, tuple[bytes, bytes]]] = {
    1: {
        b"D": (b"," + within(1), b""),
        b"E": (values(NUMBER, 1), b""),
        b"F": (b"", b"," + BYTE),
        b"G": (b"", b"," + BYTE),
        b"H": (b"," + within(1), b"," + BYTE),
        b"J": (b"", b",0"),
    },
    2: {
        b"L": (b"", b"," + LEVEL),
        b"M": (b"", values(BYTE, 32)),
        b"N": (b"", values(BYTE, 64)),
        b"O": (b"", b"," + at_most(63)),
        b"P": (b"", b"," + at_most(63)),
        b"Q": (values(NUMBER, 1), values(BYTE, 8)),
        b"R": (values(NUMBER, 1), values(BYTE, 16)),
        b"S": (b"", values(BYTE, 32)),
        b"T": (b"", values(BYTE, 16)),
        b"U": (b"," + within(7), b""),
    },
    4: {
        b"F": (b"", b"," + BITS),
        b"R": (b"", values(BYTE, 18)),
        b"S": (values(NUMBER, 1) + b"," + within(16) + values(NUMBER, 16), b""),
    },
    99: {
        b"F": (b"", b",-1,(?:-1|" + at_most(9999) + b")"),
        b"S": (b"", PLACE + PLACE + b"," + at_most(359) + b"," + at_most(9999) + ENERGY),
    },
}
"""For each turret and order the numbers that it takes and the values of its answer."""

for turret, orders in ORDERS.items():
    head = rb",[ \t]*\+?0*%d[ \t]*,[ \t]*" % turret
    LETTERS[b"T"] += _pairs((head + rb"B[ \t]*(?:," + NUMBER + rb")*", b"t,%d,b,1,0" % turret))
    for order, (taken, answer) in orders.items():
        LETTERS[b"T"] += _pairs((head + order + rb"[ \t]*" + taken, b"t,%d,%s" % (turret, order.lower()) + answer))
    LETTERS[b"T"].append((re.compile(head + rb"[A-Z][ \t]*(?:," + NUMBER + rb")*"), PROTOCOL_ERROR))
LETTERS[b"T"].append((re.compile(b"," + NUMBER + rb",[ \t]*[A-Z][ \t]*(?:," + NUMBER + rb")*"), NO_TURRET))

LOADER = rb"S format Motorola loader mode\r\nS: [ -~]*download terminated"


def _tools(has_flash: bool) -> dict[bytes, Pairs]:
    def lines(count: int) -> bytes:
        return b"(?:" + TEXT + b"){%d}" % (count - 1) + rb"[ -~]+"

    count = 11 if has_flash else 10
    tools = {
        b"help": _pairs((b"", lines(count)), (b".+", lines(1))),
        b"list": _pairs((b".*", lines(1 + len(LETTERS) + count + 2))),
        b"net": _pairs((b".*", lines(len(ORDERS)))),
        b"process": _pairs((b".*", rb"Process 0\. [0-9]{8}  [ -~]+(?:\r\nProcess [1-9]\. [0-9]{8}  [ -~]+){3,4}")),
        b"memory": _pairs((b".*", rb"ROM .*used [0-9]{2}%\r\nRAM 1 .*used [0-9]{2}%\r\nRAM 2 .*used [0-9]{2}%")),
        b"k-team": _pairs((b".*", lines(1))),
        b"serial": _pairs(
            (rb"[ \t]+(9600|19200|38400|57600|115200)", rb"Line at [0-9]{4,6} baud"), (b".*", rb"serial: one of [ -~]+")
        ),
        b"restart": _pairs((b".*", rb"[ -~]+\r\nROM of minirobot [ -~]+\r\nSerial Communication Protocol")),
        b"run": _pairs(
            (rb"[ \t]+demo", rb"Demonstration[ -~]+"),
            (rb"[ \t]+sloader", LOADER),
            (rb"[ \t]+user-flash", rb"No user application in flash"),
            (b".*", rb"run: one of [ -~]+"),
        ),
        b"sfill": _pairs((b".*", LOADER)),
        b"flash": _pairs((rb"[ \t]+[EW]", rb"Flash (?:erased|written)"), (b".*", rb"flash: E or W")),
    }
    if not has_flash:
        del tools[b"flash"]
    return tools


_TOOLS = {has_flash: _tools(has_flash) for has_flash in (False, True)}
_TOOL_LINE = re.compile(rb"[ \t]*([a-z-]+)((?:[ \t].*)?)", re.DOTALL)


def allowed(line: bytes, *, has_flash: bool) -> re.Pattern[bytes]:
    """Return the expression that the reply to a line must match.

    Args:
        line: A line without its end, not empty.
        has_flash: Whether the robot is a Khepera II.
    """
    if len(line) > LINE_LIMIT:
        return UNKNOWN
    letter = line[:1]
    if letter in LETTERS and line[1:2] in (b"", b","):
        rest = line[1:]
        for request, reply in LETTERS[letter]:
            if request.fullmatch(rest):
                return reply
        return PROTOCOL_ERROR
    match = _TOOL_LINE.fullmatch(line)
    if match and match[1] in _TOOLS[has_flash]:
        rest = match[2].rstrip(b" \t")
        for request, reply in _TOOLS[has_flash][match[1]]:
            if request.fullmatch(rest):
                return reply
    return UNKNOWN


def first_violation(lines: list[bytes], output: bytes, *, has_flash: bool) -> str | None:
    """Return what is wrong with the replies to some lines, None if nothing is.

    Args:
        lines: What was sent, empty lines included.
        output: Everything that was answered.
        has_flash: Whether the robot is a Khepera II.
    """
    place = 0
    for line in filter(None, lines):
        expected = allowed(line, has_flash=has_flash)
        match = expected.match(output, place)
        if match is None:
            return f"{line!r} must be answered by {expected.pattern!r}, but it was {output[place : place + 80]!r}"
        place = match.end()
    return f"nothing more must be answered, but there was {output[place : place + 80]!r}" if output[place:] else None

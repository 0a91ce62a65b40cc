"""Which replies the e-puck's protocol allows to some characters: an oracle that knows nothing of the firmware.

Method: it reads the characters as epuck-protocol.md 3 has it, one at a time, and writes down for each answer an
expression that it must match; what the notes leave open is open in the expression. Of the robot it remembers what
decides about lengths: the settings of the camera.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

NEWER = {"AS12", "AS20"}
OLDER = {"BT11", "BT20"}

INT = rb"-?\d{1,5}"
LONG = rb"-?\d{1,10}"
COUNTS = rb"(?:0|[1-9]\d{0,3})"  # 0 to 9999
SIGNED = rb"(?:0|-?[1-9]\d{0,3})"
END = rb"\r\n"
TEXT = rb"[\t -~]+"
START = rb"\x0c\x07WELCOME to the SerCom protocol on e-Puck\r\nthe EPFL education robot type \"H\" for help\r\n"
UNKNOWN = rb"z,Command not found\r\n"
ARGUMENTS = re.compile(rb",[ \t\x0b\x0c]*([+-]?\d+)")

VERSIONS = {
    "BT11": rb"v,Version 1\.1\.3 September 2006\r\n",
    "BT20": rb"v,Version 2\.0\.0 January 2008\r\n",
    "AS12": rb"v,Version 1\.2\.2 August 2008 GCtronic\r\nHW version: [0-9A-F]+\r\n",
    "AS20": rb"v,Version 2\.0 January 2018 GCtronic\r\nHW version: [0-9A-F]+\r\n",
    "WF15": rb"v,Version 1\.5\.3 November 2016 \(Webots\)\r\nHW version: [0-9A-F]+\r\n",
}
LINE_FEEDS = {"BT11": 23, "BT20": 23, "AS12": 28, "AS20": 28, "WF15": 22}
PICTURES = {"BT11": 65_536, "BT20": 65_536, "AS12": 3456, "AS20": 4136, "WF15": 2028}
"""Sizes of the largest pictures; those of the first two, which have no limit, are KiKS's."""


def numbers(letter: bytes, count: int, one: bytes) -> bytes:
    return letter + (b"," + one) * count + END


def without_arguments(version: str) -> dict[bytes, bytes]:
    """Return for each letter whose answer depends on nothing what it must match."""
    is_new = version in NEWER
    floor = 5 if is_new else 3
    proximity = COUNTS if version in NEWER | {"BT20"} else SIGNED
    counter = LONG if version == "AS20" else INT
    table = {
        b"A": numbers(b"a", 3, SIGNED),
        b"B": b"b" + END,
        b"C": rb"c,(?:\d|1[0-5])\r\n",
        b"D": b"d" + END,
        b"E": numbers(b"e", 2, counter),
        b"F": b"f" + END,
        b"G": rb"g IR check : 0x[0-9a-f]+, address : 0x[0-9a-f]+, data : 0x[0-9a-f]+\r\n",
        b"H": rb"\n(?:\"[A-Zbgt](?:,#)*\"" + TEXT + END + b"){%d}" % (LINE_FEEDS[version] - 1),
        b"K": rb"k, Starting calibration - Remove any object in sensors range\r\nk, Calibration finished\r\n",
        b"L": b"l" + END,
        b"M": numbers(b"m", floor, COUNTS),
        b"N": numbers(b"n", 8, proximity),
        b"O": numbers(b"o", 8, COUNTS),
        b"P": b"p" + END,
        b"Q": numbers(b"q", 2, counter),
        b"R": rb"r\r" + rb"Selector pos (?:\d|1[0-5])\r\n" * (version == "AS12") + START,
        b"S": b"s" + END,
        b"U": numbers(b"u", 3, COUNTS),
        b"V": VERSIONS[version],
    }
    if version == "AS20":
        table[b"R"] = b""
    if version != "WF15":
        table[b"T"] = b"t" + END
    if is_new:
        table |= {b"b": rb"b,\d+ \(\d+%\)\r\n", b"g": numbers(b"g", 3, INT), b"W": b"w" + END}
        table |= {b"Y": rb"y,-?\d+,-?\d+\r\ny,-?\d+\r\n", b"Z": rb"(?:\d+: \d+\r\n)*"}
    if version in ("BT20", "WF15"):
        table |= {b"W": b"", b"X": rb"x,1*\r\n"}
    return table


def requests(version: str) -> dict[int, tuple[int, int | None]]:
    """Return for each byte of a request how many follow it and the length of its answer; None for pictures."""
    is_new = version in NEWER
    table: dict[int, tuple[int, int | None]] = {
        -ord("a"): (0, 6),
        -ord("A"): (0, 12),
        -ord("D"): (4, 0),
        -ord("E"): (0, 4),
        -ord("I"): (0, None),
        -ord("L"): (2, 0),
        -ord("M"): (0, {"AS12": 10, "AS20": 8}.get(version, 6)),
        -ord("N"): (0, 16),
        -ord("O"): (0, 16),
        -ord("Q"): (0, 4),
        -ord("u"): (0, 6),
    }
    if version not in OLDER:
        table[-ord("P")] = (4, 0)
    if version != "AS20":
        table[-ord("U")] = (0, 601)
    if is_new:
        table |= {-ord("b"): (0, 2), -ord("g"): (0, 6), -ord("t"): (0, 1), -ord("W"): (3, 0), -ord("w"): (35, 0)}
    if version == "AS20":
        table |= {-ord("Y"): (2, 1), -8: (0, 103), -9: (19, 0), -10: (12, 0), -11: (0, 1), -12: (0, 8), -13: (0, 2)}
        table |= {-14: (0, 1), -15: (1, 1), -16: (1, 1), -17: (1, 1)}
    return {256 + letter: entry for letter, entry in table.items()}


@dataclass
class Oracle:
    """The replies that one version of the program may give.

    Args:
        version: Its name.

    Attributes:
        counts: How often each letter and byte was met.
    """

    version: str
    counts: dict[object, int] = field(default_factory=dict)
    camera: list[int] = field(default_factory=lambda: [1, 40, 40, 8])

    def expected(self, data: bytes) -> Iterator[tuple[bytes, bytes]]:
        """Return what is asked and what its answer must match, from the first character to the last."""
        letters, table = without_arguments(self.version), requests(self.version)
        longest = max(count for count, _ in table.values())
        place = 0
        while place < len(data):
            if data[place] == 0:
                place += 1
            elif data[place] < 0x80:
                while place < len(data) and data[place] in b"\r\n":
                    place += 1
                ends = [end for end in (data.find(b"\r", place), data.find(b"\n", place)) if end >= 0]
                if place >= len(data) or not ends:
                    return
                line, place = data[place : min(ends)], min(ends) + 1
                yield line, self.line(line[:256], letters)
            else:
                begin, lengths, kept = place, [], 0
                is_first_question_past = False
                while place < len(data) and data[place] != 0:
                    letter = data[place]
                    place += 1
                    if letter not in table:
                        continue
                    count, length = table[letter]
                    self.count(letter)
                    if place + count > len(data):
                        return
                    place += count
                    is_first_question_past |= length != 0
                    # KiKS drops what is asked beyond 256 bytes less the longest letter.
                    kept += (1 + count) * is_first_question_past
                    if kept > 255 - longest:
                        kept -= 1 + count
                        continue
                    lengths.append(self.picture() if length is None else length)
                if place >= len(data):
                    return
                place += 1
                yield data[begin:place], self.block(lengths)

    def count(self, letter: object) -> None:
        self.counts[letter] = self.counts.get(letter, 0) + 1

    def line(self, line: bytes, letters: dict[bytes, bytes]) -> bytes:
        letter = line[:1]
        letter = letter if letter in (b"b", b"g") and self.version in NEWER else letter.upper()
        if letter == b"I":
            self.count(letter)
            return b"i,%d,%d,%d,%d,%d\r\n" % (*self.camera, self.size(*self.camera[:3]))
        if letter == b"J":
            self.count(letter)
            self.set_camera(line)
            return b"j" + END
        if letter in letters:
            self.count(letter)
            if letter == b"R" and self.version != "AS20":
                self.camera = [1, 40, 40, 8]
            return letters[letter]
        self.count("unknown")
        return UNKNOWN

    def block(self, lengths: list[int]) -> bytes:
        # An answer that would begin beyond 64 KiB is left out.
        sum_ = at_once = 0
        for length in lengths:
            if sum_ < 65_536:
                here = 600 if length == 601 else 0
                at_once += here
                sum_ += length - here
        return rb"[\x00-\xff]{%d}" % (sum_ + at_once)

    def picture(self) -> int:
        return 3 + self.size(*self.camera[:3])

    @staticmethod
    def size(mode: int, width: int, height: int) -> int:
        return width * height * (1 if mode == 0 else 2)

    def set_camera(self, line: bytes) -> None:
        asked, place = list(self.camera), 1
        for index in range(4):
            match = ARGUMENTS.match(line, place)
            if match is None:
                break
            asked[index] = (int(match[1]) + 2**15) % 2**16 - 2**15
            place = match.end()
        mode, width, height, zoom = asked
        fits = zoom > 0 and 0 < width * zoom <= 640 and 0 < height * zoom <= 480
        if not fits or self.size(mode, width, height) > PICTURES[self.version]:
            width, height = (52, 39) if self.version == "WF15" else (40, 40)
            asked = [1, width, height, zoom if 0 < zoom <= 12 else 8]
        self.camera = asked


def first_violation(version: str, data: bytes, output: bytes, oracle: Oracle | None = None) -> str | None:
    """Return what is wrong with the replies to some characters, None if nothing is."""
    place = 0
    for asked, pattern in (oracle or Oracle(version)).expected(data):
        match = re.compile(pattern).match(output, place)
        if match is None:
            found = output[place : place + 80]
            return f"{version}: {asked[:80]!r} must be answered by {pattern[:80]!r}, but it was {found!r}"
        place = match.end()
    rest = output[place : place + 80]
    return f"{version}: nothing more must be answered, but there was {rest!r}" if rest else None

"""The versions of the e-puck's program, and how they differ beyond their commands (epuck-protocol.md 4 and 5)."""

from __future__ import annotations

from dataclasses import dataclass

EVERY = "12ABW"
"""The letters of all personalities, as the tables of commands and requests have them."""


@dataclass(frozen=True)
class Personality:
    """What one version of the program does otherwise than another.

    Attributes:
        letter: Its letter in the tables.
        version: What `V` answers.
        int_bits: Size of an `int`: 16 on the first e-puck, 32 on the second.
        cased: Lower-case letters that are commands of their own.
        acceleration_zero: What an axis at rest reads [counts]; `raw_acceleration_zero` is that of -'a'.
        raw_acceleration_zero: As above.
        floor_count: Number of floor readings of `M`; `floor_words` is that of -'M'.
        floor_words: As above.
        clamps_proximity: Whether a reading below its zero is 0; else it is negative.
        calibrates_requests: Whether the zero is taken off in -'N', too.
        begins_calibrated: Whether a start measures the zeros, and not only `K`.
        shows_calibration: Whether the ring of LEDs is on meanwhile.
        requests_name_body: Whether the LEDs 8 and 9 of -'L' are those of body and front; else they are the whole ring.
        picture_bytes: The largest picture; a larger one becomes one of `picture_size`.
        picture_size: Width and height of that one.
        places_picture: Whether `J` takes the corner of the picture.
        stop_clears_all: Whether `S` clears the speeds of `E` and the LEDs of body and front, too.
        resets: Whether `R` does anything.
        tells_selector: Whether the start text begins with the selector.
        battery_counts: A full battery (4.2 V).
        temperature_c: What -'t' answers.
        help_column: Where the texts of `H` begin, from 0.
    """

    letter: str
    version: str
    int_bits: int
    cased: bytes
    acceleration_zero: int
    raw_acceleration_zero: int
    floor_count: int
    floor_words: int
    clamps_proximity: bool
    calibrates_requests: bool
    begins_calibrated: bool
    shows_calibration: bool
    requests_name_body: bool
    picture_bytes: int
    picture_size: tuple[int, int]
    places_picture: bool
    stop_clears_all: bool
    resets: bool
    tells_selector: bool
    battery_counts: int
    temperature_c: int
    help_column: int


BUFFER_BYTES = 65_536
"""Where a picture of the versions that check no size ends, and a block of answers [?]: real ones overrun a buffer."""

_NAMES = ("BT11", "BT20", "AS12", "AS20", "WF15")

_VERSIONS = (
    "Version 1.1.3 September 2006",
    "Version 2.0.0 January 2008",
    "Version 1.2.2 August 2008 GCtronic\r\nHW version: FFFF",
    "Version 2.0 January 2018 GCtronic\r\nHW version: FFFF",
    "Version 1.5.3 November 2016 (Webots)\r\nHW version: FFFF",
)

# fmt: off
_TABLE = {
    "letter":                ("1",     "2",     "A",     "B",     "W"),
    "version":               _VERSIONS,
    "int_bits":              (16,      16,      16,      32,      16),
    "cased":                 (b"",     b"",     b"bg",   b"bg",   b""),
    "acceleration_zero":     (0,       0,       2048,    2048,    0),
    "raw_acceleration_zero": (0,       0,       2048,    2048,    2048),
    "floor_count":           (3,       3,       5,       5,       3),
    "floor_words":           (3,       3,       5,       4,       3),
    "clamps_proximity":      (False,   True,    True,    True,    False),
    "calibrates_requests":   (False,   True,    True,    True,    False),
    "begins_calibrated":     (False,   True,    False,   False,   False),
    "shows_calibration":     (True,    False,   True,    True,    True),
    "requests_name_body":    (False,   True,    True,    True,    True),
    "picture_bytes":         (BUFFER_BYTES, BUFFER_BYTES, 3456, 4136, 2028),
    "picture_size":          ((40, 40), (40, 40), (40, 40), (40, 40), (52, 39)),
    "places_picture":        (False,   False,   True,    True,    True),
    "stop_clears_all":       (False,   False,   False,   False,   True),
    "resets":                (True,    True,    True,    False,   True),
    "tells_selector":        (False,   False,   True,    False,   False),
    "battery_counts":        (2560,    2560,    2560,    3441,    2560),  # AS20: epuck2-wifi.md 4
    "temperature_c":         (25,      25,      25,      0,       25),
    "help_column":           (12,      12,      18,      18,      18),
}
# fmt: on

PERSONALITIES = {
    name: Personality(**dict(zip(_TABLE, column, strict=True)))
    for name, column in zip(_NAMES, zip(*_TABLE.values(), strict=True), strict=True)
}
"""By the name that a robot's file gives as `protocol_version`.

The sources leave open, and we chose: hardware 1.3 with floor sensors, without a gyroscope, 25 degrees, a full battery.
"""

"""The radio, turret 4: messages of at most 16 bytes from robot to robot (khepera-protocol.md 10.4).

Source: the same section and kiks-behaviour.md 1.6: half-duplex, acknowledged, repeated a limited number of times, then
lost; a message carries type, sender, destination, length and check sum. A radio's number is that of its robot, from 1.
The notes leave open, and we chose:

* 9600 bit/s on the air, the speed of the serial line, with 11 bits a character;
* six attempts, with pauses between them that are drawn, so that two who speak at once do not stay in step;
* a radio holds one message until it is read: what comes before that is not acknowledged, hence repeated, hence lost
  when the program does not read in time;
* a radio that sends does not hear; radios that talk to others do not disturb;
* a message handed over while another is on its way is dropped: a program asks F for bit 0 first.

Method: what is on the air is only a time at which the attempt under way ends. `deliver` does all that are over, in the
order of their times, whenever the simulation looks; so it makes no difference how often that is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from kiks.firmware.turret import Orders, Shape, Site, Turret, Values
from kiks.units import character_ns

DATA_LIMIT = 16
"""Bytes of a message (khepera-protocol.md 10.4)."""

FRAME_CHARACTERS = 5
"""Characters of a message besides its data, and of an acknowledgement: type, sender, destination, length, check sum."""

BAUD = 9600
"""Speed on the air [bit/s]."""

ATTEMPTS = 6
"""How often a message is sent until it is acknowledged."""

PAUSE_FRAMES = 8
"""Longest pause between two attempts, in frames without data."""

READY, RECEIVED, FAILED = 1, 2, 4
"""Bits of the status (kiks-behaviour.md 1.6)."""


def attempt_ns(length: int) -> int:
    """Return how long a message of this many bytes and its acknowledgement take [ns]."""
    return (2 * FRAME_CHARACTERS + length) * character_ns(BAUD)


def _read_status(radio: Radio) -> Values:
    """F: the status: 1 ready to send, 2 message received, 4 the last one sent was lost."""
    record = radio.site.record
    ready = READY if record["radio_attempt"] == 0 else 0
    received = RECEIVED if record["radio_from"] else 0
    return (ready | received | (FAILED if record["radio_has_failed"] else 0),)


def _read_message(radio: Radio) -> Values:
    """R: the message: sender, length and 16 bytes, which makes room for the next one; 18 times 0 if there is none."""
    record = radio.site.record
    message = (int(record["radio_from"]), int(record["radio_from_length"]), *map(int, record["radio_from_data"]))
    record["radio_from"] = record["radio_from_length"] = record["radio_from_data"] = 0
    return message


def _send(radio: Radio, to: int, length: int, *data: int) -> Values | None:
    """S: send some of 16 bytes to a robot: its number, how many, and the bytes, of which the low 8 bits count."""
    if not 0 <= length <= DATA_LIMIT:
        return None
    record = radio.site.record
    if record["radio_attempt"] == 0:
        # Beyond 31 bits there is no robot either.
        record["radio_to"], record["radio_to_length"] = min(max(to, -1), 2**31 - 1), length
        record["radio_to_data"] = [byte & 0xFF for byte in data[:length]] + [0] * (DATA_LIMIT - length)
        record["radio_has_failed"] = 0
        radio.begin(radio.site.time_ns, 1)
    return ()


class Radio(Turret):
    """A radio on a robot."""

    number = 4
    name = "Radio"
    orders: ClassVar[Orders] = {"F": (0, _read_status), "R": (0, _read_message), "S": (2 + DATA_LIMIT, _send)}

    def fit(self, site: Site) -> None:
        """Fit the radio to a robot."""
        super().fit(site)
        self.reset()

    def reset(self) -> None:
        """Drop the message on its way and the received one."""
        record = self.site.record
        for name in ("attempt", "has_failed", "to", "to_length", "to_data", "from", "from_length", "from_data"):
            record[f"radio_{name}"] = 0
        record["radio_ended_ns"] = -1

    def begin(self, time_ns: int, attempt: int) -> None:
        """Begin to send at a time [ns]."""
        record = self.site.record
        record["radio_attempt"], record["radio_starts_ns"] = attempt, time_ns
        record["radio_ends_ns"] = time_ns + attempt_ns(int(record["radio_to_length"]))

    def end(self, receiver: Radio | None) -> None:
        """End the attempt under way: hand the message over, try again later, or give up."""
        record = self.site.record
        ends_ns, attempt = int(record["radio_ends_ns"]), int(record["radio_attempt"])
        record["radio_ended_ns"] = ends_ns
        record["radio_attempt"] = 0
        if receiver is not None and receiver is not self and receiver.hears(int(record["radio_starts_ns"]), ends_ns):
            there = receiver.site.record
            there["radio_from"], there["radio_from_length"] = self.site.robot, record["radio_to_length"]
            there["radio_from_data"] = record["radio_to_data"]
        elif attempt < ATTEMPTS:
            longest_ns = PAUSE_FRAMES * FRAME_CHARACTERS * character_ns(BAUD)
            self.begin(ends_ns + int(longest_ns * self.site.random(time_ns=ends_ns)), attempt + 1)
        else:
            record["radio_has_failed"] = 1

    def hears(self, begin_ns: int, end_ns: int) -> bool:
        """Return whether a message that was on the air for this time is received: there is room, and it was silent."""
        record = self.site.record
        has_spoken = int(record["radio_ended_ns"]) > begin_ns
        is_speaking = record["radio_attempt"] != 0 and int(record["radio_starts_ns"]) < end_ns
        return not (record["radio_from"] or has_spoken or is_speaking)

    def status(self) -> str:
        """Return what it sends and what waits to be read."""
        record = self.site.record
        if attempt := int(record["radio_attempt"]):
            text = f"sends to robot {record['radio_to']}, attempt {attempt} of {ATTEMPTS}"
        elif record["radio_has_failed"]:
            text = f"its last message, to robot {record['radio_to']}, was lost"
        else:
            text = "silent"
        if sender := int(record["radio_from"]):
            data = " ".join(map(str, record["radio_from_data"][: int(record["radio_from_length"])].tolist()))
            text += f"; a message from robot {sender} waits to be read: {data or 'empty'}"
        return text

    def shapes(self) -> Sequence[Shape]:
        """Return an aerial, red while a message is on its way."""
        return (Shape(((-15.0, 15.0),), "#e03020" if self.site.record["radio_attempt"] else "#303030", 3.0),)


def deliver(radios: Mapping[int, Radio], now_ns: int) -> None:
    """End the attempts of all radios that end up to a time [ns], those of lower numbers first at the same instant."""
    while True:
        due = [
            (int(radio.site.record["radio_ends_ns"]), robot)
            for robot, radio in radios.items()
            if radio.site.record["radio_attempt"] != 0
        ]
        if not due or min(due)[0] > now_ns:
            return
        sender = radios[min(due)[1]]
        sender.end(radios.get(int(sender.site.record["radio_to"])))

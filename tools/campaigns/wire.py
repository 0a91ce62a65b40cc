"""Random lines and random bytes for the robot's own program; every reply is compared with the protocol.

Most go straight into `Receiver` and `Firmware`, every tenth case through a port, the line and the clock. The oracle is
`tests/reply_grammar.py`.
"""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from functools import partial

from tests.reply_grammar import first_violation
from tests.session_player import TURRETS
from tools.campaigns.runner import Broken, Campaign, Play

from kiks.model.arena import Arena
from kiks.sim.simulation import Simulation

LINE_BYTES, RANDOM_BYTES = 40_000_000, 60_000_000
"""How many bytes are sent, of lines that are nearly right and of chance alone."""

BYTES_PER_CASE = 100_000

COUNTS = {"A": 3, "C": 2, "D": 2, "F": 3, "G": 2, "I": 1, "J": 4, "L": 2, "P": 2, "R": 1, "W": 2}
"""How many numbers a command takes; the others take none."""

WORDS = (
    "help", "help N", "help T", "list", "net", "process", "memory", "k-team", "serial 115200", "serial", "restart",
    "run demo", "run", "run sloader", "run user-flash", "sfill", "flash E", "flash", " ", "M", "n", "", "",
)  # fmt: skip

NUMBERS = (
    "0", "1", "2", "5", "-5", "10", "63", "64", "-1", "127", "-128", "255", "1000", "32767", "32768", "8388606",
    "2147483647", "-2147483648", "4294967296", "9" * 40, "-" + "9" * 200, "-0", "+5", "007", "--5", "5.0", "", " 7 ",
)  # fmt: skip

STRANGE = b",,,,+-- 0123456789.AGTNZaz\t\x00\x1c\xff\xb2;"


def random_line(rng: random.Random) -> bytes:
    """Return a line that is often right, often almost right and sometimes nonsense."""
    choice = rng.random()
    if choice < 0.08:
        line = rng.choice(WORDS).encode()
    elif choice < 0.2:
        turret, order = rng.choice(("1", "2", "2", "4", "-1", "")), rng.choice("BDEFGHJLMNOPQRSTUXb")
        numbers = rng.choices(NUMBERS[:12], k=rng.choice((0, 0, 1, 1, 2, 18)))
        line = ",".join(["T", turret, order, *numbers]).encode()
    else:
        letter = rng.choice("ABCDEFGHIJKLNOPRW")
        count = COUNTS.get(letter, 0)
        if rng.random() < 0.1:
            count = rng.randrange(6)
        kinds = NUMBERS[:6] if rng.random() < 0.5 else NUMBERS
        line = ",".join([letter, *rng.choices(kinds, k=count)]).encode()
    if rng.random() < 0.2:
        for _ in range(rng.randint(1, 3)):
            place = rng.randint(0, len(line))
            line = line[:place] + bytes(rng.choices(STRANGE, k=rng.randrange(3))) + line[place + rng.randrange(2) :]
    if rng.random() < 0.002:
        line = (line or b"N") * rng.randint(2, 120)
    return line


def random_lines(rng: random.Random) -> bytes:
    """Return lines with ends of all kinds."""
    lines, left = [], BYTES_PER_CASE
    while left > 0:
        lines.append(random_line(rng) + rng.choice((b"\n", b"\n", b"\r", b"\r\n")))
        left -= len(lines[-1])
    return b"".join(lines)


def random_bytes(rng: random.Random) -> bytes:
    """Return bytes of chance, the last of them a line end."""
    return rng.randbytes(BYTES_PER_CASE - 1) + b"\n"


def chunks(data: bytes, rng: random.Random) -> Iterator[bytes]:
    """Yield data in pieces of random lengths."""
    place = 0
    while place < len(data):
        end = place + rng.choice((1, 2, 3, 7, 20, 64, 300, 4096))
        yield data[place:end]
        place = end


def answer_directly(sim: Simulation, data: bytes, rng: random.Random) -> bytes:
    """Return what the program answers, while a millisecond passes with each piece."""
    firmware = sim.wires[0].firmware
    replies = []
    for piece in chunks(data, rng):
        sim.run(0.001)
        sim.sync()
        replies += [firmware.execute(line, sim.now_ns) for _, line in firmware.receiver.feed(piece)]
    return b"".join(replies)


def answer_on_wire(sim: Simulation, data: bytes, rng: random.Random) -> bytes:
    """Return what comes out of a port."""
    port = sim.port(1)
    port.timeout = 10.0
    output = bytearray()
    for piece in chunks(data, rng):
        port.write(piece)
        output += port.read(port.in_waiting)
    while reply := port.read(4096):
        output += reply
    return bytes(output)


def _prepare(make: partial[bytes]) -> Play:
    def play(rng: random.Random) -> int:
        sim = Simulation(Arena.box(500, 500), robot="khepera_ii", seed=rng.randrange(2**32))
        for turret in TURRETS:
            sim.fit(1, turret)
        answer = answer_on_wire if rng.random() < 0.1 else answer_directly
        data = make(rng)
        output = answer(sim, data, rng)
        lines = [line for line in re.split(rb"[\r\n]", data) if line]
        fault = first_violation(lines, output, has_flash=True)
        if fault is not None:
            raise Broken("foreign", fault[:200], "a reply that the protocol does not allow")
        return len(data)

    play(random.Random(0))
    return play


def campaigns() -> Iterator[Campaign]:
    """Yield one for lines and one for chance."""
    yield Campaign("wire.lines", LINE_BYTES // BYTES_PER_CASE, partial(_prepare, random_lines), limit_s=120.0)
    yield Campaign("wire.bytes", RANDOM_BYTES // BYTES_PER_CASE, partial(_prepare, random_bytes), limit_s=120.0)

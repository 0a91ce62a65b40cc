"""Push random lines and random bytes through the robot's program and compare every reply with the protocol.

Most go straight into `Receiver` and `Firmware`, every tenth batch through a port, the line and the clock. The oracle is
`tests/reply_grammar.py`. Exit code 1: a reply that the protocol does not allow, or one too many or too few.

    python benchmarks/fuzz.py --lines 1000000 --bytes 10000000 --seed 0
"""

from __future__ import annotations

import argparse
import random
import re
import resource
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from calibration import report
from tests.reply_grammar import allowed, first_violation, kind
from tests.session_player import TURRETS

from kiks.model.arena import Arena
from kiks.sim.simulation import Simulation

LINES_PER_BATCH = 5_000
BYTES_PER_BATCH = 250_000
BATCHES_PER_WIRE = 10

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


def line_batches(count: int, rng: random.Random) -> Iterator[bytes]:
    """Yield batches of lines with ends of all kinds, a count of lines in all."""
    for begin in range(0, count, LINES_PER_BATCH):
        size = min(LINES_PER_BATCH, count - begin)
        yield b"".join(random_line(rng) + rng.choice((b"\n", b"\n", b"\r", b"\r\n")) for _ in range(size))


def byte_batches(count: int, rng: random.Random) -> Iterator[bytes]:
    """Yield batches of random bytes, each ended by a line end, a count of bytes in all."""
    for begin in range(0, count, BYTES_PER_BATCH):
        yield rng.randbytes(min(BYTES_PER_BATCH, count - begin) - 1) + b"\n"


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


def peak_memory_mb() -> float:
    """Return the largest memory that this process has held so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def fuzz(name: str, batches: Iterator[bytes], rng: random.Random, *, as_json: bool) -> bool:
    """Push batches through one robot and report; say whether every reply was right."""
    sim = Simulation(Arena.box(500, 500), robot="khepera_ii", seed=rng.randrange(2**32))
    for turret in TURRETS:
        sim.fit(1, turret)
    counts: Counter[str] = Counter()
    robot_s, byte_count, warm_mb = 0.0, 0, 0.0
    for number, data in enumerate(batches):
        answer = answer_on_wire if number % BATCHES_PER_WIRE == 1 else answer_directly
        begin_s = time.perf_counter()
        output = answer(sim, data, rng)
        robot_s += time.perf_counter() - begin_s
        byte_count += len(data)
        lines = [line for line in re.split(rb"[\r\n]", data) if line]
        fault = first_violation(lines, output, has_flash=True)
        if fault is not None:
            print(f"{name}, batch {number}: {fault}", file=sys.stderr)
            return False
        counts.update(kind(allowed(line, has_flash=True)) for line in lines)
        if number == BATCHES_PER_WIRE + 1:
            warm_mb = peak_memory_mb()
    total = sum(counts.values())
    growth_mb = peak_memory_mb() - warm_mb if warm_mb else 0.0
    if as_json:
        rows = [("lines_per_s", total / robot_s, "1/s"), ("lines", total, "1"), ("memory_growth_mb", growth_mb, "MB")]
        report([(f"fuzz.{name}.{figure}", value, unit) for figure, value, unit in rows], as_json=True)
        return True
    print(f"{name}: {total:,} lines that are not empty, {byte_count:,} bytes, {sim.time_s:,.0f} s on the robot's clock")
    print(f"  {robot_s:.1f} s: {total / robot_s:,.0f} lines/s, {byte_count / robot_s / 1e6:.2f} MB/s")
    print("  replies:", ", ".join(f"{reply} {count:,}" for reply, count in counts.most_common()))
    if warm_mb:
        print(f"  peak memory {peak_memory_mb():.1f} MB, {growth_mb:.1f} MB more than after the first batches")
    return True


def main() -> int:
    """Run both kinds of fuzzing; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lines", type=int, default=1_000_000, help="random lines to send")
    parser.add_argument("--bytes", type=int, default=10_000_000, help="random bytes to send")
    parser.add_argument("--json", action="store_true", help="one JSON object a line")
    parser.add_argument("--seed", type=int, default=0, help="the same seed sends the same")
    options = parser.parse_args()
    rng = random.Random(options.seed)
    is_right = fuzz("lines", line_batches(options.lines, rng), rng, as_json=options.json)
    is_right = fuzz("bytes", byte_batches(options.bytes, rng), rng, as_json=options.json) and is_right
    return 0 if is_right else 1


if __name__ == "__main__":
    sys.exit(main())

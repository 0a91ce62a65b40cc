"""Messages of browsers to the desk and requests of Octave to a session, in this process, as their handlers get them."""

from __future__ import annotations

import asyncio
import json
import logging
import random
import tempfile
import threading
from collections.abc import Iterator
from contextlib import chdir, contextmanager
from dataclasses import fields
from typing import Any

from tools.campaigns.files import drive
from tools.campaigns.hostile import NUMBERS, OTHERS, mutated
from tools.campaigns.runner import SECRET, Broken, Campaign, Play, check_message, judge, place_of

import kiks
from kiks.desk.server.desk import Desk
from kiks.desk.server.gateway import Gateway, Viewer
from kiks.errors import ParameterError
from kiks.run import Run
from kiks.toolbox.preferences import Settings
from kiks.toolbox.requests import REQUESTS, answer
from kiks.toolbox.session import Session
from kiks.toolbox.session_client import SessionClient
from kiks.toolbox.wire_format import unescape

MESSAGES, REQUESTS_SENT = 50_000, 50_000
"""How many of both are sent."""

HEAD = 20
"""Sign, port and time come before what was asked for."""

PER_CASE = 8
"""How many of them a world gets, one after the other."""

PAUSE_MAX, PAUSE_ENDLESS = 5.0, 1e12
"""A pause between them is waited for, and rightly so [s]."""


def _json_value(rng: random.Random) -> str:
    """Return a hostile value as JSON has it, more or less."""
    choice = rng.random()
    if choice < 0.6:
        number = rng.choice(NUMBERS)
        return json.dumps(number) if abs(number) < 2**70 or number != number else "9" * 400
    if choice < 0.8:
        texts = [value for value in OTHERS if isinstance(value, str | None)]
        return json.dumps(rng.choice((*texts, True, [], {}, [[]], {"a": SECRET}, [SECRET] * 99)))
    return rng.choice(("[" * 100_000, "[" * 500 + "]" * 500, "1e400", "-1e400", "NaN", "null", "", '"\\ud800"', "0x10"))


def _message(rng: random.Random) -> str:
    """Return what a browser may send."""
    kind = rng.choice(("ack", "grab", "grab", "move", "move", "turn", "turn", "drop", SECRET, "x" * 9000))
    good = {
        "ack": {"count": "1"}, "grab": {"what": '"robot"', "index": "0"}, "move": {"x_mm": "150.0", "y_mm": "150.0"},
        "turn": {"heading_rad": "1.0"},
    }.get(kind, {})  # fmt: skip
    if kind == "grab" and rng.random() < 0.5:
        good["what"] = rng.choice(('"body"', '"lamp"', '"wall"'))
    for name in good:
        if rng.random() < (0.2 if kind == "grab" else 0.6):
            good[name] = _json_value(rng)
    if rng.random() < 0.1 and good:
        good.pop(rng.choice(list(good)))
    text = "{" + ", ".join(f'"{name}": {value}' for name, value in {"kind": json.dumps(kind), **good}.items()) + "}"
    if rng.random() < 0.1:
        return mutated(rng, text.encode()).decode("utf-8", errors="replace")
    return _json_value(rng) if rng.random() < 0.03 else text


def _prepare_desk() -> Play:
    logging.disable(logging.CRITICAL)
    drive(_desk().sim)

    def play(rng: random.Random) -> int:
        desk = _desk()
        gateway, viewer = Gateway(desk, 1), Viewer("browser 1")

        async def obey() -> None:
            for _ in range(PER_CASE):
                try:
                    await gateway._execute(viewer, _message(rng))
                    await gateway._pull(viewer)
                except kiks.KiksError as error:
                    check_message(error)

        asyncio.run(obey())
        gateway._look(desk.sim)
        judge(lambda: drive(desk.sim))
        asyncio.run(desk.drop("browser 1"))
        desk.close()
        return PER_CASE

    return play


def _desk() -> Desk:
    sim = kiks.Simulation(kiks.Arena.box(300, 300), robots=2, seed=1)
    sim.add_lamp(50.0, 50.0)
    sim.fit(1, "k213")
    return Desk(Run.in_world(sim, speed=None))


# ---- sessions ----


def _number_text(rng: random.Random) -> str:
    choice = rng.random()
    if choice < 0.7:
        number = rng.choice(NUMBERS)
        return str(number) if abs(number) < 2**70 or number != number else "9" * 400
    return rng.choice(
        ("NaN", "Inf", "-Inf", "1e400", "0x10", "1_0", "٣", "", SECRET, "x" * 5000, "-1", "1", "2", "\\n", "\0")
    )


def _matrix_text(rng: random.Random) -> str:
    """Return an arena as the toolbox sends it, or nearly."""
    rows, columns = rng.choice((120, 150, 200)), rng.choice((120, 160))
    runs, left = [], rows * columns
    while left > 0:
        count = min(rng.choice((1, rows, 7 * rows, 90 * rows)), left)
        runs.append(f"{count} {rng.choice(('0', '0', '0', '1', '1', '2', '3', '4', '-90', '-1e308'))}")
        left -= count
    words = f"{rows} {columns} {' '.join(runs)}".split(" ")
    for _ in range(rng.choice((0, 0, 1, 1, 2))):
        words[rng.randrange(len(words))] = _number_text(rng)
    return " ".join(words)


def _request(rng: random.Random) -> str:
    """Return what Octave may ask for."""
    name = rng.choice([*REQUESTS, "open", "open", "set_robot", "set_robot", "set_object", "spawn", "send", "nonsense"])
    port = rng.choice(("1", "1", "1", "2", _number_text(rng)))
    numbers = [
        _number_text(rng) if rng.random() < 0.5 else rng.choice(("1", "2", "100", "150", "0.5")) for _ in range(5)
    ]
    words = {
        "open": f"{port} {rng.choice(('9600', '9600', _number_text(rng)))}",
        "set": f"{rng.choice([each.name for each in fields(Settings)])} {_number_text(rng)}",
        "world": rng.choice(("default", f"matrix {_matrix_text(rng)}",
        f"matrix {_matrix_text(rng)} {_matrix_text(rng)}", f"file {_number_text(rng)}")),
        "send": f"{port} " + rng.choice(("N", "N\\n", "D,5,5\\n", _number_text(rng) + "\\n")),
        "ask": f"{port} {rng.choice(('N', 'T,2,N', _number_text(rng)))}",
        "pause": _pause_text(rng),
        "set_robot": f"{port} {' '.join(numbers[:3])}",
        "set_object": " ".join(["1" if rng.random() < 0.6 else numbers[0], *numbers[1:]]),
        "spawn": f"{rng.choice(('1', '2', '3', _number_text(rng)))} {' '.join(numbers[:2])}",
        "print": SECRET, "save": rng.choice(("a.kad", "a.kiks", "a.toml", "", "no/where.kiks", SECRET, "a.kad\\n")),
        "read": rng.choice(("nowhere.kad", "", SECRET, "/dev/null", "x" * 5000)),
    }.get(name, port)  # fmt: skip
    line = f"{name} {words}"
    if rng.random() < 0.1:
        line = mutated(rng, line.encode()).decode("utf-8", errors="replace")
    # What comes on a line has no end in it, and mutations must not make pauses that are rightly waited for.
    return (
        line.replace("\n", " ") if "pause" not in line or (name == "pause" and line == f"{name} {words}") else "time 1"
    )


def _pause_text(rng: random.Random) -> str:
    while True:
        text = _number_text(rng)
        try:
            seconds = float(text)
        except ValueError:
            return text
        if not PAUSE_MAX < seconds < PAUSE_ENDLESS:
            return text


class _Failures(logging.Handler):
    """Keeps what a session says of exceptions that it did not expect."""

    def __init__(self) -> None:
        super().__init__(logging.DEBUG)
        self.last: BaseException | None = None

    def emit(self, record: logging.LogRecord) -> None:
        """Keep it."""
        if record.exc_info:
            self.last = record.exc_info[1]


@contextmanager
def _running() -> Iterator[Session]:
    """Let a session's own thread go round."""
    session, is_over = Session(), threading.Event()

    def go_round() -> None:
        while not is_over.is_set():
            session.round()

    thread = threading.Thread(target=go_round, daemon=True)
    thread.start()
    try:
        yield session
    finally:
        is_over.set()
        session.let_go()
        thread.join()
        session.close()


def _prepare_session() -> Play:
    failures = _Failures()
    log = logging.getLogger("kiks.toolbox")
    log.handlers, log.propagate = [failures], False
    log.setLevel(logging.DEBUG)

    def play(rng: random.Random) -> int:
        # Requests may name files.
        with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder, chdir(folder), _running() as session:
            visitor = SessionClient(session, 1)
            lines = ["set thinking none", "world default", "open 1 9600", *(_request(rng) for _ in range(PER_CASE))]
            for line in lines:
                failures.last = None
                said = answer(visitor, line)
                _check_answer(line, said, failures.last)
            visitor.leave()
        return PER_CASE

    return play


def _check_answer(line: str, said: str, failure: Any) -> None:
    name = line.partition(" ")[0]
    if failure is not None:
        kind = type(failure).__name__
        raise Broken("foreign", f"{line[:80]!r}: {kind}: {str(failure)[:120]!r}", f"{kind}, {place_of(failure)}")
    if not said.startswith(("+", "-")) or "KiKS itself has failed" in said:
        raise Broken("foreign", f"{line[:80]!r} was answered by {said[:80]!r}", f"answer to {name[:20]}")
    if said[0] == "-":
        try:
            check_message(ParameterError(unescape(said[HEAD:])))
        except Broken as broken:
            raise Broken(
                "message", f"{line[:80]!r}: {broken}", f"{broken.where.partition(',')[0]}, request {name[:20]}"
            ) from None


def campaigns() -> Iterator[Campaign]:
    """Yield one for desks and one for sessions."""
    yield Campaign("messages.desk", MESSAGES // PER_CASE, _prepare_desk, memory_mb=6000)
    yield Campaign("messages.session", REQUESTS_SENT // PER_CASE, _prepare_session, memory_mb=6000)

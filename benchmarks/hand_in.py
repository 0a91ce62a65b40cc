"""What a class notices while some of it hand in programs that never end.

Run: python benchmarks/hand_in.py [--json] [--students 30] [--handing-in 6].

All students have the pages of their desks open, as in `room.py`, and some press *Hand in* at once, each with a program
that computes for ever. `hand_in.taken_s` is the longest time until one of them reads that it is handed in. Meanwhile
others load their pages again, and new ones come in: `hand_in.page_p95_s` is the time within which 95 % of the pages are
answered, `hand_in.newcomer_s` the longest time from the form with the name to the page of the desk.
`hand_in.page_before_p95_s` is that of pages before anybody hands in. `hand_in.end_s` is how long the room goes on after
SIGTERM.
"""

from __future__ import annotations

import argparse
import asyncio
import html
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from urllib.parse import urlencode

from room import CODE, READY_S, Person

from calibration import calibration_loops_per_s, report
from desk import address_in
from kiks.model.package import shipped

ENDLESS = "import serial\nserial.Serial('COM1', timeout=1).write(b'N\\n')\nwhile True:\n    pass\n"

PAGES, NEWCOMERS = 40, 5
"""How many pages are loaded, and how many students come in, while programs are tried."""


class Student(Person):
    """A browser with the page of a desk, which presses *Hand in*."""

    async def hand_in(self) -> float:
        """Press the button; return after how long the page says that it is handed in [s]."""
        elements = json.loads(html.unescape(re.search(r"parseElements\(String\.raw`(.*?)`\)", self.text, re.S)[1]))
        (button,) = (each for each in elements.items() if each[1].get("props", {}).get("data-testid") == "hand-in")
        (listener,) = (each["listener_id"] for each in button[1]["events"] if each["type"] == "click")
        click = {"id": int(button[0]), "client_id": self._page, "listener_id": listener, "args": ["{}"]}
        query = {"EIO": 4, "transport": "websocket", "client_id": self._page, "tab_id": self._page}
        query |= {"document_id": self._page, "next_message_id": 0, "implicit_handshake": "true"}
        async with self._socket(f"{self._place}/_nicegui_ws/socket.io/?{urlencode(query)}") as socket:
            await socket.send("40")
            while not (await socket.recv()).startswith("40"):
                pass
            begin_s = time.monotonic()
            await socket.send(f'42["event",{json.dumps(click)}]')
            async for message in socket:
                if message == "2":
                    await socket.send("3")
                if "Handed in. Now" in message:
                    return time.monotonic() - begin_s
        raise RuntimeError("the page has said nothing")


async def load_s(person: Person, home: str) -> float:
    """Return how long a page takes [s]."""
    begin_s = time.monotonic()
    await person.open(home)
    return time.monotonic() - begin_s


def p95(times_s: list[float]) -> float:
    """Return the time within which 95 % are."""
    return sorted(times_s)[int(0.95 * (len(times_s) - 1))]


async def measure(address: str, students: int, handing_in: int) -> list[tuple[str, float, str]]:
    """Let students come in and some hand in; return what the others notice."""
    people = [Student(address) for _ in range(students)]
    homes = [await person.enter(f"student {number}") for number, person in enumerate(people)]
    paths = [await person.open(home) for person, home in zip(people, homes, strict=True)]
    tasks = [asyncio.create_task(person.watch(path)) for person, path in zip(people, paths, strict=True)]
    others = list(zip(people, homes, strict=True))[handing_in:]
    before_s = [await load_s(*others[number % len(others)]) for number in range(PAGES)]
    taken_s = await asyncio.wait_for(asyncio.gather(*(each.hand_in() for each in people[:handing_in])), READY_S)
    pages_s, newcomers_s = [], []
    for number in range(PAGES):
        pages_s.append(await load_s(*others[number % len(others)]))
        if number % (PAGES // NEWCOMERS) == 0:
            begin_s, newcomer = time.monotonic(), Person(address)
            await newcomer.open(await newcomer.enter(f"newcomer {len(newcomers_s)}"))
            newcomers_s.append(time.monotonic() - begin_s)
        await asyncio.sleep(0.2)
    for task in tasks:
        task.cancel()
    return [
        ("hand_in.taken_s", max(taken_s), "s"),
        ("hand_in.page_before_p95_s", p95(before_s), "s"),
        ("hand_in.page_p95_s", p95(pages_s), "s"),
        ("hand_in.newcomer_s", max(newcomers_s), "s"),
    ]


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    arguments.add_argument("--students", type=int, default=30)
    arguments.add_argument("--handing-in", type=int, default=6)
    options = arguments.parse_args()
    names = [f"student {number}" for number in range(options.students)]
    with tempfile.TemporaryDirectory() as place:
        home = Path(place)
        (home / "names.txt").write_text("\n".join([*names, *(f"newcomer {number}" for number in range(NEWCOMERS))]))
        for number, name in enumerate(names[: options.handing_in]):
            folder = home / "room" / "desks" / name
            folder.mkdir(parents=True)
            (folder / "find_the_lamp.py").write_text(f"{ENDLESS}# {number}\n")
        command = [sys.executable, "-m", "kiks", "room", str(shipped("examples/exercises/lamp"))]
        command += ["--students", "names.txt", "--port", "0", "--code", CODE]
        with subprocess.Popen(command, cwd=home, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            address, _ = (address_in([process.stdout.readline()]) for _ in range(2))
            try:
                figures = asyncio.run(measure(address, options.students, options.handing_in))
            finally:
                begin_s = time.monotonic()
                process.terminate()
                process.wait()
                end_s = time.monotonic() - begin_s
    figures.append(("hand_in.end_s", end_s, "s"))
    figures.append(("hand_in.processors", os.cpu_count() or 0, ""))
    figures.append(("calibration.loops_per_s", calibration_loops_per_s(), "1/s"))
    report(figures, as_json=options.json)


if __name__ == "__main__":
    main()

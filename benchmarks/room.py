"""What a room of thirty students costs, and how many pictures a second each of them gets.

Run: python benchmarks/room.py [--json] [--students 30] [--seconds 10].

Each student is a client that does what the page in a browser does: it comes in by the entrance, loads the page of its
desk, opens the socket of the page and the feed, and acknowledges frames. On each desk a program drives the robot in
real time. The lecturer's page is open, too, and loads the picture of each desk once a second. Clients run in a process
of their own.

`room.server_cores` is what the process of `kiks room` takes of the processors, `room.programs_cores` what the students'
programs take in their processes. `room.fewest_pictures_per_s` is what the worst-off student gets, and
`room.longest_pause_s` the longest time between two frames of any student. `room.come_in_s` is how long it takes until
all students, who come at once, see their robots, and `room.ready_s` until all programs run. `room.server_mb` is the
server's memory.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from urllib.parse import urlencode, urlsplit

import httpx
from websockets.asyncio.client import ClientConnection, connect

from calibration import calibration_loops_per_s, report
from desk import address_in, cpu_s
from kiks.export.frames import PROGRAM_DRIVES
from kiks.model.arena import Arena
from kiks.model.exercise import Exercise
from kiks.model.goal import Goal
from kiks.model.project import Project, ProjectRobot

CODE = "KX7Q2M"

PROGRAM = """
import serial

with serial.Serial("/dev/ttyUSB0", 9600, timeout=1) as port:
    def ask(command):
        port.write(command + b"\\n")
        return port.readline()

    while True:
        left, front_left, front_right, right = map(int, ask(b"N").split(b",")[2:6])
        ask(b"D,4,-4" if max(left, front_left, front_right, right) > 200 else b"D,6,6")
"""

READY_S = 60.0
"""Longest wait for a page [s]."""


class Person:
    """A browser: its cookie, the page it has open, and the sockets of that page.

    Args:
        address: Address of the room.
    """

    def __init__(self, address: str) -> None:
        self._http = httpx.AsyncClient(base_url=address, timeout=READY_S, follow_redirects=True)
        self._netloc = urlsplit(address).netloc
        self.frames_s: list[float] = []
        self.is_driven = False

    async def enter(self, name: str) -> str:
        """Choose a name, and return where the desk is."""
        answer = await self._http.post("/", data={"code": CODE, "name": name})
        answer.raise_for_status()
        found = re.search('const home = "(.*)";', answer.text)
        assert found is not None
        return found[1]

    async def open(self, address: str) -> str:
        """Load a page, and return its address, which ends with that of the desk."""
        answer = await self._http.get(address)
        answer.raise_for_status()
        self._place = f"/{answer.url.path.split('/')[1]}"
        found = re.search(r"""client_id['"]: ?['"]([0-9a-f-]{36})""", answer.text)
        assert found is not None
        self._page, self.text = found[1], answer.text
        return answer.url.path

    def _socket(self, path: str) -> connect:
        cookies = "; ".join(f"{each.name}={each.value}" for each in self._http.cookies.jar)
        return connect(
            f"ws://{self._netloc}{path}", additional_headers={"Cookie": cookies}, compression=None, max_size=None
        )

    async def hold_page(self) -> None:
        """Hold the socket of the page, on which NiceGUI sends what has changed."""
        query = {"EIO": 4, "transport": "websocket", "client_id": self._page, "tab_id": self._page}
        query |= {"document_id": self._page, "next_message_id": 0, "implicit_handshake": "true"}
        async with self._socket(f"{self._place}/_nicegui_ws/socket.io/?{urlencode(query)}") as socket:
            await socket.recv()
            await socket.send("40")
            async for message in socket:
                if message == "2":
                    await socket.send("3")

    async def watch(self, path: str) -> None:
        """Take the frames of a desk, and acknowledge every second one, as `web/feed.js` does."""
        socket: ClientConnection
        async with self._socket(f"{path}/feed") as socket:
            async for message in socket:
                if isinstance(message, bytes):
                    self.is_driven = self.is_driven or bool(message[2] & PROGRAM_DRIVES)
                    self.frames_s.append(time.monotonic())
                    if len(self.frames_s) % 2 == 0:
                        await socket.send('{"kind": "ack", "count": 2}')

    async def look_at_all(self, students: int) -> None:
        """Load the picture of each desk once a second."""
        while True:
            begin_s = time.monotonic()
            for number in range(1, students + 1):
                (await self._http.get(f"{self._place}/room/picture/{number}")).raise_for_status()
            await asyncio.sleep(max(begin_s + 1 - time.monotonic(), 0))


def children_of(pid: int) -> list[int]:
    """Return the processes below a process."""
    parents: dict[int, list[int]] = {}
    for each in Path("/proc").iterdir():
        if each.name.isdigit():
            try:
                fields = (each / "stat").read_text(encoding="ascii").rpartition(")")[2].split()
            except OSError:
                continue
            parents.setdefault(int(fields[1]), []).append(int(each.name))
    found, waiting = [], [pid]
    while waiting:
        below = parents.get(waiting.pop(), [])
        found += below
        waiting += below
    return found


def programs_s(pid: int) -> dict[int, float]:
    """Return the processor time of each process below a process [s]."""
    found = {}
    for each in children_of(pid):
        try:
            found[each] = cpu_s(each)
        except OSError:
            continue
    return found


async def measure(addresses: list[str], pid: int, students: int, seconds: float) -> list[tuple[str, float, str]]:
    """Let students come in, and measure for some seconds."""
    address, lecturers = addresses
    begin_s = time.monotonic()
    lecturer, people = Person(address), [Person(address) for _ in range(students)]
    tasks = []

    async def come(person: Person, name: str) -> None:
        path = await person.open(await person.enter(name))
        tasks.append(asyncio.create_task(person.hold_page()))
        tasks.append(asyncio.create_task(person.watch(path)))

    await asyncio.gather(*(come(person, f"student {number}") for number, person in enumerate(people, 1)))
    while not all(person.frames_s for person in people):
        await asyncio.sleep(0.01)
    come_in_s = time.monotonic() - begin_s
    while not all(person.is_driven for person in people):
        await asyncio.sleep(0.01)
    ready_s = time.monotonic() - begin_s
    await lecturer.open(lecturers)
    tasks += [asyncio.create_task(lecturer.hold_page()), asyncio.create_task(lecturer.look_at_all(students))]
    await asyncio.sleep(5)
    for person in people:
        person.frames_s.clear()
    programs, server_s, start_s = programs_s(pid), cpu_s(pid), time.monotonic()
    await asyncio.sleep(seconds)
    took_s, server_s = time.monotonic() - start_s, cpu_s(pid) - server_s
    in_programs_s = sum(value - programs.get(each, value) for each, value in programs_s(pid).items())
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    failed = [task.exception() for task in tasks if task.done()]
    for task in tasks:
        task.cancel()
    if failed:
        raise RuntimeError(f"a connection has ended: {failed[0]!r}")
    counts = [len(person.frames_s) / took_s for person in people]
    pauses = [b - a for person in people for a, b in zip(person.frames_s, person.frames_s[1:], strict=False)]
    return [
        ("room.server_cores", server_s / took_s, "cores"),
        ("room.programs_cores", in_programs_s / took_s, "cores"),
        ("room.fewest_pictures_per_s", min(counts), "1/s"),
        ("room.pictures_per_s", statistics.mean(counts), "1/s"),
        ("room.longest_pause_s", max(pauses), "s"),
        ("room.come_in_s", come_in_s, "s"),
        ("room.ready_s", ready_s, "s"),
        ("room.server_mb", int(status.partition("VmRSS:")[2].split()[0]) / 1024, "MB"),
    ]


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    arguments.add_argument("--students", type=int, default=30)
    arguments.add_argument("--seconds", type=float, default=10.0)
    arguments.add_argument("--trusted", action="store_true", help="without a sandbox")
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory() as place:
        home = Path(place)
        (home / "drive.py").write_text(PROGRAM)
        (home / "names.txt").write_text("".join(f"student {number}\n" for number in range(1, options.students + 1)))
        arena, goal = Arena.load("pillars"), Goal("Touch nothing", solved="time_s > 1e6", points="time_s - contacts")
        Project(arena, (ProjectRobot(program="drive.py"),), goal=goal, exercise=Exercise("Drive")).save(home / "e.kiks")
        command = [sys.executable, "-m", "kiks", "room", "e.kiks", "--students", "names.txt", "--port", "0"]
        command += ["--code", CODE, *(["--trusted"] if options.trusted else [])]
        with subprocess.Popen(command, cwd=home, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            addresses = [address_in([process.stdout.readline()]) for _ in range(2)]
            try:
                figures = asyncio.run(measure(addresses, process.pid, options.students, options.seconds))
            finally:
                process.terminate()
    figures.append(("room.processors", os.cpu_count() or 0, ""))
    figures.append(("calibration.loops_per_s", calibration_loops_per_s(), "1/s"))
    report(figures, as_json=options.json)


if __name__ == "__main__":
    main()

"""What the desk costs, and how smooth it is: 20 robots with all their rays, 25 frames a second.

Run: python benchmarks/desk.py [--json]. Needs Chromium.

`desk.server_cpu_percent` is what the process that serves the desk takes of one core while 20 robots wander about in
real time and one Chromium shows them: the world, the frames, the page and its panels, all of it;
`desk.idle_cpu_percent` the same with no browser. `desk.browser_fps` is how many pictures of the arena Chromium draws a
second, without a GPU, on this computer, which it shares with the server; `desk.bytes_per_s` is what goes over the
socket.

`desk.slowdown_percent` is what an open desk takes off the speed of a simulation at full acceleration: a program follows
a wall at 9600 baud through the port in memory, with and without a desk whose client acknowledges each frame; both take
turns, and it is the median of the ratios. `desk.slowdown_20_percent` is the same in a world of 20
robots. `desk.first_picture_s` is the time from the command `kiks desk` to the first picture on the screen, warm.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

from behaviours import Follow

import kiks
from calibration import report
from kiks.desk.server import server
from kiks.desk.server.show import show
from kiks.desk.server.token import COOKIE

ROBOTS = 20
SECONDS = 10.0
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--enable-unsafe-swiftshader",
]

SERVER = """
import sys, time
import kiks
from kiks.desk.server.show import show
sim = kiks.Simulation(kiks.Arena.box(1000, 1000), robots=20, seed=1)
for number in range(1, 21):
    kiks.Khepera(sim.port(number)).set_speed(3 + number % 5, 3 + number % 3)
shown = show(sim, port=0, browser=False, is_alive=True)
print(shown.url, flush=True)
sys.stdin.read()
"""

LISTENER = """
import sys
from websockets.sync.client import connect
with connect(sys.argv[1], compression=None, additional_headers={"Cookie": sys.argv[2]}) as socket:
    print("here", flush=True)
    for message in socket:
        if isinstance(message, bytes):
            socket.send('{"kind": "ack"}')
"""


def cpu_s(pid: int) -> float:
    """Return the processor time that a process has taken so far [s]."""
    with open(f"/proc/{pid}/stat", encoding="ascii") as file:
        fields = file.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def cpu_percent(pid: int) -> float:
    """Return what a process takes of one core from now on for some seconds [%]."""
    before_s, start_s = cpu_s(pid), time.perf_counter()
    time.sleep(SECONDS)
    return 100 * (cpu_s(pid) - before_s) / (time.perf_counter() - start_s)


@contextmanager
def chromium() -> Iterator[Any]:
    """Start a browser; yield a page of it."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=FLAGS)
        yield browser.new_page(viewport={"width": 1400, "height": 900})
        browser.close()


def address_in(lines: Iterable[str]) -> str:
    """Return the address that a desk prints."""
    return next(word for line in lines for word in line.split() if word.startswith("http"))


def measure_view() -> list[tuple[str, float, str]]:
    """Measure a server with and without a browser."""
    with subprocess.Popen(
        [sys.executable, "-c", SERVER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as server:
        assert server.stdout is not None
        url = address_in(server.stdout)
        time.sleep(1)
        idle = cpu_percent(server.pid)
        with chromium() as page:
            page.goto(url)
            page.wait_for_function("window.kiksDesk && window.kiksDesk.stats().frames_received > 50")
            before, start_s = page.evaluate("window.kiksDesk.stats()"), time.perf_counter()
            busy = cpu_percent(server.pid)
            after, took_s = page.evaluate("window.kiksDesk.stats()"), time.perf_counter() - start_s
        server.kill()
    gone = {name: (after[name] - before[name]) / took_s for name in ("frames_drawn", "frames_received", "bytes")}
    return [
        ("desk.server_cpu_percent", busy, "% of a core"),
        ("desk.idle_cpu_percent", idle, "% of a core"),
        ("desk.browser_fps", gone["frames_drawn"], "1/s"),
        ("desk.frames_per_s", gone["frames_received"], "1/s"),
        ("desk.bytes_per_s", gone["bytes"], "B/s"),
    ]


def follow_s(robot_count: int, *, is_shown: bool, seconds: float) -> float:
    """Return how long a program needs for some simulated seconds [s]."""
    sim = kiks.Simulation(robots=robot_count, seed=1, arena=kiks.Arena.box(1000, 1000))
    robot, follow = kiks.Khepera(sim.port(1)), Follow()
    for number in range(2, robot_count + 1):
        kiks.Khepera(sim.port(number)).set_speed(3, 4)
    shown = show(sim, speed=None, browser=False) if is_shown else None
    listener = None
    if shown is not None:
        url = urlsplit(shown.url)
        words = [f"ws://{url.netloc}{server.SERVER.key.place}{url.path}/feed", f"{COOKIE}={server.SERVER.key.token}"]
        listener = subprocess.Popen([sys.executable, "-c", LISTENER, *words], stdout=subprocess.PIPE)
        assert listener.stdout is not None
        listener.stdout.readline()
    end_s, start_s = sim.time_s + seconds, time.perf_counter()
    while sim.time_s < end_s:
        follow.step(robot)
    took_s = time.perf_counter() - start_s
    if listener is not None and shown is not None:
        listener.kill()
        listener.wait()
        shown.close()
    return took_s


def slowdown(robot_count: int, seconds: float, rounds: int) -> float:
    """Return what an open desk takes off the speed [%]."""
    ratios = []
    for _ in range(rounds):
        alone_s = follow_s(robot_count, is_shown=False, seconds=seconds)
        ratios.append(follow_s(robot_count, is_shown=True, seconds=seconds) / alone_s)
    return 100 * (1 - 1 / statistics.median(ratios))


def first_picture_s() -> float:
    """Return how long it takes from the command to the first picture [s]."""
    with chromium() as page:
        page.goto("about:blank")
        start_s = time.perf_counter()
        command = [sys.executable, "-m", "kiks", "desk", "--port", "0", "--no-browser"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            threading.Timer(60, process.kill).start()
            url = address_in(process.stdout)
            page.goto(url)
            page.wait_for_function("window.kiksDesk && window.kiksDesk.stats().frames_drawn > 0")
            took_s = time.perf_counter() - start_s
            process.kill()
    return took_s


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    options = arguments.parse_args()
    views = [{name: value for name, value, _ in measure_view()} for _ in range(3)]
    units = {"desk.browser_fps": "1/s", "desk.frames_per_s": "1/s", "desk.bytes_per_s": "B/s"}
    figures = [
        (name, statistics.median(view[name] for view in views), units.get(name, "% of a core")) for name in views[0]
    ]
    figures.append(("desk.slowdown_percent", slowdown(1, 3000.0, 7), "%"))
    figures.append(("desk.slowdown_20_percent", slowdown(ROBOTS, 600.0, 7), "%"))
    figures.append(("desk.first_picture_s", statistics.median(first_picture_s() for _ in range(5)), "s"))
    report(figures, as_json=options.json)


if __name__ == "__main__":
    main()

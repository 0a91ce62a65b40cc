"""How fast e-pucks run, beside Kheperas in the same run: programs on the wire at 115,200 baud, and batches.

Run: python benchmarks/epuck.py [--json]. A loop reads the proximity sensors and sets the speeds. Peers take turns, and
each figure is a median.

* `epuck.memory_speedup`: simulated over real time of a loop of `N` and `D`, port in memory; `epuck.binary_speedup`: of
  one request with everything, as the driver of ROS sends it, and one with speeds; `epuck.run_...`: of the same loops
  under `kiks run`; `epuck.wifi_speedup`: of a command and a packet over Wi-Fi.
* `epuck.exchanges_per_s`: commands with a reply in a second of real time, port in memory; `..._over_khepera`: ratio.
* `epuck.full_steps_per_s_core`: robot-steps of 50 ms in a second of the processor's time, with the vehicle of
  benchmarks/crowd.py, in the box with 30 walls of benchmarks/batch.py; `epuck.open_...`: in an empty
  one of 3 m x 3 m; `..._over_khepera`: ratio.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import kiks
from batch import box, rate
from calibration import calibration_loops_per_s, report
from kiks.batch.initial_state import random_starts
from kiks.script.runner import run_here
from kiks.sim.port import VirtualPort

ASCII, BINARY = "ascii", "binary"

REQUEST = bytes((0x9F, 0xBB, 0xB3, 0xB2, 0xAF, 0x8B, 0))
"""Acceleration, requested speeds, floor, proximity, counters, microphones: 46 bytes (epuck-protocol.md 7)."""

SOURCE = f"""
import struct, sys, serial
port = serial.Serial("/dev/rfcomm0", int(sys.argv[3]), timeout=2)
def ascii(loop):
    port.write(b"N\\n"); port.readline()
    port.write(b"D,5,%d\\n" % (loop % 9)); port.readline()
def binary(loop):
    port.write({REQUEST!r}); port.read(46)
    port.write(struct.pack("<bhhb", -ord("D"), 300, 300 + loop % 9, 0))
step = globals()[sys.argv[1]]
for loop in range(int(sys.argv[2])): step(loop)
"""

WIFI = """
import socket, sys
sock = socket.create_connection(("192.168.1.2", 1000))
command = bytes((0x80, 2, 0, 0, 1, 0, 1)) + bytes(14)
for loop in range(int(sys.argv[2])):
    sock.sendall(command)
    sock.recv(105, socket.MSG_WAITALL)
"""

VEHICLE = {"khepera": (8.0, 1 / 1600), "epuck": (8.0, 4 / 1600)}
"""Speed of the vehicles of a batch [8 mm/s], and how much a count turns them, so that both keep off walls alike."""


@kiks.controller
def vehicle(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Drive, and turn away from what is near."""
    left = sensors[0] * 4 + sensors[1] * 6 - sensors[2] * 6 - sensors[3] * 18 - sensors[4] * 6 - sensors[5] * 4
    right = -sensors[0] * 4 - sensors[1] * 6 - sensors[2] * 14 - sensors[3] * 8 + sensors[4] * 6 + sensors[5] * 4
    wheels[0] = parameters[0] * (1.0 + left * parameters[1])
    wheels[1] = parameters[0] * (1.0 + right * parameters[1])


def ascii_loop(port: VirtualPort, loop: int) -> None:
    """Read the sensors and set the speeds by lines."""
    port.write(b"N\n")
    port.readline()
    port.write(b"D,5,%d\n" % (loop % 9))
    port.readline()


def binary_loop(port: VirtualPort, loop: int) -> None:
    """Ask for everything at once, and set the speeds without an answer."""
    port.write(REQUEST)
    port.read(46)
    port.write(b"\xbc\x2c\x01\x2c\x01\x00")


def in_memory(robot: str, step: Callable[[VirtualPort, int], None], loops: int) -> Callable[[], tuple[float, float]]:
    """Return what measures the simulated and the real time [s] of loops of a program in this process."""

    def measure() -> tuple[float, float]:
        sim = kiks.Simulation(kiks.Arena.load("office"), robot=robot, seed=1)
        port = sim.port(1)
        for loop in range(200):
            step(port, loop)
        begin_s, start_s = sim.time_s, time.perf_counter()
        for loop in range(loops):
            step(port, loop)
        return sim.time_s - begin_s, time.perf_counter() - start_s

    return measure


def run(robot: str, program: Path, loops: int, way: str, baud: int) -> Callable[[], tuple[float, float]]:
    """Return what measures the same of a program under `kiks run`."""

    def measure() -> tuple[float, float]:
        sim = kiks.Simulation(kiks.Arena.load("office"), robot=robot, seed=1)
        start_s = time.perf_counter()
        with contextlib.redirect_stderr(io.StringIO()):
            if run_here(sim, program, [way, str(loops), str(baud)], {}):
                raise SystemExit("the program has failed")
        return sim.time_s, time.perf_counter() - start_s

    return measure


def batch_rate(robot: str, arena: kiks.Arena) -> Callable[[], float]:
    """Return what measures robot-steps in a second of the processor's time."""
    batch = kiks.Batch(
        arena,
        512,
        robot=robot,
        timing=kiks.Timing(0.05, None),
        threads=1,
        seed=1,
        starts=random_starts(arena, 512, seed=1, clear_mm=20.0)[:, None, :],
    )
    return rate(batch, 10.0, vehicle, VEHICLE[robot])


def main() -> None:
    """Measure and report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="one JSON object a line")
    parser.add_argument("--loops", type=int, default=4000, help="loops of a measurement")
    parser.add_argument("--repeats", type=int, default=7)
    options = parser.parse_args()
    loops = options.loops
    with tempfile.TemporaryDirectory() as folder:
        program, by_radio = Path(folder) / "program.py", Path(folder) / "radio.py"
        program.write_text(SOURCE)
        by_radio.write_text(WIFI)
        wires = {
            "memory": in_memory("epuck", ascii_loop, loops),
            "binary": in_memory("epuck", binary_loop, loops),
            "run": run("epuck", program, loops, ASCII, 115_200),
            "run_binary": run("epuck", program, loops, BINARY, 115_200),
            "wifi": run("epuck2_wifi", by_radio, loops, ASCII, 0),
            "khepera": in_memory("khepera", ascii_loop, loops),
            "run_khepera": run("khepera", program, loops, ASCII, 9600),
        }
        times: dict[str, list[tuple[float, float]]] = {name: [] for name in wires}
        for _ in range(options.repeats):
            for name, measure in wires.items():
                times[name].append(measure())
    speedup = {name: statistics.median(sim_s / real_s for sim_s, real_s in each) for name, each in times.items()}
    real_s = {name: statistics.median(real for _, real in each) for name, each in times.items()}
    arenas = {"full": box(1000), "open": kiks.Arena.box(3000, 3000)}
    rates = {robot + name: batch_rate(robot, arena) for robot in VEHICLE for name, arena in arenas.items()}
    steps: dict[str, list[float]] = {each: [] for each in rates}
    for _ in range(options.repeats):
        for each, steps_per_s in rates.items():
            steps[each].append(steps_per_s())
    batch = {each: statistics.median(found) for each, found in steps.items()}
    report(
        [
            *((f"epuck.{name}_speedup", value, "x real time") for name, value in speedup.items()),
            ("epuck.exchanges_per_s", 2 * loops / real_s["memory"], "1/s"),
            ("epuck.exchanges_over_khepera", real_s["khepera"] / real_s["memory"], "times"),
            ("epuck.run_over_khepera", real_s["run_khepera"] / real_s["run"], "times"),
            *((f"epuck.{name}_steps_per_s_core", batch["epuck" + name], "robot-steps/CPU s") for name in arenas),
            *(
                (f"epuck.{name}_over_khepera", batch["epuck" + name] / batch["khepera" + name], "times")
                for name in arenas
            ),
            ("epuck.calibration", calibration_loops_per_s(), "loops/s"),
        ],
        as_json=options.json,
    )


if __name__ == "__main__":
    main()

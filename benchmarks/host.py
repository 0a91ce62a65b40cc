"""How fast programs elsewhere drive the robots of a host, beside processes of `kiks run`.

Two programs send D and N in a loop at 9600 baud, over loopback. Run: python benchmarks/host.py [--json]. Each figure is
a median, from the first command to the end.

* `host.run_per_s`: commands with their replies of both programs together, under `kiks run`;
* `host.joined_per_s`: the same of a host and `kiks run --join`;
* `host.opened_per_s`: the same of a host and programs that open the address as a port;
* `host.joined_share`: the second in shares of the first.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import kiks
from calibration import report
from kiks.desk.server.desk import Desk
from kiks.desk.server.players import Players
from kiks.desk.server.server import SERVER
from kiks.desk.server.show import Driver, Shown
from kiks.ports.program_command import ProgramCommand
from kiks.ports.programs import Programs
from kiks.run import Run
from kiks.sim.simulation import Simulation

PROGRAM = """
import sys, serial
import kiks
port = serial.serial_for_url(sys.argv[1], timeout=2)
for loop in range(int(sys.argv[2])):
    port.write(b"D,5,%d\\n" % (loop % 9)); port.readline()
    port.write(b"N\\n"); port.readline()
port.close()
"""

PROGRAMS, EXCHANGES = 2, 2
"""Programs, and exchanges of each in a loop."""

POLL_S = 0.001


class Watch:
    """Measures the real time since time has begun to pass in a world."""

    def __init__(self, sim: Simulation) -> None:
        self._sim, self._begin_s = sim, 0.0
        threading.Thread(target=self._look, daemon=True).start()

    def _look(self) -> None:
        while not self._sim.now_ns:
            time.sleep(POLL_S)
        self._begin_s = time.perf_counter()

    def passed_s(self) -> float:
        """Return that time [s]."""
        return time.perf_counter() - self._begin_s


def world() -> Simulation:
    return kiks.Simulation(kiks.Arena.box(600, 600), robots=PROGRAMS, seed=1)


def time_of_run(program: Path, loops: int) -> float:
    """Return the time that the programs take as processes of `kiks run` [s]."""
    commands = [ProgramCommand(program, [f"kiks://{number}", str(loops)]) for number in range(1, PROGRAMS + 1)]
    sim = world()
    watch = Watch(sim)
    assert Programs(sim, commands).run() == 0
    return watch.passed_s()


def time_of_host(program: Path, loops: int, *, is_joined: bool) -> float:
    """Return the time that they take at a host [s], by `kiks run --join` or by opening the address."""
    robots = range(1, PROGRAMS + 1)

    desk = Desk(Run.in_world(world(), speed=None, players=robots))
    desk.begin()
    shown, players, ended = Shown(desk, port=0), Players(desk, robots, lambda text: None), threading.Event()
    SERVER.let_in(players)

    def end(_sim: Simulation) -> None:
        players.pause()
        ended.set()

    driver = Driver(desk, end)
    thread = threading.Thread(target=driver.run)
    thread.start()
    watch = Watch(desk.sim)
    for key, robot in players.robots.items():
        address = f"kiks://{SERVER.place()}/{robot}?token={key.token}"
        begin = ["-m", "kiks", "run", "--join", address] if is_joined else []
        port = f"kiks://{robot}" if is_joined else address
        subprocess.Popen([sys.executable, *begin, str(program), port, str(loops)], stderr=subprocess.DEVNULL)
    ended.wait()
    passed_s = watch.passed_s()
    driver.stop()
    thread.join()
    shown.close()
    return passed_s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print JSON lines")
    parser.add_argument("--loops", type=int, default=2000)
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    loops = arguments.loops
    ways = {
        "run": lambda: time_of_run(program, loops),
        "joined": lambda: time_of_host(program, loops, is_joined=True),
        "opened": lambda: time_of_host(program, loops, is_joined=False),
    }
    times: dict[str, list[float]] = {name: [] for name in ways}
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, "program.py")
        program.write_text(PROGRAM)
        for _ in range(arguments.repeats):
            for name, measure in ways.items():
                times[name].append(measure())
    count = PROGRAMS * EXCHANGES * loops
    rates = {name: count / statistics.median(found) for name, found in times.items()}
    rows = [(f"host.{name}_per_s", rate, "exchanges/s") for name, rate in rates.items()]
    report([*rows, ("host.joined_share", rates["joined"] / rates["run"], "of kiks run")], as_json=arguments.json)


if __name__ == "__main__":
    main()

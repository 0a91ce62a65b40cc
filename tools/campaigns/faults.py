"""What goes wrong around KiKS: killed processes, a full disk, no home, no descriptors, a damaged cache."""

from __future__ import annotations

import gc
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, partial
from pathlib import Path

import numpy as np
from tools.campaigns import recordings
from tools.campaigns.processes import (
    GUARD_S,
    Looker,
    SessionClient,
    check_robot,
    compile_engine,
    connect,
    desk,
    hand_in,
    python,
    quiet,
    serving,
    started,
)
from tools.campaigns.runner import Broken, Campaign, Play, judge

import kiks
from kiks.clock.thinking import save_thinking
from kiks.desk.server.show import show
from kiks.engine.code_cache import cache_folders
from kiks.model.arena import Arena
from kiks.model.arena_file import save_arena
from kiks.model.kad import save_kad
from kiks.model.project import Project
from kiks.model.robot import save_robot
from kiks.model.thesis_networks import NetworkResponse
from kiks.ports.pty import PtyEndpoint
from kiks.ports.tcp import TcpEndpoint
from kiks.sim.simulation import Simulation
from kiks.toolbox.framing import Heartbeat
from kiks.toolbox.session import Session
from kiks.toolbox.session_process import SessionProcess

# ---- files that are being written ----


def _network(folder: Path, is_new: bool) -> None:
    response = NetworkResponse.load()
    if is_new:
        object.__setattr__(response, "range_mm", 51.0)
    response.save(folder / "own.json")


def _champion(folder: Path, is_new: bool) -> None:
    controller = kiks.controllers.linear()
    kiks.Champion(controller, (0.5 + is_new,) * 18).save(folder / "champion.toml")


def _robot(folder: Path, is_new: bool) -> None:
    spec = kiks.RobotSpec.load("khepera_ii" if is_new else "khepera")
    save_robot(spec, folder / "robot.toml")


@cache
def _arena(is_new: bool) -> Arena:
    """Return an arena whose picture is some 100 kB."""
    raster = np.random.default_rng(int(is_new)).integers(0, 3, (400, 400)).astype(np.uint8)
    return Arena(raster, 1.0, "new" if is_new else "old")


_WRITERS: dict[str, Callable[[Path, bool], None]] = {
    "arena": lambda folder, is_new: save_arena(_arena(is_new), folder / "own.toml"),
    "kad": lambda folder, is_new: save_kad(kiks.Arena.maze(seed=int(is_new)), folder / "own.kad"),
    "project": lambda folder, is_new: Project(_arena(is_new)).save(folder / "own.kiks"),
    "network": _network,
    "champion": _champion,
    "robot": _robot,
    "thinking": lambda folder, is_new: save_thinking([12345678 + is_new] * 9000, folder / "own.txt"),
}
"""What writes each kind of file, an old and a new one."""


@cache
def _versions(name: str, is_new: bool) -> dict[str, bytes]:
    """Return what the files of a kind hold."""
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        _WRITERS[name](Path(folder), is_new)
        return _contents(Path(folder))


def _contents(folder: Path) -> dict[str, bytes]:
    """Return what the files of a folder hold; without the head of a MATLAB file, which tells the time."""
    head = {".kad": 116}
    return {path.name: path.read_bytes()[head.get(path.suffix, 0) :] for path in folder.iterdir() if path.is_file()}


def _check_files(name: str, folder: Path, *, may_leave: bool) -> None:
    """Check that every file is the old or the new one.

    Raises:
        Broken: If one is neither, or something else lies there that must not.
    """
    old, new = _versions(name, False), _versions(name, True)
    found = _contents(folder)
    for file in old:
        if found.get(file) not in (old[file], new[file]):
            size = len(found.get(file, b""))
            raise Broken("lost", f"{file} has {size} bytes of {len(old[file])} or {len(new[file])}", f"file of {name}")
    if not may_leave and set(found) != set(old):
        raise Broken("lost", f"{sorted(set(found) - set(old))} was left behind", f"left by {name}")


def _forked(act: Callable[[], object]) -> int:
    """Do something in a process of its own; return that."""
    process = os.fork()
    if process == 0:
        try:
            act()
            os._exit(0)
        finally:
            os._exit(1)
    return process


def _kill_writer(rng: random.Random) -> None:
    """Kill who is writing a file."""
    name = rng.choice(list(_WRITERS))
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        path = Path(folder)
        _WRITERS[name](path, False)

        def write_on() -> None:
            while True:
                _WRITERS[name](path, True)
                _WRITERS[name](path, False)

        process = _forked(write_on)
        time.sleep(rng.uniform(0.0, 0.05))
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        _check_files(name, path, may_leave=True)


def _fill_disk(rng: random.Random) -> None:
    """Write when there is no room: files may not grow beyond a few bytes."""
    name = rng.choice(list(_WRITERS))
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        path = Path(folder)
        _WRITERS[name](path, False)
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        most = rng.choice((0, 1, 100, 1000, 4096, max(map(len, _versions(name, True).values())) - 1))
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, before[1]))
        try:
            judge(lambda: _WRITERS[name](path, True))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
        _check_files(name, path, may_leave=False)


def _write_nowhere(rng: random.Random) -> None:
    """Write where that is impossible."""
    name = rng.choice(list(_WRITERS))
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        file = Path(folder) / "file"
        file.write_bytes(b"")
        judge(
            lambda: _WRITERS[name](
                rng.choice((file, Path(folder) / "nowhere", Path("/proc/self"), Path("/dev/null"))), True
            )
        )


def _no_descriptors(rng: random.Random) -> None:
    """Do something when no file can be opened any more."""
    sim = Simulation(kiks.Arena.box(300, 300), seed=1)
    acts: list[Callable[[Path], object]] = [
        *(partial(writer, is_new=True) for writer in _WRITERS.values()),
        lambda folder: kiks.Arena.load(folder / "own.toml"),
        lambda folder: kiks.RobotSpec.load("khepera"),
        lambda folder: NetworkResponse.load(),
        lambda folder: Project.load(folder / "own.kiks"),
        lambda folder: PtyEndpoint(folder / "link").close(),
        lambda folder: TcpEndpoint(0).close(),
        lambda folder: SessionProcess(Session(), Heartbeat()).close(),
        lambda folder: show(sim, port=0, browser=False).close(),
    ]
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        save_arena(_arena(False), Path(folder) / "own.toml")
        act, taken = rng.choice(acts), []
        gc.collect()
        before = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (256, before[1]))
        try:
            with suppress(OSError):
                while True:
                    taken.append(os.dup(0))
            for _ in range(rng.randrange(8)):
                os.close(taken.pop())
            judge(lambda: act(Path(folder)))
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, before)
            for descriptor in taken:
                os.close(descriptor)


# ---- evolutions ----

_EVOLVE = """
import sys, kiks
task = kiks.tasks.avoid(seconds=1.0, worlds=4)
evolution = kiks.Evolution(task, "ga", population=8, seed=3, folder=sys.argv[1])
evolution.run(generations=10**6, each=lambda each: print(len(each.generations), flush=True))
"""


def _kill_evolution(rng: random.Random) -> None:
    """Kill an evolution, twice; what it has told stays, and it goes on to the bit."""
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        for _ in "12":
            with _evolving(folder) as process:
                assert process.stdout is not None
                told = int([process.stdout.readline() for _ in range(rng.randint(1, 5))][-1])
                time.sleep(rng.uniform(0.0, 0.1))
                process.kill()
            task = kiks.tasks.avoid(seconds=1.0, worlds=4)
            again = kiks.Evolution(task, "ga", population=8, seed=3, folder=folder)
            if len(again.generations) < told:
                raise Broken("lost", f"{told} generations were told, {len(again.generations)} are there", "evolution")
        _check_evolution(again)


def _evolving(folder: str) -> subprocess.Popen[str]:
    return subprocess.Popen([sys.executable, "-c", _EVOLVE, folder], stdout=subprocess.PIPE, text=True)


def _check_evolution(found: kiks.Evolution) -> None:
    """Check that an interrupted evolution has the same generations as an uninterrupted one."""
    whole = kiks.Evolution(found.task, "ga", population=8, seed=3)
    whole.run(generations=len(found.generations))
    for one, other in zip(found.generations, whole.generations, strict=True):
        if one.candidates.tobytes() != other.candidates.tobytes() or one.values.tobytes() != other.values.tobytes():
            raise Broken("lost", "an evolution that was killed goes on otherwise", "evolution")


# ---- servers and clients ----

_FLOOD = """
import socket, sys, time
line = socket.create_connection(("127.0.0.1", int(sys.argv[1])))
line.settimeout(2)
try:
    line.sendall(sys.stdin.buffer.read())
except OSError:
    pass
print(1, flush=True)
time.sleep(99)
"""


def _kill_client(rng: random.Random) -> None:
    """Kill a client that has flooded its robot; the next one is let in."""
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder, serving(folder=Path(folder)) as (command, port):
        for _ in range(3):
            flood = b"N\n" * rng.choice((1, 1000, 50_000)) if rng.random() < 0.7 else rng.randbytes(200_000)
            with subprocess.Popen(
                [sys.executable, "-c", _FLOOD, str(port)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
            ) as client:
                assert client.stdin is not None
                assert client.stdout is not None
                with suppress(BrokenPipeError):
                    client.stdin.write(flood)
                    client.stdin.close()
                client.stdout.readline()
                client.kill()
            check_robot(port)
        command.check()


def _kill_server(rng: random.Random) -> None:
    """Kill a server; one at the same place and link can be started after it."""
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        link, port = Path(folder) / "khepera", 0
        for _ in range(2):
            with started("serve", "--tcp", str(port), "--link", str(link), folder=Path(folder)) as command:
                port = int(command.find(r"socket://[^:]*:(\d+)"))
                command.find("(repeat|live|Ctrl-C)")
                with connect(port) as line:
                    line.sendall(b"N\n" * rng.choice((1, 1000)))
                    time.sleep(rng.uniform(0.0, 0.2))
                    command.process.kill()
            command.check()


def _kill_session(rng: random.Random) -> None:
    """Kill a session, or its client: the one is not found any more, the other leaves nothing."""
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        home = Path(folder)
        client = SessionClient(home)
        client.ask("set thinking none")
        client.ask("open 1 9600")
        client.kill()
        with started("session", "--join", "0", folder=home) as command:
            command.end()
        again = SessionClient(home)
        if not again.ask("open 1 9600").startswith("+"):
            raise Broken("foreign", "a session after one that was killed must work", "session")
        # Its client is killed: all that it sees is that its pipe ends, in the middle of a request.
        assert again.process.stdin is not None
        assert again.process.stdout is not None
        os.write(again.process.stdin.fileno(), b"ask 1 N\na"[: rng.randint(1, 9)])
        again.process.stdin.close()
        again.process.stdout.close()
        try:
            again.process.wait(GUARD_S)
        except subprocess.TimeoutExpired:
            again.process.kill()
            again.process.wait()
            raise Broken("hang", "a session must end with its last client", "session") from None


def _kill_desk(rng: random.Random) -> None:
    """Kill a desk's browser in the middle of a frame, then the desk; another one begins on the same port."""
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        home = Path(folder)
        with desk("--speed", "0", folder=home) as (command, url):
            looking = f"from tools.campaigns.processes import Looker; Looker({url!r}).look(10**9)"
            root = str(Path(__file__).parents[2])
            environment = {**os.environ, "PYTHONPATH": os.pathsep.join([root, *sys.path])}
            with subprocess.Popen([sys.executable, "-c", looking], env=environment) as looker:
                time.sleep(rng.uniform(0.5, 4.0))
                looker.kill()
            Looker(url).look(3)
            command.check()
        port = url.split(":")[2].partition("/")[0]
        with started("desk", "--port", port, "--no-browser", folder=home) as command:
            Looker(command.find(r"(http://\S+)")).look(3)
            command.check()


# ---- homes and caches ----

_DRIVE = """
import kiks
sim = kiks.Simulation(kiks.Arena.box(300, 300), seed=1)
port = sim.port(1)
port.write(b"D,5,4\\nN\\n")
port.read(20)
print("state", sim.state_hash())
"""


@cache
def _state() -> str:
    _, said = python(_DRIVE, Path(tempfile.gettempdir()))
    return said.split("state ")[-1].strip()


def _check_drive(environment: dict[str, str], folder: Path) -> None:
    """Check that a robot drives as ever, whatever the environment is."""
    code, said = python(_DRIVE, folder, environment, timeout=540.0)
    if code < 0:
        raise Broken("death", f"signal {-code}: {said[-300:]!r}", "cache")
    if "Traceback" in said or code:
        raise Broken("foreign", said[-300:], f"cache: {said.strip().splitlines()[-1][:60]}")
    if _state() not in said:
        raise Broken("lost", f"another state: {said[-200:]!r}", "cache")


def _no_home(rng: random.Random) -> None:
    """Drive a robot where nothing can be kept."""
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        nowhere = rng.choice(("/dev/null/home", "/proc/nowhere", ""))
        environment = {"HOME": nowhere, "NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": "", "TMPDIR": folder}
        _check_drive(environment, Path(folder))


def _damage_cache(rng: random.Random) -> None:
    """Drive a robot with a compiled engine some of whose files are damaged."""
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        there = next(cache_folders())
        shutil.copytree(there, Path(folder) / "kiks" / there.name)
        files = sorted(path for path in Path(folder).rglob("*.code") if path.is_file())
        way = rng.choice((_truncate, _empty, _scribble, _swap))
        for path in rng.sample(files, rng.choice((1, 3, len(files)))):
            way(rng, path, files)
        _check_drive({"NUMBA_CACHE_DIR": folder}, Path(folder))


def _truncate(rng: random.Random, path: Path, files: list[Path]) -> None:
    path.write_bytes(path.read_bytes()[: rng.randrange(path.stat().st_size)])


def _empty(rng: random.Random, path: Path, files: list[Path]) -> None:
    path.write_bytes(b"")


def _scribble(rng: random.Random, path: Path, files: list[Path]) -> None:
    data = bytearray(path.read_bytes())
    for _ in range(20):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    path.write_bytes(data)


def _swap(rng: random.Random, path: Path, files: list[Path]) -> None:
    path.write_bytes(rng.choice([each for each in files if each.suffix == path.suffix]).read_bytes())


# ---- a person ----

_ENDLESS = """
import serial
port = serial.Serial("COM1", timeout=1)
while True:
    port.write(b"N\\n")
    port.readline()
"""

_COMMANDS = (
    ("serve", "--tcp", "0", "--no-pty"), ("run", "endless.py"), ("demo", "follow", "--seconds", "100000"),
    ("desk", "--port", "0", "--no-browser"), ("warmup",),
)  # fmt: skip


def _interrupt(rng: random.Random) -> None:
    """Press Ctrl-C while a command loads, or somewhat later; it ends at once, and says nothing of Python."""
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        (Path(folder) / "endless.py").write_text(_ENDLESS, encoding="ascii")
        with started(*rng.choice(_COMMANDS), folder=Path(folder)) as command:
            # Before that Python itself has no handler yet.
            time.sleep(rng.uniform(0.1, 4.0))
            command.process.send_signal(signal.SIGINT)
            # Shortly before Python ends it hands Ctrl-C back to the system, which ends the process by the signal.
            command.end(by=signal.SIGINT)


_HAND_IN = (
    ("run", "--record", "../own.mcap", "../drive.py", "../drive.py"), ("replay", "--check", "../run.mcap"),
    ("export", "../run.mcap", "../plot.png", "--kind", "figures"), ("export", "../run.mcap", "../page.html"),
    ("export", "../run.mcap", "../film.gif"), ("export", "../run.mcap", "../table.csv"), ("warmup",),
    ("demo", "clean", "--seconds", "1", "--export", "../clean.png"), ("arena", "maze", "../maze.toml"),
    ("evolve", "--generations", "1", "--population", "4", "--out", "../evolved"),
)  # fmt: skip


def _current_folder(rng: random.Random) -> None:
    """Give a command in a folder full of files with the names of modules: it runs none of them."""
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as name:
        folder = Path(name)
        (folder / "run.mcap").write_bytes(recordings.sound())
        (folder / "drive.py").write_text(_ENDLESS.replace("while True", "for _ in range(9)"), encoding="ascii")
        words = [str(Path(sys.executable).with_name("kiks")), *rng.choice(_HAND_IN)]
        done = subprocess.run(words, cwd=hand_in(folder), env=quiet(folder), capture_output=True, check=False)
        if (folder / "ran").exists() or done.returncode:
            ran = (folder / "ran").read_text() if (folder / "ran").exists() else done.stderr.decode()
            raise Broken("foreign", ran[-300:], f"current folder: {words[1]}")


# ---- all of them ----

SCENES: dict[str, tuple[Callable[[random.Random], None], int, float]] = {
    "kill_writer": (_kill_writer, 600, 30.0),
    "fill_disk": (_fill_disk, 400, 30.0),
    "write_nowhere": (_write_nowhere, 100, 30.0),
    "no_descriptors": (_no_descriptors, 300, 60.0),
    "kill_evolution": (_kill_evolution, 6, 100.0),
    "kill_client": (_kill_client, 4, 100.0),
    "kill_server": (_kill_server, 4, 100.0),
    "kill_session": (_kill_session, 4, 100.0),
    "kill_desk": (_kill_desk, 3, 100.0),
    "interrupt": (_interrupt, 120, 100.0),
    "damage_cache": (_damage_cache, 8, 200.0),
    "no_home": (_no_home, 2, 200.0),
    "current_folder": (_current_folder, 40, 100.0),
}
"""What happens, how often, and how long it may take [s]."""


def _ready(scene: Callable[[random.Random], None]) -> Play:
    compile_engine()
    if scene in (_kill_writer, _fill_disk, _no_descriptors):
        for name in _WRITERS:
            _versions(name, False)
            _versions(name, True)
    return scene


def campaigns() -> Iterator[Campaign]:
    """Yield one for each thing that happens."""
    for name, (scene, count, limit_s) in SCENES.items():
        yield Campaign(f"faults.{name}", count, partial(_ready, scene), limit_s=limit_s)

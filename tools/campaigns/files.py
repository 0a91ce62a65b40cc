"""Every kind of file that KiKS reads, mutated, read, and what was read used as it would be."""

from __future__ import annotations

import fcntl
import io
import os
import random
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from functools import cache, partial
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from click import Command
from tools.campaigns import recordings
from tools.campaigns.hostile import BYTES_MAX, mutated, mutated_text
from tools.campaigns.runner import SECRET, Campaign, Play
from tools.campaigns.strange import (
    bomb,
    strange_kad,
    strange_mat,
    strange_netpbm,
    strange_npz,
    strange_png,
)
from tools.sensors.models import thesis
from typer import Context

import kiks
from kiks.cli.compare import compare
from kiks.cli.job import job_of
from kiks.cli.options import WorldOptions
from kiks.client.drive import ControllerDriver
from kiks.clock.thinking import parse_thinking
from kiks.desk.server.folder import decode
from kiks.fit.samples import load_samples, nearnesses
from kiks.learn.evolution_log import CHAMPION
from kiks.learn.individual import load_individual
from kiks.learn.results import RESULT, examined
from kiks.model.arena import Arena, Ball, Cylinder, Lamp, Pose
from kiks.model.arena_file import save_arena
from kiks.model.kad import encode_kad
from kiks.model.project import Project, ProjectRobot
from kiks.model.thesis_networks import THESIS, NetworkResponse
from kiks.ports.pty import default_folder
from kiks.sim.from_project import simulation_of
from kiks.sim.simulation import Simulation
from kiks.toolbox.session_files import SessionAddress, find_session

CASES = 10_000
"""Mutations of each kind of file."""

MEMORY_MB = 2000
"""Most memory for a file [MB]."""

CELLS_MAX = 2_000_000
"""Larger arenas are read, and driven in but seldom: that takes many seconds and is right."""


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Args:
        name: What the campaign is called.
        file: Its name in its folder.
        sound: Good files of the kind.
        read: Reads one and uses what it has read.
        text: Whether it is 'toml' or 'json', or neither.
        strange: What makes files of the kind that mutations would hardly find.
        beside: Other files of the folder.
    """

    name: str
    file: str
    sound: Sequence[bytes]
    read: Callable[[Path], object]
    text: str = ""
    strange: Sequence[Callable[[random.Random], bytes]] = ()
    beside: tuple[tuple[str, bytes], ...] = ()

    def make(self, rng: random.Random) -> bytes:
        """Return a hostile file."""
        data, choice = rng.choice(self.sound), rng.random()
        if self.strange and choice < 0.4:
            return rng.choice(self.strange)(rng)
        if self.text and choice < 0.85:
            return mutated_text(rng, data, self.sound, is_json=self.text == "json")
        return mutated(rng, data, self.sound)

    def prepare(self) -> Play:
        """Return what plays a case."""

        def play(rng: random.Random) -> None:
            with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
                for name, data in self.beside:
                    (Path(folder) / name).parent.mkdir(exist_ok=True)
                    (Path(folder) / name).write_bytes(data)
                file = Path(folder) / self.file
                file.parent.mkdir(exist_ok=True)
                file.write_bytes(self.make(rng)[:BYTES_MAX])
                self.read(file)

        return play


# ---- what is done with what was read ----


def drive(sim: Simulation) -> None:
    """Let the robots of a world sense and drive."""
    for number in range(1, min(sim.robot_count, 3) + 1):
        port = sim.port(number)
        port.timeout = 5.0
        port.write(b"D,9,-7\nN\nO\nE\n")
        port.read(200)
        if sim.turrets(number):
            port.write(b"T,2,N\nT,1,F\n")
            port.read(400)
    sim.run(0.05)
    sim.look()
    sim.state_hash()


def drive_in(arena: Arena) -> None:
    """Let a robot drive in an arena."""
    if arena.brightness.size <= CELLS_MAX:
        drive(Simulation(arena, robots=max(1, min(len(arena.starts), 20)), seed=1))


def _robot(path: Path) -> None:
    drive(Simulation(_BOX, robot=[str(path), "khepera"], seed=1))


def _project(path: Path) -> None:
    project = Project.load(path)
    project.to_bytes()
    if project.arena.brightness.size <= CELLS_MAX and len(project.robots) <= 20:
        drive(simulation_of(project, path.parent))


def _uploaded(path: Path) -> None:
    project = decode(path.name, path.read_bytes())
    if project.arena.brightness.size <= CELLS_MAX and len(project.robots) <= 20:
        drive(simulation_of(project, path.parent))


def _champion(path: Path) -> None:
    _drive_champion(kiks.Champion.load(path))


def _drive_champion(champion: kiks.Champion) -> None:
    world = champion.world
    is_small = world is None or (world.arena.brightness.size <= CELLS_MAX and len(world.robots) <= 20)
    sim, ports = champion.simulation(None if is_small else _BOX, seed=1)
    driver = ControllerDriver(ports, champion.controller, champion.parameters, period_s=champion.timing.period_s)
    for _ in range(3):
        driver.step()
    sim.state_hash()


def _evolution(path: Path) -> None:
    folder = path.parent if path.name == "evolution.json" else path.parents[1]
    evolution = kiks.Evolution(_task(), "ga", seed=3, population=4, folder=folder)
    evolution.ask()
    if evolution.generations:
        evolution.champion._text({}, {})


def _individual(path: Path) -> None:
    folder = path.parent if path.name == "evolution.json" else path.parents[1]
    _drive_champion(load_individual(folder, 1, rank=2, task=_task())[0])


def _archive(path: Path) -> None:
    archive = kiks.Archive.load(path.parents[1])
    if archive.elites:
        _drive_champion(archive.champion_at(*[0.5] * len(archive.axes)))


def _result(path: Path) -> None:
    """Compare it with a sound one, as `kiks compare` does."""
    folder = path.parent / "sound"
    for name, data in _finished().items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    with redirect_stdout(io.StringIO()):
        compare(Context(Command("compare")), [path.parent, folder], path.parent / "compared.png")


def _contest(path: Path) -> None:
    job = job_of(str(path.parent), [], WorldOptions(seed=1))
    simulation_of(job.project).state_hash()


def _sides(path: Path) -> None:
    folder = path.parent if path.name == "evolution.json" else path.parents[1]
    evolution = kiks.Evolution(_pursuit(), seed=3, population=4, opponents=1, folder=folder)
    evolution.ask()
    if evolution.generations:
        evolution.champion._text({}, {})


def _network(path: Path) -> None:
    thesis(_SAMPLES[0], NetworkResponse.load(path))


def _samples(path: Path) -> None:
    samples = load_samples(path)
    if samples.counts.size <= 100_000:
        nearnesses(samples, _FAN)


def _replay(path: Path) -> None:
    sim = Simulation(_BOX, thinking=f"replay:{path}", seed=1)
    parse_thinking(f"replay:{path}")
    drive(sim)


def _door(path: Path) -> None:
    """Look for a session, whose file is locked while it lives."""
    os.environ["XDG_RUNTIME_DIR"] = str(path.parent)
    door = default_folder() / path.name
    door.write_bytes(path.read_bytes())
    door.chmod(0o600)
    with door.open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        find_session(0)


# ---- sound files ----


def _picture_bytes(suffix: str) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    raster = np.zeros((120, 140), np.uint8)
    raster[:10], raster[60:70, 30:90] = 255, 128
    Image.fromarray(raster).save(file, suffix)
    return file.getvalue()


def _arena() -> Arena:
    box = Arena.box(300, 260, rounded_mm=40)
    return Arena(
        box.brightness, 1.0, "sound", (Pose(100.0, 100.0, 1.0), Pose(200.0, 120.0, -2.0)), (Lamp(50.0, 50.0, 1.0),),
        (Ball(150.0, 200.0),), (Cylinder(220.0, 200.0),),
    )  # fmt: skip


def _npz(**arrays: Any) -> bytes:
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


@cache
def _task() -> kiks.Task:
    return kiks.tasks.avoid(seconds=1.0, worlds=4)


@cache
def _pursuit() -> kiks.Task:
    return kiks.tasks.pursuit(seconds=1.0)


_IDENTITY, _GENERATION, _FINALS = "evolution.json", "generations/000001.npz", "generations/000006_finals.npz"


@cache
def _finished() -> Mapping[str, bytes]:
    """Return the files of an evolution of one generation, by name."""
    with tempfile.TemporaryDirectory() as folder:
        evolution = kiks.Evolution(_task(), "ga", seed=3, population=4, folder=folder)
        values = np.outer(np.linspace(0.1, 0.9, 4), np.ones(len(_task().value_names)))
        evolution.ask()
        evolution.tell(values)
        evolution.save_log()
        examined(evolution).save(Path(folder))
        return _files_in(folder)


@cache
def _with_finals() -> Mapping[str, bytes]:
    """Return the files of an evolution with finals, by name."""
    with tempfile.TemporaryDirectory() as folder:
        kiks.Evolution(_task(), "ga", seed=3, population=4, folder=folder).run(generations=6)
        return _files_in(folder)


@cache
def _coevolved() -> Mapping[str, bytes]:
    """Return the files of a co-evolution of one generation, by name."""
    with tempfile.TemporaryDirectory() as folder:
        evolution = kiks.Evolution(_pursuit(), seed=3, population=4, opponents=1, folder=folder)
        evolution.ask()
        evolution.tell(np.zeros((8, len(_pursuit().value_names))))
        evolution.save_log()
        return _files_in(folder)


def _files_in(folder: str) -> dict[str, bytes]:
    paths = (path for path in Path(folder).rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def _arrays_in(generation: bytes) -> dict[str, Any]:
    with np.load(io.BytesIO(generation)) as arrays:
        return dict(arrays)


_ARENA_TOML = b"""name = "sound"
size_mm = [300, 260]
wall_mm = 10
rounded_mm = 30
brightness = 200
[[start]]
at_mm = [100, 100]
heading_deg = 45
[[lamp]]
at_mm = [50.5, 60]
power_w = 1.0
is_on = true
[[ball]]
at_mm = [150, 200]
radius_mm = 20.0
friction_mm_s2 = 20.0
brightness = 255
[[cylinder]]
at_mm = [220, 200]
radius_mm = 14
"""

_PROJECT_EXTRA = b"""
[[robot]]
name = "one"
kind = "own.toml"
turrets = ["k213", "gripper"]
arguments = ["a"]
brightness = 90
"""

_TASK_TOML = b"""task = 1
base = "avoid"
name = "mine"
seconds = 2.5
worlds = 6
baud = 9600
[controller]
kind = "gru"
"""

_TEXT_SAMPLES = (
    "8 2 3 5 2\n" + "".join(f"TURN {n}\n0 1 2 3 4 5 6 1023\n9 8 7 6 5 4 3 2\n" for n in range(3)) + "END\n"
).encode()


def _among(name: str, files: Mapping[str, bytes], file: str, read: Callable[[Path], object], text: str = "") -> Kind:
    """Return a kind of file that lies among the other files of an evolution."""
    beside = tuple(each for each in files.items() if each[0] != file)
    strange = (partial(strange_npz, _arrays_in(files[file])),) if file.endswith(".npz") else ()
    return Kind(name, file, [files[file]], read, text, strange, beside)


def _kinds() -> Iterator[Kind]:
    robots = [path.read_bytes() for path in _files("robots") if path.name.endswith(".toml")]
    yield Kind("robot", "own.toml", robots, _robot, "toml")

    with tempfile.TemporaryDirectory() as folder:
        save_arena(_arena(), Path(folder) / "sound.toml")
        pictured, png = (Path(folder) / "sound.toml").read_bytes(), (Path(folder) / "sound.png").read_bytes()
    yield Kind(
        "arena",
        "own.toml",
        [_ARENA_TOML, pictured],
        lambda path: drive_in(Arena.load(path)),
        "toml",
        beside=(("sound.png", png),),
    )

    pictures = {
        suffix: _picture_bytes(kind)
        for suffix, kind in (("png", "PNG"), ("tif", "TIFF"), ("bmp", "BMP"), ("pgm", "PPM"), ("jpg", "JPEG"))
    }
    strange = {"png": (strange_png,), "pgm": (strange_netpbm,)}
    for suffix, data in pictures.items():
        yield Kind(
            suffix, f"own.{suffix}", [data], lambda path: drive_in(Arena.load(path)), strange=strange.get(suffix, ())
        )
    beside = tuple((name, data) for name, data in (("own.toml", pictured.replace(b"sound.png", b"own.png")),))
    yield Kind(
        "arena_picture",
        "own.png",
        [png, *pictures.values()],
        lambda path: drive_in(Arena.load(path.with_suffix(".toml"))),
        beside=beside,
    )

    kad = encode_kad(_arena())
    yield Kind("kad", "own.kad", [kad], lambda path: drive_in(Arena.load(path)), strange=(strange_mat, strange_kad))
    yield Kind("mat", "own.mat", [kad], lambda path: drive_in(Arena.load(path)))

    project = Project(
        _arena(),
        robots=(ProjectRobot(turrets=("k213",)), ProjectRobot(kind="khepera_ii", name="b")),
        seed=3,
        thinking="fixed:2",
    ).to_bytes()
    projects = [project, project.partition(b"[[start]]")[0] + _PROJECT_EXTRA + b"[walls]\nsize_mm = [300, 260]\n"]
    files = (("own.toml", robots[0]),)
    yield Kind("project", "own.kiks", projects, _project, "toml", (partial(_project_of, png),), files)
    yield Kind("upload_project", "own.kiks", projects, _uploaded, "toml")
    yield Kind("upload_arena", "own.toml", [_ARENA_TOML, pictured], _uploaded, "toml")

    task = _task()
    champion = kiks.Champion(task.controller, (0.1,) * task.parameter_count, task="avoid", measures={"a": 1.0})
    with tempfile.TemporaryDirectory() as folder:
        champion.save(Path(folder) / "own.toml")
        saved = (Path(folder) / "own.toml").read_bytes()
    yield Kind("champion", "own.toml", [saved], _champion, "toml")

    evolved, coevolved = _finished(), _coevolved()
    yield Kind("evolution", _IDENTITY, [evolved[_IDENTITY]], _evolution, "json")
    yield _among("generation", evolved, _GENERATION, _evolution)
    yield _among("finals", _with_finals(), _FINALS, _evolution)
    yield _among("individual", evolved, _GENERATION, _individual)
    yield _among("individual_record", evolved, _IDENTITY, _individual, "json")
    yield _among(
        "champion_world", evolved, "champion_world.kiks", lambda path: _champion(path.parent / CHAMPION), "toml"
    )
    yield _among("archive", evolved, _GENERATION, _archive)
    yield _among("result", evolved, RESULT, _result, "json")
    yield _among("contest", coevolved, "prey.toml", _contest, "toml")
    yield _among("sides", coevolved, _IDENTITY, _sides, "json")
    yield _among("pairs", coevolved, _GENERATION, _sides)

    yield Kind("recording", "own.mcap", [recordings.sound()], recordings.use, strange=(recordings.strange_recording,))

    yield Kind("task", "own.toml", [_TASK_TOML], lambda path: kiks.tasks.load(str(path)), "toml")
    yield Kind("network", "own.json", [THESIS.read_bytes()[:200_000]], _network, "json")

    table = {
        "values": np.arange(3 * 4 * 8).reshape(3, 4, 8),
        "gap_mm": np.array([5.0, 7.0, 9.0]),
        "object_angle_deg_cw": np.arange(4) * 90.0,
    }
    yield Kind("samples_table", "own.npz", [_npz(**table)], _samples, strange=(partial(strange_npz, table),))
    yield Kind("samples_text", "own.sam", [_TEXT_SAMPLES], _samples, "toml")
    yield Kind("replay", "own.txt", [b"".join(b"%d\n" % (n * 1000) for n in range(40))], _replay, "toml")
    yield Kind("door", "session-1", [SessionAddress(1, 4711, SECRET).line().encode()], _door, "toml")


def _project_of(png: bytes, rng: random.Random) -> bytes:
    """Return a project with any picture for its walls."""
    import base64

    picture = strange_png(rng) if rng.random() < 0.7 else mutated(rng, png)
    text = base64.b64encode(picture[: BYTES_MAX // 2]) + rng.choice((b"", b"", b"=", b"\xff", SECRET.encode()))
    return b"kiks = 1\n[walls]\nmm_per_cell = %s\npng = '''%s'''\n" % (
        rng.choice((b"1.0", b"0.1", b"nan", b"1e308")),
        text,
    )


def _files(folder: str) -> list[Any]:
    return list((resources.files("kiks.model") / folder).iterdir())


_BOX = Arena.box(300, 300)
_FAN: Any = None
_SAMPLES: list[Any] = []


def _warm() -> None:
    """Have everything loaded and compiled that cases need."""
    global _FAN
    if _FAN is not None:
        return
    from tools.sensors.train_networks import PLACES

    from kiks.fit.samples import Fan

    drive(Simulation(_arena(), robots=2, seed=1))
    drive(simulation_of(Project(_arena(), robots=(ProjectRobot(turrets=("k213", "gripper")),), response="thesis")))
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "own.sam").write_bytes(_TEXT_SAMPLES)
        _SAMPLES.append(load_samples(Path(folder) / "own.sam"))
        _champion_file = Path(folder) / "own.toml"
        task = _task()
        kiks.Champion(task.controller, (0.1,) * task.parameter_count).save(_champion_file)
        _champion(_champion_file)
    _FAN = Fan.spread(*PLACES["rim"])
    for kind in ("zlib", "deflate"):
        bomb(kind)


def _prepared(kind: Kind) -> Play:
    _warm()
    return kind.prepare()


def campaigns() -> Iterator[Campaign]:
    """Yield one for each kind of file."""
    for kind in _kinds():
        yield Campaign(f"files.{kind.name}", CASES, partial(_prepared, kind), memory_mb=MEMORY_MB)

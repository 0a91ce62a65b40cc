"""Projects: files that come back as they were, worlds that are built from them, and what is refused."""

import math
import os
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, reject, settings
from hypothesis import strategies as st
from tests.at_length import share
from tests.model.refusals import refused

from kiks.errors import ArenaError, KiksError, ParameterError
from kiks.model.arena import Arena, Ball, Cylinder, Lamp, Pose
from kiks.model.arena_objects import THINGS_MAX
from kiks.model.atomic_files import check_relative, inside
from kiks.model.checks import ROBOTS_MAX
from kiks.model.kad import save_kad
from kiks.model.limits import PROJECT_FILE_BYTES_MAX
from kiks.model.project import Project, ProjectRobot
from kiks.model.robot import RESPONSES, RobotSpec
from kiks.model.turrets import TURRETS
from kiks.sim.from_project import project_of, simulation_of, with_kinds
from kiks.sim.simulation import Simulation

EXAMPLES = Path(__file__).parents[2] / "examples" / "arenas"

names = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=20)
thousandths = st.integers(60_000, 240_000).map(lambda number: number / 1000)
places = st.tuples(thousandths, thousandths)
headings = st.integers(0, 359_999).map(lambda number: math.radians(number / 1000))
robots = st.builds(
    ProjectRobot,
    kind=st.sampled_from(["khepera", "khepera_ii", "robots/mine.toml"]),
    turrets=st.lists(st.sampled_from(sorted(TURRETS)), unique=True).map(tuple),
    name=names,
    program=st.sampled_from([None, "a.py", "programs/b c.py"]),
    arguments=st.lists(names, max_size=3).map(tuple),
)


@st.composite
def projects(draw) -> Project:
    raster = np.zeros((300, 300), np.uint8)
    if draw(st.booleans()):
        raster[:50] = draw(st.integers(1, 255))
        raster[draw(st.integers(250, 299)), 3:90] = 7
    walls = Arena.from_array(raster, mm_per_pixel=draw(st.sampled_from([1.0, 2.5, 1.0])), name=draw(names))
    things = {
        "starts": tuple(Pose(*place, draw(headings)) for place in draw(st.lists(places, max_size=3))),
        "lamps": tuple(Lamp(*place, draw(thousandths), draw(st.booleans())) for place in draw(st.lists(places))),
        "balls": tuple(Ball(*place, 21.5, 33.0, draw(st.integers(1, 255))) for place in draw(st.lists(places))),
        "cylinders": tuple(Cylinder(*place) for place in draw(st.lists(places, max_size=2))),
    }
    try:
        arena = replace(walls, **things)
    except ArenaError:
        reject()  # something would stand on a wall
    return Project(
        arena,
        robots=tuple(draw(st.lists(robots, min_size=1, max_size=4))),
        seed=draw(st.integers(0, 2**63 - 1)),
        thinking=draw(st.sampled_from(["none", "fixed:2.5", "live", "live:0.25", "replay:times/a.txt"])),
        baud=draw(st.sampled_from([None, 9600, 38400])),
        response=draw(st.sampled_from([None, *RESPONSES])),
        noise=draw(st.booleans()),
        speed=draw(st.sampled_from([None, 1.0, 0.1, 20])),
    )


def same(one: Project, other: Project) -> bool:
    arenas = one.arena, other.arena
    return (
        np.array_equal(arenas[0].brightness, arenas[1].brightness)
        and arenas[0].__reduce__()[1][1:] == arenas[1].__reduce__()[1][1:]
        and replace(one, arena=arenas[0]).__dict__ | {"arena": 0} == other.__dict__ | {"arena": 0}
    )


@pytest.mark.slow
@settings(max_examples=share(30, 60))
@given(projects())
def test_files_come_back_as_they_were(project):
    again = Project.from_bytes(project.to_bytes())
    assert same(again, project)
    assert again.to_bytes() == project.to_bytes()


@settings(max_examples=share(20, 60))
@given(st.integers(100, 300), st.integers(100, 300), st.integers(0, 40), st.integers(0, 150), st.integers(1, 255))
def test_a_box_is_kept_as_a_box(width, height, wall, rounded, brightness):
    try:
        arena = Arena.box(width, height, wall_mm=wall, rounded_mm=rounded, brightness=brightness)
    except KiksError:
        return
    file = Project(arena).to_bytes()
    assert b"png" not in file
    assert np.array_equal(Project.from_bytes(file).arena.brightness, arena.brightness)
    marked = arena.brightness.copy()
    marked[height // 2, width // 2] = brightness
    assert b"png" in Project(Arena(marked, 1.0, "marked")).to_bytes()


def test_a_file_is_for_people(tmp_path):
    from kiks.cli.options import load_arena

    arena = replace(Arena.box(400, 300, brightness="wood"), starts=(Pose(100, 150, math.pi / 2),), name="Room")
    project = Project(arena, robots=(ProjectRobot(turrets=("k213",), program="look.py"),), noise=False, speed=None)
    project.save(tmp_path / "room.kiks")
    text = (tmp_path / "room.kiks").read_text(encoding="utf-8")
    assert text.splitlines()[1:] == [
        "kiks = 1", "seed = 0", 'thinking = "none"', "noise = false", 'speed = "fastest"', 'name = "Room"', "",
        "[[robot]]", 'kind = "khepera"', 'turrets = ["k213"]', 'program = "look.py"', "",
        "[[start]]", "at_mm = [100.0, 150.0]", "heading_deg = 90.0", "",
        "[walls]", "size_mm = [400, 300]", "wall_mm = 10", "rounded_mm = 0", "brightness = 190",
    ]  # fmt: skip
    assert same(Project.load(tmp_path / "room.kiks"), project)
    assert load_arena(str(tmp_path / "room.kiks")).starts == arena.starts
    project.save(tmp_path / "room.kiks")
    assert [path.name for path in tmp_path.iterdir()] == ["room.kiks"]


def test_arenas_are_projects(tmp_path):
    arena = replace(Arena.box(400, 300), starts=(Pose(100, 150, 0), Pose(300, 150, 0)))
    save_kad(arena, tmp_path / "room.kad")
    assert len(Project.load(tmp_path / "room.kad").robots) == 2
    assert Project.load(EXAMPLES / "maze.toml").arena.lamps
    assert len(Project.load(EXAMPLES / "maze.png").robots) == 1


BASE = "kiks = 1\n[walls]\nsize_mm = [300, 300]\n"


def test_bad_files_and_names_and_links_that_leave_the_folder_are_refused(tmp_path):
    for text, words in (
        ("", "kiks must be 1, the version of this format, but it is not there"),
        ("kiks = 2\n", "newer"),
        ("kiks = 1\n", "size_mm"),
        ("[[robot]]\ntrurets = []\n" + BASE.replace("kiks = 1\n", ""), "kiks must be"),
        (BASE + "[[robot]]\ntrurets = []\n", "robot 1.*Did you mean 'turrets'"),
        ("thinking = 'fats'\n" + BASE, "thinking"),
        ("thinking = 'replay:/etc/passwd'\n" + BASE, "replay"),
        ("response = 'tesis'\n" + BASE, "Did you mean 'thesis'"),
        ("speed = 0\n" + BASE, "speed"),
        ("speed = 'slow'\n" + BASE, "speed"),
        (BASE + "[[robot]]\nkind = '../mine.toml'\n", "robot 1.*folder"),
        (BASE + "[[robot]]\nturrets = ['gun']\n", r"robot 1: turrets\[0\] must be 'k213', .* but it was 'gun'"),
        (BASE + "[[robot]]\nturrets = ['io', 'io']\n", "differ"),
        (BASE + "[[robot]]\nprogram = '/bin/a.py'\n", "program"),
        (BASE + "[[robot]]\narguments = [7]\n", r"robot 1: arguments\[0\] must be a text"),
        (BASE + "[[robot]]\n" * (ROBOTS_MAX + 1), "robot must have at most 1000 items"),
        (BASE + "[[lamp]]\nat_mm = [5, 5]\n" * (THINGS_MAX + 1), "lamp must have at most 1000 items"),
        (BASE + "[[ball]]\nat_mm = [5, 5]\n", "ball 1"),
        (BASE + "png = 'aaaa'\n", "either"),
        ("kiks = 1\n[walls]\npng = '!!'\n", "base64"),
        ("kiks = 1\n[walls]\npng = 'YWJj'\n", "png must be a picture"),
        ("kiks = 1\n[walls]\nmm_per_cell = 1\n", "png"),
        ("kiks = 1\nwalls = 3\n", "walls"),
    ):
        refused(words, Project.from_bytes, text.encode(), error=ArenaError)
    refused("UTF-8", Project.from_bytes, b"\xff\xfe", error=ArenaError)
    refused("at most", Project.from_bytes, bytes(PROJECT_FILE_BYTES_MAX + 1), error=ArenaError)
    refused(r"\.kiks", Project().save, tmp_path / "none.toml")
    refused("can be written", Project().save, tmp_path / "none" / "a.kiks")
    names = ["", "..", "/a", "a/../../b", "a//b", "../a", "a/", "C:a", "C:\\a", "a\\b", "a\0b", "a\nb", "x" * 2000]
    for name in (*names, 3, None):
        refused("folder", check_relative, name, "program")
    home = tmp_path / "home"
    home.mkdir()
    (tmp_path / "secret.py").write_text("")
    os.symlink(tmp_path, home / "up")
    os.symlink(tmp_path / "secret.py", home / "a.py")
    os.symlink(home / "loop", home / "loop")
    for name in ("a.py", "up/secret.py", "up"):
        refused("elsewhere", inside, home, name, "program")
    assert inside(home, "b.py", "program") == (home / "b.py").resolve()


def test_a_world_is_built_from_a_project(tmp_path):
    (tmp_path / "times.txt").write_text("5000000\n")
    arena = replace(Arena.box(500, 400), starts=(Pose(100, 100, 0), Pose(300, 100, 1)), balls=(Ball(400, 300),))
    project = Project(
        arena,
        robots=(ProjectRobot(turrets=("gripper", "radio")), ProjectRobot("khepera_ii", turrets=("k213",))),
        seed=3,
        thinking="replay:times.txt",
        baud=38400,
        noise=False,
    )
    sim = simulation_of(project, tmp_path)
    assert sim.poses().tolist() == [list(pose) for pose in arena.starts]
    assert [spec.name for spec in sim.specs] == ["Khepera", "Khepera II"]
    assert [wire.line.baud for wire in sim.wires] == [38400, 38400]
    assert [len(wire.firmware.fitted) for wire in sim.wires] == [2, 1]
    assert len(sim.bodies()) == 1
    assert sim.seed == 3
    refused("none.txt", simulation_of, replace(project, thinking="replay:none.txt"), tmp_path)


def test_a_robot_of_a_file_keeps_its_name_in_a_project(tmp_path):
    mine = replace(RobotSpec.load("khepera_ii"), name="Mine").with_changes(body__diameter_mm=80.0)
    project = with_kinds(Project(), [mine])
    project.save(tmp_path / "mine.kiks")
    sim = simulation_of(Project.load(tmp_path / "mine.kiks"), tmp_path)
    assert list(sim.specs) == [mine]
    sim.port(1).write(b"restart\n")
    assert sim.port(1).readline() == b"KiKS, Mine\r\n"


def test_a_robot_without_noise_reads_the_same_again():
    arena = replace(Arena.box(300, 300), starts=(Pose(260, 150, 0),), lamps=(Lamp(200, 200),))

    def readings(noise: bool) -> list[list[object]]:
        sim = simulation_of(Project(arena, robots=(ProjectRobot(turrets=("k213",)),), noise=noise))
        rows = []
        for _ in range(5):
            sim.run(0.5)
            port = sim.port(1)
            port.write(b"T,2,N\n")
            rows.append([sim.proximity(1, noise=True), sim.ambient(1, noise=True), port.readline()])
        return rows

    quiet, noisy = readings(noise=False), readings(noise=True)
    for kind in range(3):
        assert all(row[kind] == quiet[0][kind] for row in quiet)
        assert any(row[kind] != noisy[0][kind] for row in noisy)
    spec = RobotSpec.load("khepera")
    assert spec.is_noisy
    assert not spec.without_noise().is_noisy


@pytest.mark.slow
@settings(max_examples=share(3, 8))
@given(st.integers(0, 10**6))
@example(35608)
def test_moved_things_are_kept(seed):
    rng = np.random.default_rng(seed)
    sim = Simulation(Arena.box(350, 350, rounded_mm=120), robots=5, seed=seed)
    for _ in range(4):
        place = rng.uniform(80, 270, 2)
        with suppress(ParameterError):
            sim.add_cylinder(*place)
    sim.add_lamp(20, 20, 2.0, is_on=False)
    for robot in range(1, 6):
        left, right = rng.integers(-60, 61, 2)
        sim.port(robot).write(b"D,%d,%d\n" % (left, right))
    sim.run(float(rng.uniform(1, 12)))
    project = project_of(sim, Project(sim.arena, robots=(ProjectRobot(),) * 5))
    again = simulation_of(Project.from_bytes(project.to_bytes()))
    assert np.allclose(again.poses()[:, :2], sim.poses()[:, :2], atol=0.001)
    assert np.allclose(np.cos(again.poses()[:, 2] - sim.poses()[:, 2]), 1)
    assert np.allclose(again.bodies()["x_mm"], sim.bodies()["x_mm"], atol=0.001)
    assert again.lamps.tolist() == [[20, 20, 2.0, 0]]


def test_what_a_gripper_holds_up_is_put_down():
    sim = Simulation(Arena.box(400, 300), seed=1)
    sim.place(1, 200, 150, 0.0)
    sim.add_cylinder(245, 150)
    sim.fit(1, "gripper")
    port = sim.port(1)
    for order, seconds in ((b"T,1,E,255\n", 1.0), (b"T,1,D,1\n", 1.0), (b"T,1,E,127\n", 1.0)):
        port.write(order)
        sim.run(seconds)
    assert sim.bodies()["is_lifted"][0]
    sim.place(1, 355, 150, 0.0)
    (cylinder,) = project_of(sim, Project(sim.arena)).arena.cylinders
    assert math.dist(cylinder[:2], (355, 150)) >= 27.5 + 16 - 0.01
    assert sim.arena.free_for(cylinder.x_mm, cylinder.y_mm, 15.99)


def test_equal_walls_change_nothing_and_others_can_be_put_around_everything():
    """In the middle of a run the walls are replaced by the same ones."""
    hashes = set()
    for arena_at in (5.0, 0.0, None):
        sim = Simulation(Arena.box(300, 260, rounded_mm=60), robots=3, seed=5)
        sim.add_ball(60, 60)
        sim.fit(1, "k213")
        for robot in (1, 2, 3):
            sim.port(robot).write(b"D,%d,%d\n" % (20 + robot, 14))
        for step in range(40):
            sim.run(0.25)
            if step * 0.25 == arena_at:
                sim.set_arena(Arena.box(300, 260, rounded_mm=60))
        hashes.add(sim.state_hash())
    assert len(hashes) == 1
    sim = Simulation(Arena.box(400, 400), seed=1)
    sim.place(1, 100, 200, 0.0)
    sim.add_cylinder(300, 300)
    port = sim.port(1)
    port.write(b"D,10,10\n")
    sim.run(1.0)
    time_s, poses, hash_before = sim.time_s, sim.poses(), sim.state_hash()
    blocked = Arena.box(400, 400).brightness.copy()
    blocked[290:310, 290:310] = 200
    for arena, words in (
        (Arena.box(400, 150), "robot 1"),
        (Arena(blocked, 1.0, "blocked"), "cylinder 1"),
        (Arena.box(280, 400), "cylinder 1"),
    ):
        refused(words, sim.set_arena, arena)
        assert sim.arena.width_mm == 400
        assert sim.state_hash() == hash_before
    walled = Arena.box(700, 400).brightness.copy()
    walled[:, 240:245] = 255
    sim.set_arena(Arena(walled, 1.0, "walled"))
    assert (sim.time_s, sim.poses().tolist()) == (time_s, poses.tolist())
    assert max(sim.proximity(1)) < 20
    sim.run(20.0)
    assert sim.pose(1)[0] == pytest.approx(240 - 27.5, abs=0.1)
    assert max(sim.proximity(1)) > 500
    sim.place(1, 600, 200, 0.0)

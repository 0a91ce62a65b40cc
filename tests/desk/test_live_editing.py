"""Drawing in a running world: edits act at once, refused edits change nothing, and all edits can be undone."""

import asyncio
import math
from collections.abc import Awaitable, Callable, Iterator
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kiks.desk.server import live_editing
from kiks.desk.server.desk import Desk
from kiks.desk.server.live_content import Robot
from kiks.desk.server.live_editing import Editing
from kiks.desk.server.rights import Rights
from kiks.errors import KiksError, LinkError, ParameterError
from kiks.model import brush
from kiks.model.arena import Arena, Ball, Cylinder, Lamp, Pose, Wall
from kiks.model.exercise import Exercise
from kiks.model.project import Project, ProjectRobot
from kiks.recording.recording import Recording
from kiks.recording.replay import check_recording
from kiks.run import Run
from kiks.sim.simulation import Simulation
from kiks.units import ns_from_s

pytestmark = pytest.mark.anyio


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    things = {"balls": (Ball(300, 300),), "cylinders": (Cylinder(400, 100),), "lamps": (Lamp(50, 350),)}
    arena = replace(Arena.box(500, 400), starts=(Pose(100, 100, 0.0),), **things)
    project = Project(arena, robots=(ProjectRobot(turrets=("k213",), name="Ada"),), seed=4, speed=None)
    desk = Desk(Run(project, tmp_path), Rights(owns_world=True), folder=tmp_path)
    yield desk
    desk.clear_away()
    desk.close()


@pytest.fixture
def editing(desk: Desk) -> Editing:
    return Editing(desk)


def line(editing: Editing) -> Awaitable[None]:
    return editing.draw(lambda arena: brush.line(arena, [(200, 10), (200, 200)], width_mm=6))


def rectangle(editing: Editing, *corners_mm: float, brightness: int = 255) -> Awaitable[None]:
    return editing.draw(lambda arena: brush.rectangle(arena, *corners_mm, brightness))


def counts(desk: Desk) -> tuple[int, int, int]:
    return desk.sim.robot_count, len(desk.sim.bodies()), len(desk.sim.lamps)


def places(desk: Desk) -> list[float]:
    return sorted(desk.sim.bodies()["x_mm"].tolist())


async def step(act: Callable[[], Awaitable[None]], count: int) -> None:
    for _ in range(count):
        await act()


def test_walls_appear_in_the_running_world(desk, editing):
    sim, scene = desk.sim, desk.scene
    sim.port(1).write(b"D,5,5\n")
    sim.run(1.0)
    time_s, pose = sim.time_s, sim.pose(1)
    asyncio.run(line(editing))
    assert (desk.sim is sim, sim.time_s, sim.pose(1)) == (True, time_s, pose)
    assert sim.arena.brightness[100, 200] == 255
    assert desk.scene > scene
    sim.run(20.0)
    assert sim.pose(1)[0] == pytest.approx(197 - 27.5, abs=0.2)


async def test_undo_and_redo_change_the_world(desk, editing):
    sim = desk.sim
    before = sim.arena.brightness.copy()
    await line(editing)
    await editing.undo()
    assert np.array_equal(sim.arena.brightness, before)
    assert editing.can_redo
    await editing.redo()
    assert sim.arena.brightness[100, 200] == 255
    for thing in (Ball(430, 320), Lamp(20, 20, 2.0)):
        await editing.place(thing)
    assert counts(desk) == (1, 3, 2)
    for place in ((400, 105), (50, 352)):
        await editing.remove(*place)
    assert (places(desk), sim.lamps.tolist()) == ([300, 430], [[20, 20, 2.0, 1.0]])
    await step(editing.undo, 4)
    assert (places(desk), sim.lamps.tolist()) == ([300, 400], [[50, 350, 1.0, 1.0]])
    await step(editing.redo, 9)
    assert (counts(desk), places(desk)) == ((1, 2, 1), [300, 430])


async def test_refused_edits_change_nothing(desk, editing):
    sim = desk.sim
    before, hash_before = sim.arena, sim.state_hash()
    for act, words in (
        (rectangle(editing, 90, 90, 110, 110), "robot 1"),
        (editing.place(Ball(100, 100)), "robot 1"),
        (editing.remove(250, 20), "nothing"),
        (editing.place(Robot(10, 200)), "wall"),
    ):
        with pytest.raises(KiksError, match=words):
            await act
        assert sim.arena is before
        assert (sim.state_hash(), editing.can_undo, editing.can_redo) == (hash_before, False, False)


async def test_an_edit_that_the_world_refuses_is_undone(desk, editing, monkeypatch):
    def refuse(_arena: Arena) -> None:
        raise ParameterError("no room")

    for act, can_redo in ((lambda: line(editing), False), (editing.redo, True)):
        with monkeypatch.context() as full:
            full.setattr(desk.sim, "set_arena", refuse)
            with pytest.raises(ParameterError, match="no room"):
                await act()
        assert (editing.can_undo, editing.can_redo) == (False, can_redo)
        await line(editing)
        await editing.undo()


async def test_edits_leave_what_has_moved_where_it_is_and_steps_back_wait_until_there_is_room(desk, editing):
    await line(editing)
    await rectangle(editing, 190, 10, 210, 300, brightness=0)
    desk.sim.place(1, 200, 150, 0.0)
    with pytest.raises(KiksError, match="robot 1"):
        await editing.undo()
    assert not desk.sim.arena.brightness[100, 200]
    desk.sim.place(1, 400, 300, 0.0)
    await editing.undo()
    assert desk.sim.arena.brightness[100, 200]
    desk.sim.move_body(1, 50, 50)
    with pytest.raises(KiksError, match="robot 1"):
        await rectangle(editing, 390, 290, 410, 310)
    await rectangle(editing, 95, 95, 105, 105)
    assert editing.can_undo
    await step(editing.undo, 2)
    assert not editing.can_undo


async def test_changes_from_outside_are_noticed(desk, editing):
    await line(editing)
    desk.sim.remove_body(1)
    desk.sim.add_lamp(300, 50)
    await editing.remove(300, 50)
    assert counts(desk) == (1, 1, 1)
    await editing.undo()
    assert (counts(desk), editing.can_undo) == ((1, 1, 2), False)


async def test_resets_keep_the_drawing(desk, editing):
    desk.sim.place(1, 400, 300, 0.0)
    await rectangle(editing, 50, 50, 150, 150)
    desk.sim.place(1, 250, 200, 0.0)
    for act in (desk.do(desk.reset), desk.start_over()):
        await act
        assert desk.sim.pose(1)[:2] == (400, 300)
    assert desk.sim.arena.brightness[100, 100] == 255


async def test_adding_a_robot_restarts_the_world_and_the_last_one_may_go_and_come_back(desk, editing):
    first = desk.sim
    await line(editing)
    await editing.place(Robot(400, 300, 1.0, ProjectRobot("khepera_ii")))
    assert desk.sim is not first
    assert [spec.name for spec in desk.sim.specs] == ["Khepera", "Khepera II"]
    assert desk.sim.pose(2) == pytest.approx((400, 300, 1.0), abs=1e-4)
    assert desk.names() == ["Ada", "2"]
    await editing.remove(100, 100)
    assert [spec.name for spec in desk.sim.specs] == ["Khepera II"]
    await editing.undo()
    assert desk.names() == ["Ada", "2"]
    assert len(desk.sim.wires[0].firmware.fitted) == 1
    await step(editing.undo, 2)
    assert (counts(desk), desk.sim.arena.brightness[100, 200], editing.can_undo) == ((1, 2, 1), 0, False)
    await editing.remove(100, 100)
    assert (counts(desk), desk.project.robots) == ((0, 2, 1), ())
    await rectangle(editing, 90, 90, 110, 110)
    await step(editing.undo, 2)
    assert (desk.names(), desk.sim.pose(1)[:2]) == (["Ada"], (100, 100))
    assert len(desk.sim.wires[0].firmware.fitted) == 1


async def test_another_arena_keeps_the_robots(desk, editing):
    await editing.begin(Arena.maze(columns=3, rows=3))
    assert desk.sim.arena.name == "maze"
    assert counts(desk) == (1, 0, 1)
    assert len(desk.sim.wires[0].firmware.fitted) == 1
    await editing.draw(lambda arena: brush.line(arena, [(500, 50)], width_mm=30, brightness=0))
    await step(editing.undo, 2)
    assert (counts(desk), desk.sim.arena.width_mm) == ((1, 2, 1), 500)


async def test_a_world_of_another_program_keeps_its_robots():
    sim = Simulation(Arena.box(500, 400), robots=2, seed=1)
    desk = Desk(Run.in_world(sim))
    editing = Editing(desk)
    await line(editing)
    assert sim.arena.brightness[100, 200] == 255
    for act in (editing.place(Robot(400, 300)), editing.begin(Arena.box(300, 300))):
        with pytest.raises(LinkError, match="own"):
            await act
        assert (editing.can_undo, desk.sim is sim) == (True, True)
    await editing.undo()
    assert (sim.arena.brightness[100, 200], editing.can_undo) == (0, False)
    desk.close()


async def test_two_people_may_draw_at_once(desk, editing):
    strokes = [
        editing.draw(lambda arena, y=y: brush.line(arena, [(240, y), (260, y)], width_mm=4, brightness=y))
        for y in range(20, 240, 40)
    ]
    await asyncio.gather(*strokes)
    assert [int(desk.sim.arena.brightness[y, 250]) for y in range(20, 240, 40)] == [*range(20, 240, 40)]


async def test_steps_back_find_their_things_whatever_their_order(desk, editing):
    await editing.place(Ball(430, 320))
    await editing.remove(300, 300)
    await editing.undo()  # comes back as the last one
    desk.sim.move_body(int(desk.sim.bodies()["number"][-1]), 250, 200)
    await editing.undo()
    assert places(desk) == [250, 400]
    await step(editing.redo, 2)
    assert places(desk) == [400, 430]


async def test_steps_beyond_the_limit_are_forgotten(desk, monkeypatch, editing):
    monkeypatch.setattr(live_editing, "STEPS_MAX", 2)
    for x_mm in range(200, 205):
        await editing.draw(lambda arena, x_mm=x_mm: brush.line(arena, [(x_mm + 0.5, 50.5)], width_mm=1))
    for _ in range(2):
        assert editing.can_undo
        await editing.undo()
    assert not editing.can_undo
    assert np.count_nonzero(desk.sim.arena.brightness[50, 200:205]) == 3


async def test_robots_beyond_the_starts_of_another_arena_find_room(desk, editing):
    await editing.place(Robot(400, 300))
    await editing.begin(Arena.maze(columns=3, rows=3))
    assert desk.sim.pose(1) == pytest.approx(Arena.maze(columns=3, rows=3).starts[0])
    arena = desk.sim.arena
    assert all(arena.free_for(*start[:2], 27.4) for start in arena.starts)
    with pytest.raises(KiksError, match="room for robot 1"):
        await editing.begin(Arena.box(100, 100, wall_mm=30))


async def test_properties_of_anything_change_in_the_running_world_and_the_recording_replays(desk, editing, tmp_path):
    await line(editing)
    sim = desk.sim
    recorder = sim.record(tmp_path / "run.mcap")
    sim.port(1).write(b"D,3,3\n")
    sim.run(1.5)
    robot, ball, lamp = [await editing.select(what, 0, 0, 0) for what in ("robot", "body", "lamp")]
    cylinder, wall = await editing.select("body", 1, 0, 0), await editing.select("floor", -1, 200, 100)
    assert wall == Wall(line_mm=((200, 10), (200, 200)), width_mm=6)
    assert await editing.select("floor", -1, 250, 250) is None

    await editing.change(robot, name="Grace")
    await editing.change(ball, radius_mm=20, brightness="wood")
    await editing.change(cylinder, x_mm=410, friction_mm_s2=300)
    await editing.change(lamp, power_w=4, is_on=False)
    wall = await editing.change(wall, line_mm=((200, 10), (200, 150)))
    pose = sim.pose(1)
    assert pose[0] > 120  # it has driven on
    sim.run(1.5)
    await editing.change(robot, x_mm=120, y_mm=300, heading_deg=90)
    assert sim.pose(1) == pytest.approx((120, 300, math.pi / 2))
    sim.run(1.5)
    recorder.close()
    assert sim is desk.sim
    assert desk.names() == ["Grace"]
    bodies = sim.bodies()[["x_mm", "radius_mm", "brightness", "friction_mm_s2"]].tolist()
    assert bodies == [(300, 20, 190, 20), (410, 16, 190, 300)]
    assert (sim.lamps.tolist(), sim.arena.walls) == ([[50, 350, 4, 0]], (wall,))
    assert not sim.arena.brightness[180, 200]
    assert check_recording(Recording(tmp_path / "run.mcap").log).differs_ns is None

    saved = Project.from_bytes((await desk.project_to_save("mine.kiks"))[0].to_bytes())
    assert saved.robots[0].name == "Grace"
    assert saved.arena.lamps == (Lamp(50, 350, 4, False),)
    assert saved.arena.balls == (Ball(300, 300, 20, 20, 190),)
    await step(editing.undo, 6)
    assert (sim.lamps.tolist(), desk.names()) == ([[50, 350, 1, 1]], ["Ada"])
    assert sim.bodies()[["x_mm", "radius_mm", "brightness"]].tolist() == [(300, 32, 255), (400, 16, 190)]
    assert sim.pose(1)[:2] == pytest.approx(pose[:2], abs=60)
    await editing.redo()
    assert desk.names() == ["Grace"]


async def test_bad_properties_are_refused_in_one_line(desk, editing):
    await line(editing)
    before = desk.sim.state_hash(), desk.sim.arena, desk.sim.world.lamps.tobytes()
    for what, index, values, message in (
        ("lamp", 0, {"power_w": 0}, r"lamp: power_w must be greater than 0, but it was 0\. A Khepera lamp has 1 W"),
        ("lamp", 0, {"power_w": "much"}, r"lamp: power_w must be a number, but it was 'much'"),
        ("lamp", 0, {"power_w": math.nan}, r"lamp: power_w must be .*, but it was nan"),
        ("lamp", 0, {"x_mm": 900}, r"lamp 1 must lie inside the arena, but it is at \(900, 350\) mm"),
        ("body", 0, {"radius_mm": 101}, r"ball: radius_mm must be .* 100, but it was 101"),
        ("body", 0, {"radius_mm": 95}, r"the place of body 1 must be free"),
        ("body", 1, {"brightness": "green"}, r"cylinder: brightness must be"),
        ("body", 1, {"x_mm": 3}, r"cylinder 1 must stand on floor"),
        ("body", 1, {"x_mm": 12}, r"the place of body 2 must be free"),
        ("robot", 0, {"y_mm": 12}, r"the place of robot 1 must be free"),
        ("robot", 0, {"heading_deg": "up"}, r"robot: heading_deg must be a number"),
        ("floor", -1, {"width_mm": 0}, r"wall: width_mm must be greater than 0"),
        ("floor", -1, {"line_mm": ((900, 1), (901, 1))}, r"wall 1 must cover a part of the arena"),
        ("floor", -1, {"line_mm": ((100, 100), (110, 100))}, r"The walls must leave room|must stand on floor"),
    ):
        selected = await editing.select(what, index, 200, 100)
        with pytest.raises(KiksError, match=message) as caught:
            await editing.change(selected, **values)
        assert "\n" not in str(caught.value)
        assert (desk.sim.state_hash(), desk.sim.arena, desk.sim.world.lamps.tobytes()) == before


async def test_what_has_gone_cannot_be_changed_and_walls_are_removed_by_a_click(desk, editing):
    await line(editing)
    lamp, wall = await editing.select("lamp", 0, 0, 0), await editing.select("floor", -1, 200, 100)
    await editing.remove(50, 350)
    assert await editing.properties(lamp) is None
    with pytest.raises(ParameterError, match=r"it has gone\. Select something else"):
        await editing.change(lamp, power_w=3)
    await editing.remove(200, 100)
    assert desk.sim.arena.walls == ()
    await editing.undo()
    await editing.remove_selected(wall)
    assert desk.sim.arena.walls == ()


@pytest.mark.parametrize("may_edit", [False, True])
async def test_lock_holds_in_the_server(tmp_path: Path, may_edit: bool) -> None:
    arena = replace(Arena.box(800, 400), starts=(Pose(100, 200, 0.0),), lamps=(Lamp(700, 200),))
    project = Project(arena, exercise=Exercise("To the lamp"))
    desk = Desk(Run(project, tmp_path), Rights(owns_world=True, may_edit=may_edit), folder=tmp_path)
    editing = Editing(desk)
    lamp = await editing.select("lamp", 0, 0, 0)
    acts = {
        "grab": lambda: desk.grab("a browser", "robot", 0),
        "draw": lambda: editing.draw(lambda arena: brush.disc(arena, (400, 300), 20, 255)),
        "place": lambda: editing.place(Lamp(400, 100)),
        "change": lambda: editing.change(lamp, power_w=3.0),
        "remove": lambda: editing.remove(700, 200),
        "begin": lambda: editing.begin(Arena.box(500, 500)),
        "settings": lambda: desk.alter(replace(project, noise=False)),
    }
    before = desk.sim.state_hash()
    for name, act in acts.items():
        with nullcontext() if may_edit else pytest.raises(KiksError, match="it is locked"):
            await act()
        assert may_edit or (desk.sim.state_hash(), desk.project.noise) == (before, True), name
    assert desk.project.noise is not may_edit
    desk.close()


async def test_going_on_from_a_past_keeps_the_steps_up_to_there(desk: Desk, editing: Editing) -> None:
    desk.looking.start_history()
    await line(editing)
    walls = desk.sim.arena.brightness
    desk.sim.run(1)
    await editing.place(Ball(250, 200))
    await editing.undo()
    desk.sim.run(1)
    await editing.place(Lamp(250, 200))
    for time_s, steps in ((1.5, (True, True)), (1.0, (True, True)), (0.5, (True, False))):
        await desk.looking.look_at(ns_from_s(time_s))
        assert not editing.can_undo
        await desk.go_on_from_here()
        assert (editing.can_undo, editing.can_redo) == steps
        await editing.undo()
        assert not desk.sim.arena.brightness[100, 200]
        await editing.redo()
        assert np.array_equal(desk.sim.arena.brightness, walls)
        await editing.redo()
        assert counts(desk) == (1, 2 + steps[1], 1)
    await rectangle(editing, 300, 10, 310, 50)
    await step(editing.undo, 2)
    assert not editing.can_undo

"""Frames contain the state of the simulation, as a slow and obvious parser reads it."""

import io
import math
import struct
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from kiks import Arena, Simulation
from kiks.engine.sensing.frame_parts import NO_HIT
from kiks.export.frames import arena_picture, describe_scene, describe_shapes, pack_frame
from kiks.model.arena_objects import Ball, Cylinder, Lamp, Pose

WALL_MM = 10.0
"""Thickness of the walls of a box."""


def read_frame(data: bytes) -> SimpleNamespace:
    file = io.BytesIO(data)

    def take(code: str, count: int = 1):
        values = struct.unpack(f"<{count}{code}", file.read(struct.calcsize(f"<{count}{code}")))
        return values[0] if count == 1 else list(values)

    frame = SimpleNamespace(version=take("B"), kind=take("B"), flags=take("H"), scene=take("I"), time_s=take("d"))
    frame.speed_now, frame.speed_average = take("f"), take("f")
    robots, bodies, lamps, cameras = take("H", 4)
    assert file.tell() == 32
    frame.robots = []
    for _ in range(robots):
        robot = SimpleNamespace(pose=take("f", 3), measured=take("f", 2), commanded=take("f", 2), flags=take("I"))
        robot.arm, robot.jaws, robot.contacts = take("f"), take("f"), take("I")
        robot.encoders, robot.distances = take("i", 2), take("f", 3)
        robot.proximity, robot.ambient = take("f", 8), take("f", 8)
        frame.robots.append(robot)
    assert file.tell() == 32 + 128 * robots
    frame.bodies = [take("f", 3) for _ in range(bodies)]
    frame.lamps = [take("f", 4) for _ in range(lamps)]
    frame.cameras = [(take("H"), take("H"), take("B", 64)) for _ in range(cameras)]
    for robot in frame.robots:
        robot.rays = [take("H", 7) for _ in range(8)]
    assert not file.read()
    return frame


def busy_world(**changes) -> Simulation:
    """Return a world with all there is to be packed, some seconds into its run."""
    starts = (Pose(80, 100, 0.3), Pose(200, 100, 2.0), Pose(300, 300, -1.0), Pose(480, 200, 4.0))
    bodies = {"balls": (Ball(160, 240),), "cylinders": (Cylinder(400, 100), Cylinder(520, 320, 12.0))}
    lamps = (Lamp(50, 350, 2.0), Lamp(550, 50, 1.0, False))
    arena = replace(Arena.box(600, 400, rounded_mm=50), name="busy", starts=starts, lamps=lamps, **bodies)
    kinds = ["khepera", "khepera_ii", "khepera", "khepera_ii"]
    sim = Simulation(arena, seed=4, robot=kinds, **changes)
    for robot, turret in enumerate(("radio", "k213", "gripper", "k213"), 1):
        sim.fit(robot, turret)
    for robot, line in enumerate((b"D,10,-6\n", b"D,7,9\n", b"C,1000,-700\n", b",20,30\n"), 1):
        sim.port(robot).write(line)
    for line in (b"L,1,1\n", b"G,-70000,12\n", b"T,2,N\n"):
        sim.port(2).write(line)
    for line in (b"T,1,E,200\n", b"T,1,D,1\n"):
        sim.port(3).write(line)
    sim.port(4).write(b",\n")
    sim.run(1.2)
    sim.port(4).write(b"L,0,1\n")
    sim.run(0.9234)
    return sim


def test_a_frame_contains_the_state_of_the_simulation():
    sim = busy_world()
    sim.wires[1].holder = "somebody"
    held = {("robot", 2)}
    said = {"is_paused": True, "speed_now": 3.5, "speed_average": 2.25}
    with sim.lock:
        frame = read_frame(pack_frame(sim, scene=7, is_held=lambda *what: what in held, **said))
    assert (frame.version, frame.kind, frame.flags, frame.scene) == (2, 1, 1, 7)
    assert (frame.time_s, frame.speed_now, frame.speed_average) == (sim.time_s, 3.5, 2.25)
    assert len(frame.robots) == 4
    for number, robot in enumerate(frame.robots, 1):
        record = sim.world.state.robots[0, number - 1]
        assert robot.pose == pytest.approx(sim.pose(number), rel=1e-6)
        assert (robot.measured, robot.contacts) == (record["measured_speed"].tolist(), sim.contacts(number))
        assert robot.distances == pytest.approx(sim.distances_mm()[number - 1], rel=1e-6)
        assert robot.proximity == sim.proximity(number, noise=True)
        assert robot.ambient == sim.ambient(number, noise=True)
        assert (robot.arm, robot.jaws) == (np.float32(record["arm"]), np.float32(record["jaws"]))
        bits = {0: record["is_touching"], 3: number == 3, 4: number == 2, 16: record["led"][0], 17: record["led"][1]}
        assert robot.flags == sum(1 << k for k, bit in bits.items() if bit)
        for sensor, lengths in enumerate(sim.rays(number)):
            for ray, length_mm in enumerate(lengths):
                packed = robot.rays[sensor][ray]
                assert packed == NO_HIT if math.isinf(length_mm) else packed / 100 == pytest.approx(length_mm, abs=6e-3)
    assert (frame.robots[0].commanded, frame.robots[1].commanded) == ([10, -6], [7, 9])
    assert frame.robots[2].commanded == sim.world.state.robots["trajectory_speed"][0, 2].tolist()
    assert any(ray != NO_HIT for robot in frame.robots for row in robot.rays for ray in row)
    sim.port(2).write(b"D,0,0\n")
    sim.run(1.0)
    sim.port(2).reset_input_buffer()
    sim.port(2).write(b"H\n")
    replied = [int(part) for part in sim.port(2).readline().decode().strip().split(",")[1:]]
    assert [-60000] > replied == read_frame(pack_frame(sim, scene=1)).robots[1].encoders


def test_bodies_lamps_and_cameras():
    sim = busy_world()
    frame = read_frame(pack_frame(sim, scene=1))
    assert [body[2] for body in frame.bodies] == [0, 0, 0]
    places = np.column_stack([sim.bodies()["x_mm"], sim.bodies()["y_mm"]])
    assert np.allclose([body[:2] for body in frame.bodies], places, atol=5.0)  # the bodies' tick ends up to 10 ms later
    assert frame.lamps == sim.lamps.tolist()
    assert [camera[0] for camera in frame.cameras] == [1, 3]
    for index, light, pixels in frame.cameras:
        camera = sim.turrets(index + 1)[0]
        assert (light, pixels) == (camera.light, camera.pixels)
    sim.world.state.bodies["holder"][0, 1:] = 3
    sim.world.state.bodies["is_lifted"][0, 2] = 1
    assert [body[2] for body in read_frame(pack_frame(sim, scene=1)).bodies] == [0, 1, 2]


def test_counters_wrap_like_the_robots_and_a_motor_on_pwm_has_no_commanded_speed():
    sim = Simulation(Arena.box(400, 400))
    sim.world.state.robots["pulse_count"][0, 0] = (2**31 + 5, -(2**31) - 1)
    frame = read_frame(pack_frame(sim, scene=1, speed_now=math.inf, is_driven=True))
    assert frame.robots[0].encoders == [-(2**31) + 5, 2**31 - 1]
    assert (frame.speed_now, frame.flags) == (0.0, 2), "a speed that is not finite"
    sim.port(1).write(b"P,30,40\n")
    sim.run(0.2)
    frame = read_frame(pack_frame(sim, scene=1))
    assert all(math.isnan(speed) for speed in frame.robots[0].commanded)
    assert all(speed > 0 for speed in frame.robots[0].measured)


def test_a_stepper_has_at_once_the_speed_that_it_is_told_up_to_its_limit():
    sim = Simulation(Arena.box(400, 400), robot=["khepera", "epuck"])
    sim.port(1).write(b"D,10,-10\n")
    sim.port(2).write(b"D,700,-900\n")
    sim.run(0.05)
    sim.world.state.robots["speed_setpoint"][0, 1] = (700, -2000)
    first, second = read_frame(pack_frame(sim, scene=1)).robots
    assert (second.measured, second.commanded) == ([700, -1000], [700, -2000])
    assert first.measured == sim.world.state.robots["measured_speed"][0, 0].tolist() != first.commanded == [10, -10]


@pytest.mark.parametrize("response", [None, "fast"])
def test_watching_does_not_change_the_run(response):
    hashes = []
    for is_seen in (False, True):
        sim = busy_world(response=response)
        if is_seen:
            sim.record_paths(0.05)
            for wire in sim.wires:
                wire.watch(sim.now_ns)
        for _ in range(50):
            sim.run(0.0371)
            if is_seen:
                with sim.lock:
                    pack_frame(sim, scene=1)
                sim.look()
                for sensor in range(8):
                    sim.explain(2, sensor)
                    sim.explain_light(1, sensor)
                sim.rays(3)
        hashes.append(sim.state_hash())
    assert hashes[0] == hashes[1]


def test_the_scene_contains_sensors_and_turrets():
    sim = busy_world()
    scene = describe_scene(sim, 3, names=["a", "b", "c", "d"])
    assert (scene["kind"], scene["scene"], scene["arena"]["name"]) == ("scene", 3, "busy")
    assert (scene["arena"]["width_mm"], scene["arena"]["height_mm"]) == (600, 400)
    robots = scene["robots"]
    assert [robot["name"] for robot in robots] == ["a", "b", "c", "d"]
    assert [robot["has_gripper"] for robot in robots] == [False, False, True, False]
    assert robots[1]["turrets"] == ["K213 linear vision"]
    assert [body["what"] for body in scene["bodies"]] == ["ball", "cylinder", "cylinder"]
    assert describe_shapes(sim)["robots"] == [robot["shapes"] for robot in robots]
    assert robots[2]["shapes"] == []
    assert describe_scene(sim, 4)["robots"][2]["name"] == "3"


def test_rays_from_scene_and_frame_end_on_walls():
    """In a box, a ray from the place and in the direction of the scene ends on a wall."""
    sim = Simulation(Arena.box(300, 300))
    sensors = describe_scene(sim, 1)["robots"][0]["sensors"]
    rng, met = np.random.default_rng(1), 0
    for _ in range(40):
        x, y, heading = rng.uniform(38, 70), rng.uniform(38, 262), rng.uniform(-3, 3)
        sim.place(1, x, y, heading)
        robot = read_frame(pack_frame(sim, scene=1)).robots[0]
        turn = np.array([[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]])
        for sensor, lengths in zip(sensors, robot.rays, strict=True):
            begin = (x, y) + turn @ (sensor["x_mm"], sensor["y_mm"])
            for angle, length in zip(sensor["rays_rad"], lengths, strict=True):
                if length != NO_HIT:
                    end = begin + length / 100 * np.array([math.cos(heading + angle), math.sin(heading + angle)])
                    nearest, next_nearest = sorted(np.minimum(end, 300 - end))
                    # The smooth surface of a raster rounds its corners.
                    assert nearest == pytest.approx(WALL_MM, abs=0.1 if next_nearest > WALL_MM + 5 else 1.0)
                    met += 1
    assert met > 200


def test_the_picture_is_the_raster_with_the_top_row_first():
    cells = np.zeros((120, 140), np.uint8)
    cells[0, :] = 7  # at the top
    cells[50:, :3] = 255
    picture = np.array(Image.open(io.BytesIO(arena_picture(Arena.from_array(cells)))))
    assert (picture == cells).all()


def test_a_world_that_is_shown_does_not_ask_at_each_instant_whether_its_lamps_were_written_to() -> None:
    sim = Simulation(Arena.box(300, 300), seed=1)
    describe_scene(sim, 0)
    pack_frame(sim, scene=0)
    assert not sim.world.lamps_exposed

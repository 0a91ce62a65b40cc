"""The same run again: twice in one process, in another process, and for other processors."""

import hashlib
from collections.abc import Iterator
from typing import Any

import pytest
from llvmlite import binding
from tests.at_length import at_length
from tests.engine.processes import python

from kiks import Arena, Simulation
from kiks.control.senses import SENSES
from kiks.model.arena_objects import Ball, Cylinder, Pose
from kiks.model.robot import RESPONSES
from kiks.model.window import Window
from kiks.sim.pictures import picture

SCRIPT = (b"D,60,57\n", b"P,-255,200\n", b"D,-5,90\n", b"G,0,0\n", b"C,3000,-2000\n", b"D,127,127\n", b"C,-900,-900\n")
LAMPS = ((60.0, 250.0, 1.0), (330.0, 90.0, 4.0), (200.0, 5.0, 2.0))
BALLS, CYLINDERS = ((150.0, 90.0), (320.0, 200.0, 25.0)), ((90.0, 150.0), (250.0, 90.0), (300.0, 130.0, 12.0))
STARTS = ((200.0, 160.0, 0.3), (90.0, 230.0, -1.0))
ORDERS = (b"N\n", b"O\n", b"T,2,N\n", b"T,2,L\n")


def run_record() -> str:
    """Drive two robots with all sensors among balls and cylinders; return every reply and the state hash after each."""
    plain = Arena.box(400, 300, rounded_mm=60)
    things: dict[str, Any] = {"lamps": LAMPS, "balls": tuple(Ball(*each) for each in BALLS)}
    things["cylinders"] = tuple(Cylinder(*each) for each in CYLINDERS)
    things["starts"] = tuple(Pose(*each) for each in STARTS)
    sim = Simulation(Arena(plain.brightness, plain.mm_per_cell, "full", **things), seed=5, robots=2)
    sim.fit(1, "k213")
    sim.fit(2, "k213")
    lines = []
    for number, command in enumerate(SCRIPT * 3):
        port = sim.port(1 + number % 2)
        for line in (command, *ORDERS):
            port.write(line)
            lines.append(f"{port.readline()!r}\n")
        sim.run(1.7)
        for robot in (1, 2):
            expected = (*sim.proximity(robot), *sim.ambient(robot), *sim.image(robot))
            lines.append(" ".join(value.hex() for value in expected) + "\n")
        lines.append(sim.state_hash() + "\n")
        lines.append(hashlib.sha256(picture(sim.world, 0, Window()).tobytes()).hexdigest() + "\n")
        sim.world.state.robots["loudness"], sim.world.state.robots["sound_ends_ns"] = 900.0, sim.now_ns + 10**9
        given = sim.world.scene, 0, int(sim.world.state.tick_count), sim.now_ns
        felt = (SENSES[name].look(*given, is_noisy=False) for name in ("ground", "accelerometer", "microphones"))
        lines.append(" ".join(value.hex() for readings in felt for value in readings.tolist()) + "\n")
    lines += [*every_response(plain), *steppers(plain)]
    assert sim.contacts(1) > 3
    assert sim.contacts(2) > 3
    assert (sim.bodies()["number"] == (1, 2, 3, 4, 5)).all()
    return "".join(lines)


def every_response(arena: Arena) -> Iterator[str]:
    """Yield what robots with each response expect and read as they creep along a wall, and how they end."""
    for response in RESPONSES:
        kind = "khepera_ii" if response == "curve" else "khepera"
        sim = Simulation(arena, seed=6, robot=kind, response=response)
        sim.place(1, 55.0, 100.0, 1.2)
        sim.port(1).write(b"D,4,5\n")
        for _ in range(40):
            sim.run(0.13)
            yield " ".join(value.hex() for value in (*sim.proximity(1), *sim.proximity(1, noise=True))) + "\n"
        yield sim.state_hash() + "\n"


def steppers(arena: Arena) -> Iterator[str]:
    """Yield what e-pucks reply, in lines and in bytes, and how they end: they drive among each other and hit walls."""
    sim = Simulation(arena, seed=7, robot=["epuck", "epuck2"], robots=2)
    for number, (left, right) in enumerate(((700, 650), (-333, 1000), (1000, 1000), (123, -457)) * 3):
        port = sim.port(1 + number % 2)
        port.write(b"D,%d,%d\n\xb2\xb1\xbf\x99\xb3\xab\xaf\x00" % (left, right))
        sim.run(1.3)
        yield port.read(port.in_waiting).hex() + "\n"
        yield sim.state_hash() + "\n"
    assert sim.contacts(1) > 0


@pytest.fixture(scope="module")
def record() -> str:
    return run_record()


def record_of_process(**environment: str) -> str:
    return python("-m", "tests.engine.test_determinism", **environment).stdout


def test_twice_in_one_process(record: str) -> None:
    assert run_record() == record


@pytest.mark.slow
def test_in_another_process(record: str) -> None:
    assert record_of_process() == record


@at_length
@pytest.mark.skipif(not binding.get_host_cpu_features().get("avx512f"), reason="this computer's processor is like that")
def test_for_another_processor(record: str) -> None:
    """For one with AVX2 and nothing wider; `test_bounds.py` takes one without wide vectors."""
    assert record_of_process(NUMBA_CPU_NAME="x86-64-v3", NUMBA_CPU_FEATURES="") == record


if __name__ == "__main__":
    print(run_record(), end="")

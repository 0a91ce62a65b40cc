"""A copy of a simulation goes on as the simulation does, and neither changes the other."""

import copy
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import kiks
from kiks.errors import ParameterError
from kiks.firmware.turret import Turret
from kiks.model.exercise import Case
from kiks.model.project import Project
from kiks.sim.from_project import in_case, simulation_of


def begun(thinking: str = "fixed:2") -> tuple[kiks.Simulation, list[kiks.Khepera]]:
    sim = kiks.Simulation(kiks.Arena.load("pillars"), robots=2, seed=3, thinking=thinking)
    sim.fit(1, "gripper")
    sim.add_lamp(100, 100)
    robots = [kiks.Khepera(sim.port(number)) for number in (1, 2)]
    for robot in robots:
        robot.set_speed(5, 4)
        robot.proximity()
    sim.run(0.5)
    return sim, robots


def gone_on(sim: kiks.Simulation, robots: list[kiks.Khepera]) -> tuple[Any, ...]:
    """Drive on; return all that a program and a user see."""
    seen = []
    for number in range(10):
        for robot in robots:
            robot.set_speed(number, 5)
            seen.append(robot.proximity())
            robot.pause(0.033)
    sim.run(1.0)
    return seen, sim.state_hash(), sim.time_s, sim.lamps.tolist(), sim.contacts(1), sim.arena, sim.spec.name


@pytest.mark.parametrize("copied", [copy.deepcopy, copy.copy, lambda sim: pickle.loads(pickle.dumps(sim))])
def test_a_copy_goes_on_as_its_original(copied: Callable[[Any], Any]) -> None:
    sim, robots = begun()
    twin = copied(sim)
    before = sim.state_hash()
    there = gone_on(twin, [kiks.Khepera(twin.port(number)) for number in (1, 2)])
    assert sim.state_hash() == before != twin.state_hash()
    *here, _, _ = gone_on(sim, robots)
    assert here == list(there[:-2])


def test_robots_are_copied_with_their_simulation() -> None:
    sim, robots = begun()
    robots[0].port.timeout = 0.25
    twin, twins = copy.deepcopy((sim, robots))
    assert (twins[0].port.sim, twins[0].port.timeout) == (twin, 0.25)
    assert gone_on(sim, robots)[:4] == gone_on(twin, twins)[:4]
    sim, robots = begun("none")
    robots[0].port.write(b"N\n")  # a command on its way is answered in the copy
    twin, (first, _) = copy.deepcopy((sim, robots))
    assert first.port.readline() == robots[0].port.readline()
    assert twin.state_hash() == sim.state_hash()


class Dice(Turret):
    number, name = 24, "Dice"


def test_unread_replies_and_turrets_of_a_user_are_refused() -> None:
    sim, robots = begun()
    robots[1].port.write(b"N\n")
    sim.run(0.1)
    with pytest.raises(ParameterError, match="must have no unread replies to be copied, but robot 2 has sent some"):
        pickle.dumps(sim)
    sim, _ = begun()
    sim.fit(2, Dice())
    with pytest.raises(ParameterError, match="no turrets of a user's own to be copied, but robot 2 has <Dice: turr"):
        copy.deepcopy(sim)


def test_what_never_changes_is_shared() -> None:
    sim, _ = begun()
    assert copy.deepcopy(sim).arena is sim.arena
    for thing in (sim.arena, sim.spec, kiks.measures.contacts, kiks.controllers.linear(), kiks.tasks.avoid()):
        assert copy.deepcopy(thing) is thing


def test_the_line_of_a_case_has_its_speed_whatever_a_program_sets() -> None:
    project = Project.from_bytes(in_case(Project(), Case(baud=38400), Path()).to_bytes())
    sim = simulation_of(project)
    for each in (sim, copy.copy(sim)):
        each.port(1).baudrate = 9600
        assert each.wires[0].line.baud == 38400
    free = simulation_of(in_case(Project(baud=38400), Case(seed=2), Path()))
    free.port(1).baudrate = 9600
    assert free.wires[0].line.baud == 9600

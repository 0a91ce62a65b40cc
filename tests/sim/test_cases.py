"""Cases: what a world has in place of the project's own."""

from __future__ import annotations

import copy
from pathlib import Path

from kiks.model.exercise import Case
from kiks.model.project import Project
from kiks.sim.from_project import in_case, simulation_of


def test_the_line_of_a_case_has_its_speed_whatever_a_program_sets() -> None:
    project = Project.from_bytes(in_case(Project(), Case(baud=38400), Path()).to_bytes())
    sim = simulation_of(project)
    for each in (sim, copy.copy(sim)):
        each.port(1).baudrate = 9600
        assert each.wires[0].line.baud == 38400
    free = simulation_of(in_case(Project(baud=38400), Case(seed=2), Path()))
    free.port(1).baudrate = 9600
    assert free.wires[0].line.baud == 9600

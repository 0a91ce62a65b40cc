"""The desk with a robot of another kind: units, ranges, names of sensors and suggestions are its own."""

import re
from dataclasses import replace

import pytest
from tests.desk.visitor import NewPage, Shown, Visitor, expect, make_project

from kiks.model.project import Project, ProjectRobot

pytestmark = pytest.mark.slow


@pytest.fixture
def project() -> Project:
    project = make_project()
    return replace(project, robots=(ProjectRobot(kind="epuck"), *project.robots[1:]))


def test_speeds_have_the_unit_of_the_robot_and_a_stepper_turns_as_it_is_told(shown: Shown, new_page: NewPage) -> None:
    visitor = Visitor(new_page(1280, 1100), shown)
    visitor.tab("wire")
    expect(visitor.at("hints")).to_contain_text("D,left,right: set speed (steps/s")
    visitor.send("D,305,-2000")
    visitor.tab("robot")
    visitor.shows({"speed-left": "305, set 305", "speed-right": "-1000, set -2000"})
    visitor.at("curves-speeds").press("Enter")
    expect(visitor.page.locator(".kiks-curve-note")).to_have_text("steps/s")
    bar = visitor.page.locator(".kiks-wheel-bar").first
    expect(bar).to_have_attribute("title", re.compile("left wheel in steps/s"))
    visitor.click("proximity-0", shows={"explanation": "Sensor 0 (right 17) of robot 1 reads"})

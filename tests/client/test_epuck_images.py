"""Images of an e-puck as an object: every mode and size leaves the line in order."""

import pytest

import kiks
from kiks.errors import LinkError, ParameterError


@pytest.fixture
def robot() -> kiks.EPuck:
    return kiks.EPuck(kiks.Simulation(robot="epuck").port(1))


@pytest.mark.parametrize(
    ("mode", "size", "shape"),
    [
        ("grey", (40, 20, 8), (20, 40)),
        ("grey", (255, 2, 1), (2, 255)),
        ("colour", (16, 30, 4), (30, 16, 3)),
        # Too large for the buffer of the robot: it takes its usual picture.
        ("colour", (80, 60, 8), (40, 40, 3)),
    ],
)
def test_an_image_has_the_size_that_was_set(
    mode: str, size: tuple[int, int, int], shape: tuple[int, ...], robot: kiks.EPuck
) -> None:
    robot.set_camera(mode, *size)
    assert robot.image().shape == shape
    assert len(robot.proximity()) == 8


def test_what_an_image_cannot_tell_is_refused_and_the_line_stays_in_order(robot: kiks.EPuck) -> None:
    with pytest.raises(ParameterError, match=r"^width must be from 1 to 255"):
        robot.set_camera("grey", 640, 1, 1)
    robot.port.write(b"J,2,40,30,8\n")
    assert robot.port.readline() == b"j\r\n"
    with pytest.raises(LinkError, match="YUV"):
        robot.image()
    assert len(robot.proximity()) == 8

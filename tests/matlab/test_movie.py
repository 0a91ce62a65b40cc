"""kiks_recordmovie makes a film from the opening of a port to its closing."""

from pathlib import Path

import av
import numpy as np
import pytest
from tests.at_length import at_length
from tests.matlab.octave import needs_octave, run

from kiks.sim.colours import robot_colour

pytestmark = [needs_octave, pytest.mark.slow]

PICTURES_PER_S = 25


def pictures(file: Path) -> list[np.ndarray]:
    with av.open(str(file)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def robot_column(picture: np.ndarray) -> float:
    """Return where the robot is, as a share of the picture's width."""
    is_robot = np.abs(picture.astype(int) - robot_colour(0)).max(axis=-1) < 30
    is_robot[:, 1030:] = False  # what stands beside the world has its colour, too
    return float(np.nonzero(is_robot)[1].mean()) / picture.shape[1]


OPENING_TO_CLOSING = """
arena = zeros(300, 600);
arena(150, 100) = -360;
kiks(arena)
kiks_recordmovie('run.avi')
ref = kiks_kopen([-1 9600 1]);
kSetSpeed(ref, 10, 10);
kiks_pause(4)
kProximity(ref);
say('time', kiks_ktime(-1))
kiks_kclose(ref)
ref = kiks_kopen([-1 9600 1]);
kiks_pause(1)
kiks_kclose(ref)
"""


def test_a_film_goes_from_opening_to_closing(tmp_path: Path) -> None:
    octave = run(OPENING_TO_CLOSING, tmp_path)
    assert [path.name for path in tmp_path.iterdir() if path.suffix in (".mp4", ".avi")] == ["run.mp4"]
    seen = pictures(tmp_path / "run.mp4")
    assert seen[0].shape == (720, 1280, 3)
    assert len(seen) / PICTURES_PER_S == pytest.approx(octave.said["time"], abs=0.1)
    assert octave.line("kiks_recordmovie: ") == f"{len(seen)} pictures are in {tmp_path}/run.mp4"
    # 80 mm a second for four seconds, of 600 mm which take 77 % of the width.
    way_mm = (robot_column(seen[-1]) - robot_column(seen[0])) / 0.77 * 600
    assert way_mm == pytest.approx(320, abs=25)


OTHER_ENDS = """
global KIKS_MOVIENAME
kiks_recordmovie('quit.gif'), ref = kiks_kopen; kiks_pause(1)
kiks_quit
KIKS_MOVIENAME = 'arena.webp'; ref = kiks_kopen; kiks_pause(1)
kiks_arena
ref = kiks_kopen; kiks_pause(1), kiks_kclose(ref)
kiks_recordmovie('none'), kiks_recordmovie('')
ref = kiks_kopen; kiks_pause(1), kiks_kclose(ref)
kiks_recordmovie('no/folder.mp4')
say('folder', caught(@() kiks_kopen()))
kiks_recordmovie('other.mp4')
ref = kiks_kopen([-1 9600 1]); other = kiks_kopen([-2 9600 1]);
kiks_pause(1), kiks_kclose(other), kiks_pause(1), kiks_kclose(ref)
kiks_recordmovie('end.gif')
ref = kiks_kopen; kiks_pause(1)
"""


@at_length
def test_a_film_ends_with_its_world_and_with_its_program(tmp_path: Path) -> None:
    octave = run(OTHER_ENDS, tmp_path)
    assert len(pictures(tmp_path / "quit.gif")) == pytest.approx(PICTURES_PER_S, abs=2)
    # The program has ended without closing its port.
    assert len(pictures(tmp_path / "end.gif")) == pytest.approx(PICTURES_PER_S, abs=2)
    assert (tmp_path / "arena.webp").stat().st_size > 1000
    assert "a film must go to a file that can be written" in octave.said["folder"]
    # Port -1 has begun it.
    assert len(pictures(tmp_path / "other.mp4")) == pytest.approx(2 * PICTURES_PER_S, abs=3)
    films = {path.name for path in tmp_path.iterdir() if path.suffix in (".mp4", ".gif", ".webp")}
    assert films == {"quit.gif", "arena.webp", "other.mp4", "end.gif"}


@at_length
def test_a_preference_names_the_film_of_each_run(tmp_path: Path) -> None:
    (tmp_path / "kiks_preferences.m").write_text("KIKS_MOVIENAME = 'each';\nKIKS_MOVIE_QUALITY = 90;\n")
    octave = run("for i = 1:2, ref = kiks_kopen; kiks_pause(i), kiks_kclose(ref), end", tmp_path)
    assert len(pictures(tmp_path / "each.mp4")) == pytest.approx(2 * PICTURES_PER_S, abs=2)
    assert len([line for line in octave.lines if line.startswith("kiks_recordmovie: ")]) == 2
    assert any("KIKS_MOVIE_QUALITY has no effect: films are H.264" in line for line in octave.lines)

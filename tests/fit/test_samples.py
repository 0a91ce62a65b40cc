"""Files of samples are read, and what is wrong in one is said with its line; rays are those of the engine."""

import math

import numpy as np
import pytest
from tests.model.test_kad import traced
from tools.sensors.train_networks import PLACES

from kiks.errors import ParameterError
from kiks.fit.samples import RIG_OFFSET_DEG, Fan, Samples, is_active, load_samples, nearnesses

ROW = "0 1 2 3 4 5 6 1023"
GOOD = f"8 2 3 5 2\nTURN 0\n{ROW}\n{ROW}\nTURN 1\n{ROW}\n{ROW}\nTURN 2\n{ROW}\n9 9 9 9 9 9 9 9\n"


def write(folder, text):
    file = folder / "post.sam"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


@pytest.mark.parametrize("text", [GOOD, GOOD + "END\n", GOOD.replace("\n", " \r\n"), "\n" + GOOD.replace(" ", "\t")])
def test_text_files_are_read(tmp_path, text):
    samples = load_samples(write(tmp_path, text), radius_mm=12.5)
    assert (samples.name, samples.radius_mm) == ("post", 12.5)
    assert samples.gap_mm.tolist() == [5, 7, 9]
    assert (samples.angle_deg[0] + RIG_OFFSET_DEG).tolist() == [0, 180]
    assert (samples.counts.shape, samples.counts[0, 0].tolist()) == ((3, 2, 8), [0, 1, 2, 3, 4, 5, 6, 1023])
    assert samples.counts[2, 1].tolist() == [9] * 8
    assert samples.at_angles(slice(1, None, 2)).counts.shape == (3, 1, 8)


def test_broken_text_files_are_told_by_their_line(tmp_path):
    for text, line, words in (
        (b"", 1, "an empty file"),
        (b" \n\n", 1, "an empty file"),
        (b"8 2 3 5 2\nTURN 0\n\xff\xfe", 3, "binary (byte 0xff)"),
        (b"8 2 3 5 2\n\x00\n", 2, "binary (byte 0x00)"),
        ("PASSWORD=hello\n", 1, "whole numbers, but it was something else"),
        ("8 180 20 5\n", 1, "4 numbers"),
        ("7 2 3 5 2\n", 1, "must be 8"),
        ("8 0 3 5 2\n", 1, "1 to 3600 angles"),
        ("8 2 0 5 2\n", 1, "1 to 1000 distances"),
        ("8 2 3 -5 2\n", 1, "first distance"),
        ("8 2 3 5 0\n", 1, "step"),
        ("8 99999999999 3 5 2\n", 1, "'99999999999'"),
        ("8 2 3 5 2\n", 1, "cut off"),
        (GOOD.replace("TURN 1", "TURN 2", 1), 5, "must be 'TURN 1', but it was 'TURN 2'"),
        (GOOD.replace("TURN 1\n", ""), 5, "must be 'TURN 1'"),
        (GOOD.replace("2 3 4", "2 3.0 4", 1), 3, "'3.0'"),
        (GOOD.replace("2 3 4", "2 x 4", 1), 3, "something else"),
        (GOOD.replace("2 3 4", "2 -- 4", 1), 3, "'--'"),
        (GOOD.replace("2 3 4", "2 4", 1), 3, "row 1 of 2 of TURN 0), but it was 7 numbers"),
        (GOOD.replace("2 3 4", "2 3 3 4", 1), 3, "9 numbers"),
        (GOOD.replace("1023", "1024", 1), 3, "from 0 to 1023, but it was 1024"),
        (GOOD.replace("2 3 4", "2 -3 4", 1), 3, "from 0 to 1023, but it was -3"),
        (GOOD.replace("9 9 9 9 9 9 9 9\n", ""), 9, "the end of the file"),
        (GOOD + ROW, 11, "Nothing may follow the"),
    ):
        with pytest.raises(ParameterError) as caught:
            load_samples(write(tmp_path, text))
        message = str(caught.value)
        assert f"post.sam', line {line}: " in message
        assert words in message
        assert message.endswith((".", "?"))


def table(**changes):
    arrays = {
        "values": np.arange(48, dtype=np.int16).reshape(2, 3, 8),
        "gap_mm": np.array([5, 7]),
        "object_angle_deg_cw": np.array([0, 120, 240]),
    }
    return {name: array for name, array in (arrays | changes).items() if array is not None}


def test_tables_are_read(tmp_path):
    np.savez(tmp_path / "wall.npz", **table())
    samples = load_samples(tmp_path / "wall.npz")
    assert samples.name == "wall"
    assert math.isinf(samples.radius_mm)
    assert samples.counts[1, 2, 7] == 47
    assert (samples.angle_deg[-1] + RIG_OFFSET_DEG).tolist() == [0, 120, 240]


def test_broken_tables_are_told(tmp_path):
    for changes, words in (
        ({"values": None}, "values must be whole numbers from 0 to 1023 [gap, angle, 8], but it is missing."),
        ({"gap_mm": np.array([5])}, "but it had the shape [2, 3, 8], gap = 1, angle = 3."),
        ({"gap_mm": np.array([-5, 7])}, "but it was -5 at [0]."),
        ({"values": np.full((2, 3, 8), 1024)}, "but it was 1024 at [0, 0, 0]."),
    ):
        np.savez(tmp_path / "wall.npz", **table(**changes))
        with pytest.raises(ParameterError) as caught:
            load_samples(tmp_path / "wall.npz")
        assert words in str(caught.value)
        assert "wall.npz': " in str(caught.value)
        assert str(caught.value).endswith("See the README of the samples.")


def test_a_header_asks_for_no_memory(tmp_path):
    file = write(tmp_path, f"8 3600 1000 5 2\nTURN 0\n{ROW}\n")
    with traced() as peak_bytes, pytest.raises(ParameterError, match=r"line 3: .*the end of the file"):
        load_samples(file)
    assert peak_bytes[0] < 1e7


def test_a_radius_is_positive(tmp_path):
    for radius_mm in (0.0, -1.0, math.nan, -math.inf, 1e300, "12", None, True):
        with pytest.raises(ParameterError, match=r"radius_mm must be (a number )?from 0\.001"):
            load_samples(write(tmp_path, GOOD), radius_mm=radius_mm)


def test_active_readings_and_nothing_in_range():
    assert is_active(np.array([0, 19, 20, 1000, 1001, 1023])).tolist() == [False, False, True, True, False, False]
    samples = Samples("wall", math.inf, np.array([60.0]), np.arange(0.0, 360.0, 10.0)[None], np.zeros((1, 36, 8), int))
    assert nearnesses(samples, Fan.spread(*PLACES["rim"])).max() == 0.0

"""Arenas of the Matlab KiKS, and the text format of matrices."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import kiks
from kiks.errors import ArenaError, KiksError, ParameterError
from kiks.toolbox.framing import FRAME_MIN, frame
from kiks.toolbox.matlab_arenas import MOVED_MAX, arena_from_matrix, place_mm, settled, user_place
from kiks.toolbox.preferences import Settings
from kiks.toolbox.wire_format import escape, matrix_text, parse_matrices, parse_numbers, unescape


@given(arrays(np.int16, st.tuples(st.integers(0, 9), st.integers(0, 9)), elements=st.integers(-3, 3)))
def test_matrices_survive_a_round_trip(matrix: np.ndarray) -> None:
    read, again = parse_matrices(f"{matrix_text(matrix)} {matrix_text(matrix / 2)}")
    assert np.array_equal(read, matrix)
    assert np.array_equal(again, matrix / 2)


@given(st.text(max_size=300))
def test_texts_survive_a_round_trip_as_one_line_and_frames_contain_their_length(text: str) -> None:
    assert unescape(escape(text)) == text
    assert "\n" not in escape(text)
    assert "\r" not in escape(text)
    sent = frame(text)
    length = int(sent[:8])
    assert len(sent) == max(FRAME_MIN, length + 8)
    assert sent[8 : 8 + length].decode() == text.replace("\x02", "?"), "that character ends the answer to Ctrl-C"


def test_malformed_matrices_and_wrong_counts_of_numbers_are_refused() -> None:
    short = ["", "2", "2 2", "2 2 1 0", "1 1 2 0", "2 2 5 0", "2 2 4 x"]
    for words in (*short, "2 2 0 1 4 1", "-1 2 1 1", "99999 99999 1 1"):
        with pytest.raises(ParameterError, match="a matrix must be"):
            parse_matrices(words)
    assert parse_numbers(["1", "NaN"], 2, "both")[0] == 1
    for words in (["1"], ["1", "x"], ["1", "inf"]):
        with pytest.raises(ParameterError, match="both must be 2 finite numbers"):
            parse_numbers(words, 2, "both")


def codes_with(elements: dict[tuple[int, int], int]) -> np.ndarray:
    """Return an arena of 400 x 300 mm with some elements in it."""
    codes = np.zeros((300, 400))
    codes[*zip(*elements, strict=True)] = [*elements.values()]
    return codes


def test_rows_count_downwards_and_columns_to_the_right_and_the_most_negative_is_the_first_robots() -> None:
    codes = codes_with({(19, 49): 2, (149, 199): -90})
    codes[0] = 1  # the upper edge
    codes[:, 0] = 1  # the left edge
    arena = arena_from_matrix(codes)
    assert arena.brightness[-1].all()  # rows of arenas begin at the bottom
    assert arena.brightness[:, 0].all()
    assert arena.lamps[0][:2] == (49.5, 280.5)
    assert user_place(arena, *arena.lamps[0][:2]) == (50, 20)
    assert place_mm(arena, 200, 150) == arena.starts[0][:2]
    assert arena.starts[0].heading_rad == pytest.approx(math.pi / 2)
    starts = arena_from_matrix(codes_with({(99, 99): -90, (99, 299): -360})).starts
    assert [start.x_mm for start in starts] == [299.5, 99.5]
    assert starts[0].heading_rad == 0.0


def test_things_leave_the_floor_empty_and_a_colour_mask_sets_the_brightness_of_walls() -> None:
    arena = arena_from_matrix(codes_with({(99, 99): 2, (99, 199): 3, (199, 199): 4}), ball=40, cylinder=90)
    assert not arena.brightness.any()
    assert (len(arena.lamps), len(arena.balls), len(arena.cylinders)) == (1, 1, 1)
    assert (arena.balls[0].brightness, arena.cylinders[0].brightness) == (40, 90)
    codes, greys = np.zeros((200, 200)), np.zeros((200, 200))
    codes[:10], greys[:10, :100], greys[100, 100] = 1, 61, 99
    brightness = arena_from_matrix(codes, greys, wall=200).brightness[::-1]
    assert brightness[5, 50] == 61
    assert brightness[5, 150] == 200
    assert brightness[100, 100] == 0, "a grey where there is no wall is none"


def test_what_has_room_stays_where_it_is() -> None:
    arena = arena_from_matrix(codes_with({(99, 99): -90, (99, 199): 3, (199, 199): 4, (0, 0): 2}))
    there, moves = settled(arena, 27.5)
    assert moves == []
    for part in ("starts", "balls", "cylinders", "lamps"):
        assert getattr(there, part) == getattr(arena, part)


def test_what_has_no_room_goes_to_the_nearest_free_place() -> None:
    codes = codes_with({(119, 199): -90, (151, 199): 4, (199, 29): 3})
    codes[:100] = 1
    arena, moves = settled(arena_from_matrix(codes), 27.5)
    sim = kiks.Simulation(arena)
    x, y = user_place(arena, *sim.pose(1)[:2])
    assert (x, y) == (200, 128)
    assert arena.starts[0].heading_rad == pytest.approx(math.pi / 2)
    cylinder, ball = (user_place(arena, *body[0][:2]) for body in (arena.cylinders, arena.balls))
    assert math.dist(cylinder, (x, y)) == pytest.approx(27.5 + 16, abs=1.5)
    assert ball == (33, 200)
    assert [move.split(" has")[0] for move in moves] == ["A robot", "A ball", "A cylinder"]


def test_a_disc_drawn_of_balls_stays_an_error() -> None:
    codes = np.zeros((900, 900))
    codes[449, 449 : 449 + MOVED_MAX + 2] = 3
    arena = arena_from_matrix(codes)
    assert settled(arena, 27.5) == (arena, [])
    with pytest.raises(ArenaError, match=r"the place of a ball must be free.* ball 1 is "):
        kiks.Simulation(arena)


def test_an_unknown_element_and_a_mask_of_another_size_are_refused() -> None:
    codes = np.zeros((200, 200))
    with pytest.raises(ParameterError, match="200 x 200, but it is 200 x 201"):
        arena_from_matrix(codes, np.zeros((200, 201)))
    codes[4, 6] = 7
    with pytest.raises(ParameterError, match=r"ARENA\(5,7\) is 7"):
        arena_from_matrix(codes)


INVALID = {
    "seed": ("x", "1.5", "9" * 400, "1e400", "-1"),
    "noise": ("2", "yes"),
    "ball": ("0",),
    "wall": ("256",),
    "brightness": ("wood",),
    "latency_s": ("-1", "nan", "11"),
    "robots": ("1001",),
    "programs": ("0",),
    "turrets": ("k213 griper", "k213 " * 1000),
    "response": ("thesi",),
    "thinking": ("liv",),
    "sed": ("1",),
    "x" * 1000: ("1",),
    "robot": ("x" * 1001, "a\0b"),
}


def test_invalid_settings_are_refused_and_an_empty_one_is_the_default() -> None:
    for name, values in INVALID.items():
        for value in values:
            with pytest.raises(KiksError, match=r"^kiks_preferences: .* must (be|have|match)") as caught:
                Settings().changed(name, value)
            assert len(str(caught.value)) < 600
    changed = Settings().changed("ball", "40").changed("turrets", "gripper k213")
    assert (changed.ball, changed.turrets) == (40, ("gripper", "k213"))
    assert changed.changed("ball", "").ball is None

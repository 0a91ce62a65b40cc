"""Data files: limits of size and depth, and one line that names key, rule, value and way out."""

import re
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field
from tests.model.refusals import refused, traced

from kiks.errors import SHOWN_MAX, ArenaError, ParameterError, shown
from kiks.model.data_file import Number, Text, Whole, check, parse_json, parse_toml, read_file, record


class Place(NamedTuple):
    x_mm: Number
    y_mm: Annotated[Number, Field(ge=0)] = 0.0


@record
class Wheel:
    radius_mm: Annotated[Number, Field(gt=0, le=50, description="A Khepera's is 8.")]
    side: Literal["left", "right"] = "left"
    gains: Annotated[tuple[Annotated[Whole, Field(ge=0, le=9)], ...], Field(max_length=3)] = ()

    def __post_init__(self) -> None:
        if self.side == "right" and self.gains:
            raise ParameterError("gains must be those of the left wheel, but the right one has some.")


@record
class Cart:
    name: Text
    wheel: tuple[Wheel, ...] = ()
    spare: Wheel | None = None
    place: Place | None = None


GOOD = {"name": "a", "wheel": [{"radius_mm": 8}], "spare": {"radius_mm": 8, "side": "right"}}


def test_one_line_says_what_is_wrong() -> None:
    for changes, words in (
        ({"name": 3}, "name must be a text, but it was 3."),
        ({"name": "a\0"}, "name must match pattern"),
        ({"wheel": [{}]}, "wheel 1: radius_mm must be given, but it is missing. A Khepera's is 8."),
        ({"wheel": 1}, "wheel must be a list, but it was 1."),
        ({"wheel": [{"radius_mm": 8}, 2]}, "wheel 2 must be a table, but it was 2."),
        ({"spare": {"radius_mm": 0}}, "spare.radius_mm must be greater than 0, but it was 0. A Khep"),
        ({"spare": {"radius_mm": float("nan")}}, "spare.radius_mm must be a finite number, but it was nan"),
        ({"spare": {"radius_mm": 10**400}}, "spare.radius_mm must be a number, but it was 1000"),
        ({"spare": {"radius_mm": True}}, "but it was True."),
        ({"spare": {"radius_mm": 1, "side": "rihgt"}}, "'left' or 'right', but it was 'rihgt'. Did you mean 'rig"),
        ({"spare": {"radius": 8}}, "spare must have known keys only, but it has 'radius'. Did you mean 'radius_mm'?"),
        ({"spare": {"radius_mm": 8, "gains": [1, 10]}}, "spare.gains[1] must be at most 9, but it was 10."),
        ({"spare": {"radius_mm": 8, "gains": [1] * 4}}, "spare.gains must have at most 3 items, but it was"),
        ({"spare": {"radius_mm": 8, "side": "right", "gains": [1]}}, "gains must be those of the left wheel, but"),
        ({"wheel": [{"radius_mm": 8, "side": "right", "gains": [1]}]}, "wheel 1: gains must be those of the left"),
        (
            {"nmae": 1},
            "the file must have known keys only, but it has 'nmae'. Did you mean 'name'? Known are name, wheel",
        ),
        ({"place": {"x_mm": 1, "y_mm": -1}}, "place.y_mm must be at least 0, but it was -1."),
    ):
        call = partial(check, Cart, GOOD | changes, "File 'x'", error=ArenaError)
        refused(f"^File 'x': .*{re.escape(words)}", call, error=ArenaError)


def test_code_and_files_make_the_same_records() -> None:
    cart = check(Cart, GOOD, "x")
    assert cart == Cart("a", (Wheel(8),), Wheel(8, "right"))
    refused(r"^radius_mm must be at most 50, but it was 99\.", lambda: replace(cart.wheel[0], radius_mm=99))
    refused(r"^gains must be those of the left wheel", Wheel, 8, "right", (1,))


@given(st.recursive(st.none() | st.booleans() | st.floats() | st.integers() | st.text(), st.lists, max_leaves=20))
def test_what_messages_show_is_short_and_on_one_line(value: object) -> None:
    assert len(shown(value)) <= SHOWN_MAX
    assert "\n" not in shown(value)


def test_messages_show_what_python_cannot() -> None:
    class Silent:
        def __repr__(self) -> str:
            raise RuntimeError

    assert shown(10**5000) == "a int that cannot be shown"
    assert len(shown(Silent())) <= SHOWN_MAX


def test_long_dotted_keys_cost_no_memory_and_what_cannot_be_parsed_is_refused_in_one_line() -> None:
    for key in ("a" + ".a" * 20_000, "[" + "a." * 60_000 + "a]", '"a"' + ' . "b c"' * 20):
        with traced() as peak_bytes:
            refused("a key has more than 16 parts", parse_toml, f"{key} = 1".encode(), "x")
        assert peak_bytes[0] < 50 * len(key) + 1e6
    dots = ".".join("abcdefghijklmnopqrstuvwxyz")
    text = f'a = "{dots}"\nb = \'\'\'\n{dots}\'\'\'\nc = [{"1.5, " * 50}] # {dots}\nd = """x""{dots}"""\n'
    assert set(parse_toml(text.encode(), "x")) == set("abcd"), "dots that are no keys are read"
    for data in (b"\xff", b"a = " + b"[" * 50_000, b"[" * 50_000, b"a = 1" + b"0" * 5000, b'{"a":', b"{]"):
        for parse in (parse_toml, parse_json):
            words = r"^File 'x' must be (TOML|JSON) in UTF-8, but: .*\. Correct"
            assert len(refused(words, parse, data, "File 'x'")) < 250


def test_files_are_files_of_a_size(tmp_path: Path) -> None:
    path = tmp_path / "a"
    for place, words in ((path, "there is no such file"), (tmp_path, "it is a folder"), (Path("\0"), "must")):
        refused(words, partial(read_file, place, "File 'a'", error=ArenaError), error=ArenaError)
    path.write_bytes(b"abc")
    for bytes_max in (3, 2**80):
        assert read_file(path, "File 'a'", bytes_max=bytes_max) == b"abc"
    words = r"File 'a' must have at most .* MiB, but it has more"
    refused(words, partial(read_file, path, "File 'a'", bytes_max=2))
    refused("there is no such file", read_file, Path("/dev/zero"), "File 'zero'")

"""Pictures and arena files: every format that is read, and the words of every refusal."""

import math
import re
import struct
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.model.refusals import refused
from tests.model.test_picture import bmp

from kiks.errors import ArenaError
from kiks.model.arena import Arena, Ball, Cylinder, Lamp, Pose
from kiks.model.arena_file import save_arena

EXAMPLES = Path(__file__).parents[2] / "examples" / "arenas"
ROOM_MM = 40


def grey_picture(shape: tuple[int, int] = (120, 150)) -> np.ndarray:
    rng = np.random.default_rng(5)
    picture = np.zeros(shape, np.uint8)
    picture[20:60, 30:110] = rng.integers(0, 256, (40, 80))
    picture[0] = np.arange(shape[1]) % 256
    return picture


def read(path: Path) -> np.ndarray:
    return Arena.load(path).brightness[::-1]


GREY_FORMATS = [
    *((name, {}) for name in ("a.png", "a.pgm", "a.bmp", "a.tif")),
    *(("a.tif", {"compression": each}) for each in ("tiff_lzw", "packbits")),
    ("a.tiff", {"compression": "tiff_adobe_deflate"}),
    ("A.TIF", {"compression": "tiff_deflate"}),
]
BIT_FORMATS = [
    *((name, {}) for name in ("a.png", "a.pbm", "a.bmp", "a.tif")),
    *(("a.tif", {"compression": each}) for each in ("group4", "group3", "packbits", "tiff_lzw")),
    ("a.tif", {"compression": "group4", "tiffinfo": {262: 0}}),
]


def test_greys_and_bits_come_back_unchanged_from_every_lossless_format(tmp_path):
    greys, walls = grey_picture(), grey_picture() > 90
    lossless = [*GREY_FORMATS, ("a.gif", {}), ("a.webp", {"lossless": True})]
    for picture, formats in ((greys, lossless), (walls, BIT_FORMATS)):
        for name, options in formats:
            Image.fromarray(picture).save(tmp_path / name, **options)
            found = read(tmp_path / name)
            assert np.array_equal(found, picture * 255 if picture is walls else picture), (name, options)


def test_a_tif_may_count_from_white_to_black(tmp_path):
    # Written by hand, so that Pillow's writer has no say in what the tags mean: one strip, uncompressed.
    walls, path = grey_picture((120, 152)) > 90, tmp_path / "a.tif"
    for white_is_zero, bits in product((False, True), (1, 8)):
        stored = ~walls if white_is_zero else walls
        data = (np.packbits(stored, axis=1) if bits == 1 else stored * np.uint8(255)).tobytes()
        tags = [(256, 152), (257, 120), (258, bits), (259, 1), (262, 0 if white_is_zero else 1), (273, 0)]
        tags += [(277, 1), (278, 120), (279, len(data))]
        start = 8 + 2 + 12 * len(tags) + 4
        entries = b"".join(struct.pack("<HHII", tag, 4, 1, start if tag == 273 else value) for tag, value in tags)
        path.write_bytes(b"II*\0" + struct.pack("<IH", 8, len(tags)) + entries + bytes(4) + data)
        assert np.array_equal(read(path), walls * 255)


def test_a_palette_is_read_as_its_colours_no_colour_becomes_floor_but_what_is_transparent_does(tmp_path):
    colours = np.zeros((120, 150, 3), np.uint8)
    colours[10, 10:13] = [(0, 0, 1), (0, 1, 0), (1, 0, 0)]
    colours[11, 10:13] = [(255, 255, 255), (0, 0, 255), (100, 100, 100)]
    indices = np.zeros((120, 150), np.uint8)
    indices[5, 5], indices[6, 6] = 1, 2
    palette = Image.fromarray(indices).convert("P")
    palette.putpalette([0, 0, 0, 0, 0, 2, 200, 200, 200])
    palette.putdata(indices.ravel().tolist())
    for name in ("a.png", "a.tif", "a.bmp", "a.ppm"):
        Image.fromarray(colours).save(tmp_path / name)
        found = read(tmp_path / name)
        assert found[10, 10:13].min() == 1
        assert found[11, 10:13].tolist() == [255, 29, 100]
        assert np.count_nonzero(found) == 6
        if name != "a.ppm":
            palette.save(tmp_path / name)
            found = read(tmp_path / name)
            assert (found[5, 5], found[6, 6], np.count_nonzero(found)) == (1, 200, 2)
    for mode, colour in (("LA", (90,)), ("RGBA", (90, 90, 90))):
        layered = Image.new(mode, (150, 120), 0)
        for x, opacity in ((3, 255), (4, 1), (5, 0)):
            layered.putpixel((x, 4), (*colour, opacity))
        layered.save(tmp_path / "a.png")
        found = read(tmp_path / "a.png")
        assert found[4, 3:6].tolist() == [90, 90, 0]
        assert np.count_nonzero(found) == 2
    Image.fromarray(grey_picture()).save(tmp_path / "a.png", transparency=90)
    assert np.array_equal(read(tmp_path / "a.png"), np.where(grey_picture() == 90, 0, grey_picture()))


def test_numbers_of_sixteen_and_thirty_two_bits_are_scaled(tmp_path):
    for name, dtype, values, expected in (
        *((name, np.uint16, (1, 257, 32896, 65535), [1, 1, 128, 255]) for name in ("a.png", "a.tif", "a.pgm")),
        ("a.tif", np.float32, (0.001, 0.5, 1.0), [1, 128, 255]),
        ("a.tif", np.float32, (0.1, 100.0, 255.0), [1, 100, 255]),
        ("a.tif", np.int32, (1, 100, 255), [1, 100, 255]),
        ("a.tif", np.int32, (1, 257, 65535), [1, 1, 255]),
        ("a.tif", np.int32, (1, 65536, 2**31 - 1), [1, 1, 127]),
    ):
        deep = np.zeros((120, 150), dtype)
        deep[7, : len(values)] = values
        Image.fromarray(deep).save(tmp_path / name)
        assert read(tmp_path / name)[7, : len(values) + 1].tolist() == [*expected, 0]
    for value in (-1.0, math.nan, math.inf):
        deep = np.zeros((120, 150), np.float32)
        deep[0, 0] = value
        Image.fromarray(deep).save(tmp_path / "a.tif")
        words = r"must hold brightness from 0 up, but its values span .* Save the arena as"
        refused(words, Arena.load, tmp_path / "a.tif", error=ArenaError)


def test_the_first_frame_counts_and_a_picture_gives_the_name_and_the_scale(tmp_path):
    first, second = Image.fromarray(grey_picture()), Image.new("L", (300, 300), 255)
    first.save(tmp_path / "yard.tif", save_all=True, append_images=[second])
    assert np.array_equal(read(tmp_path / "yard.tif"), grey_picture())
    arena = Arena.from_image(str(tmp_path / "yard.tif"), 2)
    assert (arena.name, arena.width_mm, arena.height_mm) == ("yard", 300, 240)
    refused("mm_per_pixel must be from", Arena.from_image, tmp_path / "yard.tif", 0)


def test_what_is_no_lossless_picture_or_a_part_of_one_is_refused(tmp_path):
    for content in (b"", b"hello", b"\x89PNG\r\n\x1a\n", b"P5 0 0 255 ", b"BM" + bytes(60)):
        (tmp_path / "a.png").write_bytes(content)
        refused(r"Picture '.*a.png' must be", Arena.load, tmp_path / "a.png", error=ArenaError)
    for name, options, words in (
        ("a.jpg", {}, "must be a lossless picture, but it is of type JPEG. Lossy.*PNG, TIF, PGM or BMP"),
        ("a.webp", {}, "must be a lossless picture, but it is of type WEBP. Lossy.*PNG, TIF, PGM or BMP"),
        ("a.tga", {}, "must be a lossless picture, but it is of type TGA. Save.*PNG, TIF, PGM or BMP"),
        ("a.tif", {"compression": "jpeg"}, "but it is a TIFF compressed with .*jpeg. Lossy compression smears walls"),
    ):
        Image.fromarray(grey_picture()).save(tmp_path / name, **options)
        refused(words, Arena.load, tmp_path / name, error=ArenaError)
    picture = np.random.default_rng(0).integers(0, 256, (120, 150), np.uint8)
    for name, options in [*GREY_FORMATS, ("a.tif", {"compression": "group4"})]:
        path = tmp_path / name
        Image.fromarray(picture > 90 if options.get("compression") == "group4" else picture).save(path, **options)
        content = path.read_bytes()
        for share in (0.02, 0.3, 0.6):
            path.write_bytes(content[: int(len(content) * share)])
            refused(r"must be (complete and readable|a picture), but", Arena.load, path, error=ArenaError)


def test_size_is_checked_before_pixels_are_read(tmp_path):
    # There are no pixels behind the header: reading them would say something else.
    for side in (8001, 9600, 60000):
        (tmp_path / "a.bmp").write_bytes(bmp(side, side))
        refused(r"must have at most 64 million", Arena.load, tmp_path / "a.bmp", error=ArenaError)
    (tmp_path / "a.bmp").write_bytes(bmp(1000, 1000))
    words = r"a.bmp': An arena must have at most 64 million cells, .* 1000 x 1000 pixels"
    refused(words, Arena.from_image, tmp_path / "a.bmp", 9, error=ArenaError)


FULL = """
picture = "sub/maze.png"
mm_per_pixel = 2.0
name = "Maze"
[[start]]
at_mm = [55, 20]
heading_deg = 180
[[start]]
at_mm = [60.5, 20]
[[lamp]]
at_mm = [200, 10]
power_w = 2
is_on = false
[[lamp]]
at_mm = [0, 0]
[[ball]]
at_mm = [250, 50]
[[cylinder]]
at_mm = [20, 50]
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "sub").mkdir()
    Image.fromarray(grey_picture()).save(tmp_path / "sub" / "maze.png")
    return tmp_path


def write(folder: Path, text: str) -> Path:
    (folder / "a.toml").write_text(text, encoding="utf-8")
    return folder / "a.toml"


def test_an_arena_file_says_everything_and_may_be_a_box(folder, tmp_path):
    arena = Arena.load(write(folder, FULL))
    assert np.array_equal(arena.brightness[::-2, ::2], grey_picture())
    assert (arena.name, arena.width_mm) == ("Maze", 300)
    assert arena.starts == (Pose(55, 20, math.pi), Pose(60.5, 20, math.pi / 2))
    assert arena.lamps == (Lamp(200, 10, 2.0, False), Lamp(0, 0, 1.0, True))
    assert (arena.balls, arena.cylinders) == ((Ball(250, 50),), (Cylinder(20, 50),))
    arena = Arena.load(write(tmp_path, "size_mm = [500, 650]\nrounded_mm = 100"))
    assert np.array_equal(arena.brightness, Arena.default().brightness)
    assert arena.name == "a"
    arena = Arena.load(write(tmp_path, "size_mm = [200, 300]\nbrightness = 'pink sponge'"))
    assert arena.brightness.max() == 86
    arena = Arena.load(write(tmp_path, "size_mm = [200, 300]\nwall_mm = 5\nbrightness = 9"))
    assert np.array_equal(arena.brightness, Arena.box(200, 300, wall_mm=5, brightness=9).brightness)


def test_a_saved_arena_comes_back(folder):
    arena = replace(Arena.load(write(folder, FULL)), name='Quotes " \\ and\nlines, \x7f, ö and 🤖')
    save_arena(arena, folder / "b.toml")
    again = Arena.load(folder / "b.toml")
    assert np.array_equal(again.brightness, arena.brightness)
    for name in ("name", "mm_per_cell", "starts", "lamps", "balls", "cylinders"):
        assert getattr(again, name) == getattr(arena, name)
    words = r"path must end in '.toml', but it was .*a.png'. The picture goes beside"
    refused(words, save_arena, arena, folder / "a.png")
    words = r"an arena must go to a file .* cannot \(No such file or directory\)"
    refused(words, save_arena, arena, folder / "none" / "a.toml")


BOX = "size_mm = [300, 200]\n"
REFUSED = [
    ("size_mm = [1,\n2\nname = 3", r"must be TOML in UTF-8, but: .*line 3.* Correct the file"),
    ("", r"must have a picture or a size, but it has neither. Give picture"),
    ("nmae = 'x'", r"the file must have known keys only, but it has 'nmae'. Did you mean 'name'\? Known are size_mm"),
    (BOX + "picture = 'maze.png'", r"must be either a picture or a box, but picture came with size_mm. Remove"),
    (BOX + "mm_per_pixel = 1", r"mm_per_pixel must come with a picture, but there is none. Boxes have cells of 1 mm"),
    ("picture = 'sub/maze.png'\nwall_mm = 1", r"but picture came with wall_mm"),
    (
        "picture = '../maze.png'",
        r"picture must lie in the folder of the file that names it, or below, but '../maze.png' leads",
    ),
    ("picture = 'sub/../../maze.png'", r"picture must lie in the folder of the file that names it"),
    ("picture = '/etc/passwd'", r"picture must lie in the folder of .* Copy it there"),
    ("picture = 'link.png'", r"picture must lie in the folder of the file that names it"),
    ("picture = 'none.png'", r"Picture '.*none.png' must exist"),
    ("picture = 'a.toml'", r"Picture '.*a.toml' must be a picture"),
    ("picture = ''", r"picture must lie in the folder of the file that names it, or below, but '' leads elsewhere"),
    ("size_mm = 3", r"size_mm must be two whole numbers in mm, but it was 3. Give size_mm = "),
    (
        f"size_mm = [1{'0' * 400}, 200]",
        r"size_mm\[0\] must be at most 1000000000, but it was 10{30,60}\.\.\.0{30,60}\. Boxes",
    ),
    ("size_mm = [100000, 200000]", r"at most 64 million cells"),
    (BOX + "[start]\nat_mm = [50, 50]", r"start must be a list, but it was .* Head each with \[\[start\]\]"),
    (BOX + "[[start]]\nheading_deg = 1", r"start 1: at_mm must be given, but it is missing. Give at_mm = \[x, y\]"),
    (BOX + "[[start]]\nat_mm=[50, 50]\n[[start]]\nat_mm=[1, 1]", r"start 2 must stand on floor, but at \(1, 1\) mm"),
    (BOX + "[[lamp]]\nat_mm = [50, 50]\nis_on = 1", r"lamp 1: is_on must be true or false, but it was 1"),
]


def test_an_arena_file_that_is_wrong_says_where(folder):
    outside = folder.parent / f"{folder.name}.png"
    Image.fromarray(grey_picture()).save(outside)
    (folder / "link.png").symlink_to(outside)
    for text, words in REFUSED:
        refused(rf"^Arena file '.*a.toml'.*{words}", Arena.load, write(folder, text), error=ArenaError)


def test_all_floor_of_an_example_arena_can_be_reached_from_its_free_starts():
    from scipy.ndimage import label

    for path in sorted(EXAMPLES.glob("*.toml")):
        arena = Arena.load(path)
        assert arena.starts, path
        assert all(arena.free_for(start.x_mm, start.y_mm, ROOM_MM) for start in arena.starts), path
        assert label(arena.clearance - 0.5 >= ROOM_MM)[1] == 1, path
    assert np.array_equal(Arena.load(EXAMPLES / "default.toml").brightness, Arena.default().brightness)


def with_black_walls(tmp_path):
    """Write a picture with black walls around a white floor, grey where nothing is known; return where walls are."""
    grey = np.full((120, 150), 254, np.uint8)
    grey[:10], grey[:, :20], grey[-5:] = 0, 0, 205
    Image.fromarray(grey).save(tmp_path / "room.png")
    return grey[::-1] != 254


def test_a_picture_with_black_walls_is_turned_round(tmp_path, caplog):
    walls = with_black_walls(tmp_path)
    arena = Arena.load(write(tmp_path, 'picture = "room.png"\ninvert = true'))
    walls[:5] = False  # grey, which only a map of ROS knows to be unknown
    assert np.array_equal(arena.brightness == 255, walls)
    assert not caplog.messages
    words = r"room for a robot 55 mm .* walls are black: an arena file with invert = true"
    refused(words, Arena.load(tmp_path / "room.png").find_start, 27.5, error=ArenaError)
    assert "is wall: black (0) is floor, and all else wall." in caplog.text
    file = write(tmp_path, "size_mm = [500, 650]\ninvert = true")
    refused("invert must come with a picture", Arena.load, file, error=ArenaError)


def test_what_is_transparent_is_floor_black_or_white_and_a_picture_without_walls_draws_a_line(tmp_path, caplog):
    """Black lines on a clear background, with a light shadow, as drawing programs write them."""
    drawing = np.zeros((120, 150, 4), np.uint8)
    drawing[20:100, 70:80], drawing[100:110, 70:80] = (0, 0, 0, 255), (0, 0, 0, 60)
    Image.fromarray(drawing).save(tmp_path / "room.png")
    assert not Arena.load(tmp_path / "room.png").brightness.any()
    assert not Arena.load(write(tmp_path, 'picture = "room.png"')).brightness.any()
    assert caplog.text.count("has no wall: black (0) is floor, and all else wall. In most other programs walls") == 2
    inverted = Arena.load(write(tmp_path, 'picture = "room.png"\ninvert = true\nfloor = "room.png"'))
    assert np.array_equal(np.argwhere(inverted.brightness[::-1]), np.argwhere(drawing[..., 3] == 255))
    assert np.array_equal(inverted.floor[::-1], 255 - drawing[..., 3])
    caplog.clear()
    assert not Arena.load(write(tmp_path, 'picture = "room.png"\ninvert = false')).brightness.any()
    assert not caplog.text, "who says which way round it is knows"
    for grey, words in ((0, "have floor, but all of it is wall: with invert = true, what is darker"), (255, "")):
        Image.new("L", (120, 120), grey).save(tmp_path / "room.png")
        file = write(tmp_path, 'picture = "room.png"\ninvert = true')
        if words:
            refused(words, Arena.load, file, error=ArenaError)
    assert not Arena.load(file).brightness.any()
    assert "has no wall: with invert = true, what is darker than a middle grey" in caplog.text


def test_a_start_from_which_most_of_the_floor_is_out_of_reach_draws_a_line(tmp_path, caplog):
    shapes = "size_mm = [600, 400]\n[[wall]]\nline_mm = [[150, 0], [150, 400]]\n"
    starts = "[[start]]\nat_mm = [{}, 200]\n[[start]]\nat_mm = [400, 200]\n"
    Arena.load(write(tmp_path, shapes + starts.format(300)))
    door = "[[wall]]\nbox_mm = [[140, 170], [160, 230]]\nbrightness = 0\n"
    Arena.load(write(tmp_path, shapes + door + starts.format(70)))
    assert not caplog.text
    Arena.load(write(tmp_path, shapes + starts.format(70)))
    assert re.search(r"Start 1 of '.*a.toml', \(70, 200\) mm, lies in a part with 1\d % of the floor", caplog.text)
    assert "Start 2" not in caplog.text
    rooms = "".join(f"[[wall]]\nline_mm = [[{x_mm}, 0], [{x_mm}, 400]]\n" for x_mm in (200, 400))
    Arena.load(write(tmp_path, f"size_mm = [600, 400]\n{rooms}"))
    assert "The roomiest place of" in caplog.text


MAP = "image: room.png\nresolution: 0.002\norigin: [-1.0, 2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\n"
"""A map without its free_thresh; keys in a row below replace those of the same name."""


def ros_map(folder, keys):
    lines = dict(line.split(": ", 1) for line in (MAP + "free_thresh: 0.196\n" + keys.format(folder)).splitlines())
    (folder / "map.yaml").write_text("".join(f"{key}: {value}\n" for key, value in lines.items()))
    return folder / "map.yaml"


@pytest.mark.parametrize(
    ("keys", "greys", "turns"),
    [
        ("", (0, 205, 254), 0),
        ("free_thresh: 0.25\nmode: trinary", (0, 205, 254), 0),  # as Nav2 writes it
        ("free_thresh: 0.9", (0, 205, 100), 0),
        ("free_thresh: 0.25\nmode: scale", (0, None, 254), 0),
        ("free_thresh: 0.25", (0, None, 254), 0),
        ("free_thresh: 0.25\nnegate: 1", (255, 50, 1), 0),
        ("free_thresh: 0.25\nnegate: 1", (255, None, 1), 0),
        ("free_thresh: 0.25\nmode: raw", (100, 255, 0), 0),
        ("origin: [0, 0, 1.570796]", (0, 205, 254), 1),
        ("origin: [0, 0, -1.570796]", (0, 205, 254), -1),
        ("image: {}/room.png", (0, 205, 254), 0),
    ],
)
def test_what_a_map_of_ros_does_not_know_to_be_free_is_wall(tmp_path, keys, greys, turns):
    """Walls at the top and on the left, unknown below, the rest free; no grey: transparent."""
    drawn = np.full((120, 150), 2)
    drawn[:10], drawn[:, :20], drawn[-5:] = 0, 0, 1
    grey = np.array([each or 0 for each in greys], np.uint8)[drawn]
    opacity = np.where(np.array([each is None for each in greys])[drawn], 0, 255).astype(np.uint8)
    layers = (grey, opacity) if None in greys else (grey,)
    Image.merge("LA" if len(layers) == 2 else "L", [Image.fromarray(each) for each in layers]).save(
        tmp_path / "room.png"
    )
    arena = Arena.load(ros_map(tmp_path, keys))
    assert np.array_equal(arena.brightness[::-2, ::2] > 0, np.rot90(drawn < 2, turns))
    assert (arena.mm_per_cell, arena.name) == (1.0, "map")


def test_a_map_of_ros_that_is_turned_a_little_is_wall_around(tmp_path):
    Image.new("L", (120, 100), 254).save(tmp_path / "room.png")
    arena = Arena.load(ros_map(tmp_path, "resolution: 0.001\norigin: [0, 0, 0.5]"))
    assert (arena.width_mm, arena.height_mm) == pytest.approx((153, 145), abs=3)
    assert (arena.brightness == 0).sum() == pytest.approx(120 * 100, rel=0.01)


def test_a_damaged_map_of_ros_is_one_line(tmp_path):
    with_black_walls(tmp_path)
    rest = "resolution: 0.01\noccupied_thresh: 0.65\nfree_thresh:"
    for text, words in (
        ("image: [room.png\n", "must be YAML, but: while parsing a flow sequence"),
        ("- a\n", "must be a table"),
        (f"image: ../room.png\n{rest} 0.2\n", "image"),
        (f"image: {tmp_path.parent}/room.png\n{rest} 0.2\n", "image must lie in the folder of the file"),
        (f"image: room.png\n{rest} 2\n", "free_thresh must be at most 1"),
        (f"image: room.png\n{rest} 0\n", "have floor, but all of it is wall: what the map does not know to be free"),
        (f"image: room.png\nmode: raw\nnegate: 1\n{rest} 0.2\n", "negate must be 0 in mode raw"),
        (f"image: room.png\norigin: [0, 0, .nan]\n{rest} 0.2\n", "origin"),
        (f"image: room.png\norigin: [0, 0]\n{rest} 0.2\n", "origin"),
        (f"image: &a [*a, *a]\n{rest} 0.2\n", "image must be a text"),
    ):
        (tmp_path / "map.yaml").write_text(text)
        refused(f"^Map '.*map.yaml'.*{words}", Arena.load, tmp_path / "map.yaml", error=ArenaError)

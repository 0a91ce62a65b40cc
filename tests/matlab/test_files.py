"""Arenas in files and matrices: files survive a round trip, sensors see greys, and mazes are connected."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.io import loadmat
from scipy.ndimage import distance_transform_edt, label
from tests.matlab.octave import needs_octave, run

from kiks.model.arena import Arena
from kiks.model.kad import save_kad
from kiks.model.project import Project

pytestmark = [needs_octave, pytest.mark.slow]

BOTH_WAYS = r"""
arena = zeros(200, 300);
arena([1:10 191:200], :) = 1;
arena(60:80, 100:103) = 1;
arena(150, 50) = -90;
arena(40, 40) = 2;
arena(100, 200) = 3;
arena(150, 250) = 4;
greys = 60 * (arena == 1);
greys(60:80, 100:103) = 200;
kiks(arena, greys)
poses = kept = [];
objects = kiks_siminfo_objects();
objects(:, 1:3)  %= [[1, 40, 40], [2, 200, 100], [3, 250, 150]]
kiks_save('octave.kad')
kiks_save('octave.kiks')
kiks_save('octave.toml')
data = load('-mat', 'octave.kad');
say('walls', data.walls)
[walls, colours] = kiks_kad2arena(data.walls);
say('drawn', double(walls) .* double(colours))
[class(walls) ' ' class(colours)]  %= "logical uint8"
kiks_arena
for name = {'octave.kad', 'octave.kiks', 'octave.toml'}
    kiks_load(name{1})
    poses(end + 1, :) = kiks_siminfo_robotpos();
    kept(end + 1) = isequal(kiks_siminfo_objects()(:, 1:3), objects(:, 1:3));
end
poses  %= [[50, 150, 1.5708]] * 3 +- 1e-4
kept  %= [[1, 1, 1]]
for name = {'python.kad', 'octave.kad', 'plain.tif', 'packed.tif', 'octave.toml'}
    [walls, colours] = kiks_tif2arena(name{1});
    say(strtok(strrep(name{1}, '.', '_')), double(colours))
    say(['class_' strrep(name{1}, '.', '_')], [class(walls) ' ' class(colours)])
end
data = load('-mat', 'python.kad');
[walls, colours] = kiks_kad2arena(data.walls);
say('python_drawn', double(colours))
[walls, colours] = kiks_tif2arena('nowhere.tif');
[size(walls) size(colours)]  %= [[0, 0, 0, 0]]
kiks_arena('packed.tif')
kiks_save('packed.kad')
kiks_quit(1)
"""


def test_files_of_octave_and_python_are_the_same(tmp_path: Path) -> None:
    random = np.random.default_rng(5)
    picture = np.kron(random.choice(np.array([0, 0, 0, 90, 255], np.uint8), (12, 15)), np.ones((10, 10), np.uint8))
    picture[20:100, 40:120] = 0
    Image.fromarray(picture).save(tmp_path / "plain.tif")
    Image.fromarray(picture).save(tmp_path / "packed.tif", compression="packbits")
    assert (tmp_path / "plain.tif").stat().st_size > 2 * (tmp_path / "packed.tif").stat().st_size
    save_kad(Arena.from_array(picture), tmp_path / "python.kad")
    done = run(BOTH_WAYS, tmp_path)
    said = done.said

    ours = np.zeros((200, 300))
    ours[:10] = ours[190:] = 60
    ours[59:80, 99:103] = 200
    there = Arena.load(tmp_path / "octave.kad")
    assert np.array_equal(there.brightness[::-1], ours)
    assert (len(there.starts), len(there.lamps), len(there.balls), len(there.cylinders)) == (1, 1, 1, 1)
    assert np.array_equal(loadmat(tmp_path / "octave.kad")["walls"][0], said["walls"][0])
    assert np.array_equal(said["drawn"], ours)
    assert np.array_equal(Project.load(tmp_path / "octave.kiks").arena.brightness[::-1], ours)
    assert Project.load(tmp_path / "octave.kiks").seed == 1

    for name in ("plain_tif", "packed_tif", "python_kad"):
        assert np.array_equal(said[name], picture), name
        assert said[f"class_{name}"] == "logical uint8"
    assert all(np.array_equal(said[name], ours) for name in ("octave_kad", "octave_toml"))
    assert np.array_equal(said["python_drawn"], picture)
    assert re.search(r"warning: The arena's file must exist, but 'nowhere\.tif' ", done.text)
    assert np.array_equal(Arena.load(tmp_path / "packed.kad").brightness[::-1], picture)


NAMES = """
addpath('path')
kiks('robot_wars')
size(kiks_tif2arena('robot_wars'))  %= [[150, 200]]
robot_wars = 'robot_wars.tif';
delete(robot_wars)
kiks_arena('robot_wars')
kiks_save('on_path.kiks')
kiks_load('pillars')  % comes with KiKS, with two lamps
size(kiks_siminfo_objects())  %= [[2, 5]]
kiks_load('on_path')
run(fullfile('program', 'beside.m'))
say('no_name', caught(@() kiks_load()))
say('no_name_to_save', caught(@() kiks_save()))
kiks_quit(1)
"""


def test_arenas_are_found_by_their_names(tmp_path: Path) -> None:
    for width, folder in ((200, "."), (210, "path"), (220, "program")):
        (tmp_path / folder).mkdir(exist_ok=True)
        Image.fromarray(np.zeros((150, width), np.uint8)).save(tmp_path / folder / "robot_wars.tif")
    (tmp_path / "program" / "robot_wars.tif").rename(tmp_path / "program" / "ring.tif")
    (tmp_path / "program" / "beside.m").write_text(f"cd('{tmp_path}')\nkiks_arena('ring')\nkiks_save('ring.kiks')\n")
    said = run(NAMES, tmp_path).said
    assert Project.load(tmp_path / "on_path.kiks").arena.width_mm == 210
    assert Project.load(tmp_path / "ring.kiks").arena.width_mm == 220
    there = "Arenas in the current folder: on_path, ring. Those of KiKS: default, maze, office, pillars, pitch, track."
    assert said["no_name"].endswith(f"Call kiks_load('maze'). {there}")
    assert said["no_name_to_save"].endswith(f"Call kiks_save('arena.kad'). {there}")


GREYS = r"""
global KIKS_ARENA_CODING KIKS_NOISE KIKS_ARENA_DEFAULT_COLOR
KIKS_NOISE = 0;
arena = zeros(300, 300);
arena(100:110, :) = 1;
arena(130 + 28, 150) = -90;
greys = {255, 120, 1, [], []};
defaults = [255 255 255 255 120];
for k = 1:5
    KIKS_ARENA_DEFAULT_COLOR = defaults(k);
    if isempty(greys{k})
        kiks_arena(arena)
    else
        kiks_arena(arena, greys{k} * arena .* (arena == 1))
    end
    ref = kiks_kopen;
    seen(k) = max(kProximity(ref));
end
seen(4:5) - seen(1:2)  %= [[0, 0]]
diff(seen(1:3)) < 0  %= [[1, 1]]
seen(1) - seen(3) > 100  %= 1
% An element of 0 in the mask does not make a hole.
kiks_arena(arena, zeros(size(arena)))
ref = kiks_kopen;
max(kProximity(ref)) - seen(3)  %= 0
% Elements that are shares of white: a picture divided by 255.
kiks_arena(arena .* (arena < 0) + 120 / 255 * (arena == 1))
ref = kiks_kopen;
max(kProximity(ref)) - seen(2)  %= 0
caught(@() kiks_arena(arena, ones(2)))  %~ kiks:argument\|The colormask must be a matrix as large as the arena.*

codes = zeros(200);
codes(50, 60) = 2;
codes(100, 150) = 3;
codes(150, 60) = 4;
kiks_arena(codes)
kiks_siminfo_objects()(:, 1:3)  %= [[1, 60, 50], [2, 150, 100], [3, 60, 150]]
KIKS_ARENA_CODING = 'thesis';
kiks_arena(codes)
kiks_siminfo_objects()(:, 1:3)  %= [[1, 150, 100], [2, 60, 50], [3, 60, 150]]
maze = kiks_generate_maze(2, 2);
sum(maze(:) == 3)  %= 1
kiks_arena(maze)
kiks_siminfo_objects()(:, 1)  %= 1
KIKS_ARENA_CODING = 'kiks';
% Several starts: the most negative is the first robot's; what is too small is replaced.
codes = zeros(300);
codes(100, 100) = -90;
codes(200, 200) = -360;
kiks_arena(codes)
kiks_siminfo_robotpos(-1)  %= [[200, 200, 0]] +- 1e-9
kiks_siminfo_robotpos(-2)  %= [[100, 100, 1.5708]] +- 1e-4
kiks_arena(zeros(99, 200))
kiks_siminfo_robotpos()(1:2)  %= [[250.5, 325.5]] +- 1e-4
caught(@() kiks_arena(NaN(200)))  %~ kiks:argument\|An arena's elements must be.*
% What has no room at its place goes to the nearest with room.
codes = zeros(300);
codes(10, 150) = -90;
codes(295, 100) = 3;
kiks_arena(codes)
kiks_siminfo_robotpos()  %= [[150, 28, 1.5708]] +- 1e-4
kiks_siminfo_objects()(1:3)  %= [[2, 100, 268]] +- 1e-4
"""


def test_greys_are_seen_and_codes_follow_the_preference(tmp_path: Path) -> None:
    done = run(GREYS, tmp_path)
    assert "warning: An arena must be at least 100 x 100 mm" in done.text
    assert [line for line in done.lines if "has no room" in line] == [
        "warning: A robot has no room at x = 150, y = 10 and is placed at x = 150, y = 28.",
        "warning: A ball has no room at x = 100, y = 295 and is placed at x = 100, y = 268.",
    ]


MAZES = """
for k = 1:12
    rand('twister', k);
    say(sprintf('demo_%d', k), kiks_generate_maze(5, 5))
end
say('usual', kiks_generate_maze())
say('wide', kiks_generate_maze(3, 2, 150, 20))
say('one', kiks_generate_maze(1, 1))
rand('twister', 1);
first = kiks_generate_maze(5, 5);
size(first)  %= [[640, 880]]
rand('twister', 1);
isequal(kiks_generate_maze(5, 5), first)  %= 1
kiks_arena(kiks_generate_maze(5, 5))
kiks_siminfo_robotpos()  %= [[55, 60, 0]] +- 1e-9
kiks_siminfo_objects()(1:3)  %= [[1, 830, 580]]
narrow = kiks_generate_maze(4, 3, 67, 40);
say('narrow', narrow)
kiks_arena(narrow)
kiks_siminfo_robotpos()  %= [[38, 38, 0]] +- 1e-9
kiks_quit(1)
"""


def test_mazes_have_their_size_and_every_cell_can_be_reached(tmp_path: Path) -> None:
    said = run(MAZES, tmp_path).said
    assert len({said[f"demo_{k}"].tobytes() for k in range(1, 13)}) == 12
    mazes = [(said[f"demo_{k}"], 5, 5, 120, 10) for k in range(1, 13)]
    mazes += [(said["usual"], 4, 4, 120, 10), (said["wide"], 3, 2, 150, 20), (said["one"], 1, 1, 120, 10)]
    for maze, columns, rows, path, wall in mazes:
        pitch = path + wall
        # kiks-behaviour.md 1.9; twice a wall less than its sum of widths, as both outer walls stand on paths.
        assert maze.shape == (rows * pitch - wall, (columns + 2) * path + (columns - 1) * wall)
        assert all(edge.all() for edge in (maze[:10], maze[-11:], maze[:, :10], maze[:, -11:]))
        ((y, x),) = np.argwhere(maze == -360)
        assert (y + 1, x + 1) == (round(path / 2), round((wall + path) / 2) - wall)
        ((light_y, light_x),) = np.argwhere(maze == 2)
        assert (light_y + 1) == maze.shape[0] - path + round(path / 2)
        assert abs(light_x - (maze.shape[1] - path / 2)) <= wall
        # One piece of floor, in which each cell's middle lies: the entrance, the cells and the exit.
        pieces, count = label(maze != 1)
        assert count == 1
        for row in range(rows):
            for column in range(columns):
                assert pieces[row * pitch + path // 2, (column + 1) * pitch - wall + path // 2] == 1
        # Exactly one way to each: all walls hang together.
        assert label(maze == 1, np.ones((3, 3)))[1] == 1
    # A robot gets from the entrance to all cells of the narrowest maze.
    room = distance_transform_edt(said["narrow"] != 1) >= 28
    assert label(room)[1] == 1
    assert all(room[row * 107 :, (column + 1) * 107 - 40 :][:67, :67].any() for row in range(3) for column in range(4))


HOSTILE = (
    *("KIKS_SEED = 1e400;", f"KIKS_SEED = {'9' * 5000};", "KIKS_SEED = struct();", "KIKS_THINKING = ones(3000);"),
    *(f"KIKS_ROBOT = '{'x' * 5000}';", "KIKS_ROBOT = char(zeros(1, 300));", f"KIKS_ARENA_CODING = '{'x' * 5000}';"),
    *("KIKS_TURRETS = {1, 2};", "x = [", "\0\x01", "error('no\nsuch\nluck')", 'error("no\\nsuch\\nluck")'),
    "error(repmat('x', 1, 5000))",
)


def test_a_hostile_preference_file_is_refused_in_a_line(tmp_path: Path) -> None:
    for number, text in enumerate(HOSTILE):
        folder = tmp_path / str(number)
        folder.mkdir()
        (folder / "kiks_preferences.m").write_text(text, encoding="latin-1")
    # Global variables override the file.
    lines = ["clear -global KIKS_SEED KIKS_THINKING"]
    for number in range(len(HOSTILE)):
        lines += [f"cd('{tmp_path / str(number)}')", f"say('w{number}', caught(@() kiks(zeros(300))))"]
    said = run("\n".join(lines), tmp_path).said
    for number, text in enumerate(HOSTILE):
        why = said[f"w{number}"]
        assert re.match(r"kiks:.*must", why), text[:80]
        assert why.isprintable(), text[:80]
        assert len(why) < 400, text[:80]


WITHOUT_ROBOT = """
global KIKS_SEED
KIKS_SEED = 3;
arena = zeros(400, 500);
arena(300, 400) = -90;
kiks_arena(arena, [], 1)
kiks_spawn(2, [100 100]), kiks_spawn(3, [300 100]), kiks_spawn(1, [200 200])
size(kiks_siminfo_robotpos)  %= [[0, 0]]
size(kiks_siminfo_robotpath)  %= [[2, 0]]
kiks_siminfo_robotdist  %= [[0, 0, 0]]
size(kiks_ktime)  %= [[0, 0]]
kiks_siminfo_setobject(2, 150, 120)  %= 1
kiks_reset
objects = kiks_siminfo_objects();
objects(:, 1:3)  %= [[1, 200, 200], [2, 100, 100], [3, 300, 100]]
kiks_save('empty.kiks')
ref = kiks_kopen;
kiks_siminfo_robotpos()(1:2)  %= [[400, 300]]
kSetSpeed(ref, 10, 10);
kiks_pause(1)
kiks_siminfo_robotdist()(1) > 50  %= 1
numel(kProximity(ref))  %= 8
kiks_load('empty.kiks')
size(kiks_siminfo_robotpos)  %= [[0, 0]]
isequal(kiks_siminfo_objects(), objects)  %= 1
kiks_siminfo_setrobot(1, 1, 0)  %= 0
kiks_siminfo_setrobot(350, 250, 0)  %= 1
kiks_siminfo_robotpos()  %= [[350, 250, 0]]
kiks_arena(arena)
kiks_siminfo_robotpos()(1:2)  %= [[400, 300]]
kiks_arena('empty.kiks', [], 1)
size(kiks_siminfo_robotpos)  %= [[0, 0]]
kiks_quit
"""


def test_world_without_a_robot_gets_one_when_it_is_needed(tmp_path):
    run(WITHOUT_ROBOT, tmp_path)
    project = Project.load(tmp_path / "empty.kiks")
    assert project.robots == ()
    assert len(project.arena.starts) == 1


DIALOG = """
function [name, folder] = {name}(kinds, title)
    global choice
    say('{name}', [strjoin(kinds(:, 1)', ' ') '|' title])
    [name, folder] = choice{{:}};
end
"""

DIALOGS = """
global choice
kiks(zeros(300))
choice = {'other.kad', fullfile(pwd(), 'there')};
mkdir('there')
kiks_save
kiks_arena(zeros(200))
kiks_load
kiks_save('loaded.kiks')
choice = {0, 0};
kiks_load
kiks_save
kiks_save('same.kiks')
"""


def test_dialogs_ask_for_files(tmp_path):
    """The dialogs' own functions are replaced here."""
    for name in ("uigetfile", "uiputfile"):
        (tmp_path / f"{name}.m").write_text(DIALOG.format(name=name))
    (tmp_path / "have_window_system.m").write_text("function yes = have_window_system()\nyes = true;\nend\n")
    said = run(DIALOGS, tmp_path).said
    assert said["uigetfile"] == "*.toml;*.kiks;*.kad;*.tif;*.tiff;*.png;*.bmp;*.pgm;*.pbm;*.ppm|Load an arena"
    assert said["uiputfile"] == "*.kiks *.toml *.kad|Save the world"
    assert (tmp_path / "there" / "other.kad").exists()
    assert Project.load(tmp_path / "loaded.kiks").arena.width_mm == 300
    assert Project.load(tmp_path / "same.kiks").arena.width_mm == 300, "no choice changes nothing"

"""Files of a desk: no name leads out of its folder, and invalid files are refused."""

from __future__ import annotations

import io
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from kiks.desk.server.folder import LISTED_MAX, OPENED, Folder, decode, encode
from kiks.desk.server.scripts import ProgramFolder
from kiks.errors import ArenaError, KiksError, ParameterError
from kiks.model.arena import Arena, Lamp
from kiks.model.limits import UPLOAD_BYTES_MAX
from kiks.model.project import Project

PROJECT = Project()

BAD_NAMES = [
    "", " ", ".", "..", "../x", "a/../../x", "/etc/x", "//x", "\0", "x\0.kiks", "a\\b", "C:\\x", "c:x", "~/x", "~x",
    ".hidden", "a/.hidden", "-rf", "con", "NUL.kiks", "com1.kiks", "a/aux.kiks", "x./y", "x\ny", "x" * 500,
    "a/b\u202ec", "x?.kiks", "x*.kiks", "é" * 100,
]  # fmt: skip


def save(folder: Folder, name: str, project: Project = PROJECT, *, may_replace: bool = False) -> str:
    return folder.save(encode(project, folder.full_name(name)), name, "a project", may_replace=may_replace)


def read(folder: Folder, name: str) -> Project:
    return Project.load(folder.open(name))


def snapshot(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*"))


@pytest.fixture
def home(tmp_path: Path) -> Path:
    home = tmp_path / "home"
    home.mkdir()
    (tmp_path / "secret.kiks").write_bytes(Project().to_bytes())
    return home


@pytest.mark.parametrize("name", BAD_NAMES)
def test_names_outside_the_folder_are_refused(home, name):
    folder, before = Folder(home), snapshot(home.parent)
    for each in (name, f"{name}/x.kiks"):
        with pytest.raises(KiksError):
            save(folder, each, may_replace=True)
        with pytest.raises(KiksError):
            read(folder, each)
    assert [path for path in snapshot(home.parent) if path not in before] == []


@settings(max_examples=200)
@given(st.text(st.sampled_from("./\\ab~:\0 -"), max_size=12))
def test_random_names_stay_in_the_folder(tmp_path_factory, name):
    base = tmp_path_factory.mktemp("base")
    home = base / "home"
    home.mkdir()
    try:
        saved = save(Folder(home), name)
    except KiksError:
        assert snapshot(base) == [home]
        return
    assert snapshot(base) == [home, home / saved]
    assert Folder(home).names() == [saved]


def test_links_do_not_lead_out(home):
    os.symlink(home.parent, home / "up")
    os.symlink(home.parent / "secret.kiks", home / "secret.kiks")
    os.symlink(home / "loop", home / "loop")
    folder = Folder(home)
    for name in ("up/secret.kiks", "secret.kiks", "up/new.kiks"):
        with pytest.raises(ParameterError, match="elsewhere"):
            read(folder, name)
        with pytest.raises(ParameterError, match="elsewhere"):
            save(folder, name, may_replace=True)
    assert folder.names() == []
    assert not (home.parent / "new.kiks").exists()


def test_files_are_kept_and_listed(home):
    folder = Folder(home)
    (home / "sub").mkdir()
    (home / "b.txt").write_text("")
    (home / ".hidden.kiks").write_text("")
    project = replace(Project(Arena.box(300, 200)), seed=5)
    assert save(folder, " room ", project) == "room.kiks"
    assert save(folder, "sub/other.kiks", project) == "sub/other.kiks"
    assert save(folder, "old.KAD", project) == "old.KAD"
    assert folder.names() == ["old.KAD", "room.kiks", "sub/other.kiks"]
    assert read(folder, "room.kiks").to_bytes() == project.to_bytes()
    assert read(folder, "old.KAD").arena.width_mm == 300
    assert folder.question("room") == "room.kiks exists. Replace it?"
    assert folder.question("rooms") == ""
    with pytest.raises(ParameterError, match="exists"):
        save(folder, "room", project)
    save(folder, "room", replace(project, seed=6), may_replace=True)
    assert read(folder, "room.kiks").seed == 6
    for name, words in [("sub/none/a", "can be written"), ("a.toml", "end in"), ("none.kiks", "exist")]:
        with pytest.raises(KiksError, match=words):
            read(folder, name) if name.startswith("none") else save(folder, name, project)
    (home / "dir.kiks").mkdir()
    with pytest.raises(ParameterError, match="folder"):
        save(folder, "dir", project, may_replace=True)


def test_the_second_of_two_desks_is_told_that_a_file_has_changed(home):
    project, changed = Project(Arena.box(300, 200)), "was changed elsewhere since you opened or saved it here"
    save(Folder(home), "room", project)
    one, two = Folder(home), Folder(home)
    assert "exists" in one.question("room")
    assert "exists" in two.question("room")
    save(one, "room", replace(project, seed=1), may_replace=True)
    with pytest.raises(ParameterError, match="exists"):
        save(two, "room", replace(project, seed=2), may_replace=True)
    assert changed in two.question("room")
    save(two, "room", replace(project, seed=2), may_replace=True)
    assert changed in one.question("room")
    assert read(one, "room.kiks").seed == 2
    assert "exists" in one.question("room")
    save(two, "new", project)
    assert changed in one.question("new")


def test_long_lists_are_cut(home):
    for number in range(LISTED_MAX + 20):
        (home / f"{number}.kiks").touch()
    assert len(Folder(home).names()) == LISTED_MAX
    assert Folder(home / "none").names() == []


def test_uploads_become_projects():
    picture = io.BytesIO()
    Image.fromarray(np.zeros((120, 150), np.uint8)).save(picture, "PNG")
    arena = replace(Arena.box(300, 200), lamps=(Lamp(50, 50),))
    for name, data, width_mm in [
        ("a.kiks", Project(arena).to_bytes(), 300),
        ("C:\\docs\\a.KAD", encode(Project(arena), "a.kad"), 300),
        ("../a.toml", b"size_mm = [400, 300]\n", 400),
        ("a.png", picture.getvalue(), 150),
    ]:
        project = decode(name, data)
        assert project.arena.width_mm == width_mm
        assert project.arena.name in ("a", "box")


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("a.exe", b"", "end in"),
        ("", b"", "name of a file"),
        ("a.png", b"none", "picture"),
        ("a.kad", b"none", "level 5"),
        ("a.toml", b'picture = "/etc/passwd.png"', "comes alone"),
        ("a.kiks", b"kiks = 3", "kiks must be 1"),
        *((f"a{ending}", bytes(UPLOAD_BYTES_MAX + 1), "at most") for ending in OPENED),
    ],
)
def test_invalid_uploads_are_refused(name, data, words):
    with pytest.raises((ArenaError, ParameterError), match=words):
        decode(name, data)


def test_a_folder_has_at_most_so_many_files(tmp_path: Path) -> None:
    folder = ProgramFolder(tmp_path)
    folder.count_max = 2
    for name in ("a", "b", "b"):
        folder.save(b"1", name, "a program", may_replace=True)
    with pytest.raises(ParameterError, match="at most 2 files"):
        folder.save(b"1", "c", "a program")

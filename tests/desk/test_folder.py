"""Projects and programs of a desk: no name leads out of its folder, and invalid files are refused."""

import io
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from tests.at_length import share

from kiks.desk.server import scripts
from kiks.desk.server.folder import LISTED_MAX, OPENED, Folder, decode, encode
from kiks.desk.server.scripts import ProgramFolder, encode_script, find_mistake, offered, read_script
from kiks.errors import ArenaError, KiksError, ParameterError
from kiks.model.arena import Arena, Lamp
from kiks.model.limits import PROGRAM_BYTES_MAX, UPLOAD_BYTES_MAX
from kiks.model.project import Project
from kiks.model.shipped import demonstrations

PROJECT = Project(Arena.box(300, 200))

BAD_NAMES = [
    "", " ", ".", "..", "../x", "a/../../x", "/etc/x", "//x", "\0", "x\0.kiks", "a\\b", "C:\\x", "c:x", "~/x", "~x",
    ".hidden", "a/.hidden", "-rf", "con", "NUL.kiks", "com1.kiks", "a/aux.kiks", "x./y", "x\ny", "x" * 500,
    "a/b\u202ec", "x?.kiks", "x*.kiks", "é" * 100,
]  # fmt: skip


def save(folder: Folder, name: str, project: Project = PROJECT, *, may_replace: bool = False) -> str:
    return folder.save(encode(project, folder.full_name(name)), name, "a project", may_replace=may_replace)


def read(folder: Folder, name: str) -> Project:
    return Project.load(folder.open(name))


@pytest.fixture
def home(tmp_path: Path) -> Path:
    home = tmp_path / "home"
    home.mkdir()
    (tmp_path / "secret.kiks").write_bytes(PROJECT.to_bytes())
    return home


def test_names_outside_the_folder_are_refused(home):
    folder, before = Folder(home), {*home.parent.rglob("*")}
    for name in BAD_NAMES:
        for each, act in product((name, f"{name}/x.kiks"), (read, partial(save, may_replace=True))):
            with pytest.raises(KiksError):
                act(folder, each)
        assert {*home.parent.rglob("*")} <= before, name


@settings(max_examples=share(60, 200))
@given(st.text(st.sampled_from("./\\ab~:\0 -"), max_size=12))
def test_random_names_stay_in_the_folder(tmp_path_factory, name):
    home = tmp_path_factory.mktemp("base") / "home"
    home.mkdir()
    found = []
    with suppress(KiksError):
        found = [save(Folder(home), name)]
    assert {*home.parent.rglob("*")} == {home, *(home / each for each in found)}
    assert Folder(home).names() == found


def test_links_do_not_lead_out(home):
    folder, secret = Folder(home), home.parent / "secret.kiks"
    for name, place in {"up": home.parent, "secret.kiks": secret, "link.py": secret, "loop": home / "loop"}.items():
        (home / name).symlink_to(place)
    for name in ("up/secret.kiks", "secret.kiks", "up/new.kiks"):
        for act in (read, partial(save, may_replace=True)):
            with pytest.raises(ParameterError, match="elsewhere"):
                act(folder, name)
    with pytest.raises(ParameterError, match="leads elsewhere"):
        read_script(home / "link.py")
    assert folder.names() == []
    assert not (home.parent / "new.kiks").exists()


def test_files_are_kept_and_listed(home):
    folder, project = Folder(home), replace(PROJECT, seed=5)
    (home / "sub").mkdir()
    (home / "b.txt").write_text("")
    (home / ".hidden.kiks").write_text("")
    names = " room ", "sub/other.kiks", "old.KAD"
    assert [save(folder, name, project) for name in names] == ["room.kiks", *names[1:]]
    assert folder.names() == ["old.KAD", "room.kiks", "sub/other.kiks"]
    assert read(folder, "room.kiks").to_bytes() == project.to_bytes()
    assert read(folder, "old.KAD").arena.width_mm == 300
    assert (folder.question("room"), folder.question("rooms")) == ("room.kiks exists. Replace it?", "")
    with pytest.raises(ParameterError, match="exists"):
        save(folder, "room", project)
    save(folder, "room", replace(project, seed=6), may_replace=True)
    assert read(folder, "room.kiks").seed == 6
    (home / "dir.kiks").mkdir()
    for name, words in [("sub/none/a", "can be written"), ("a.toml", "end in"), ("dir", "folder")]:
        with pytest.raises(KiksError, match=words):
            save(folder, name, project, may_replace=name == "dir")
    with pytest.raises(KiksError, match="exist"):
        read(folder, "none.kiks")


def test_the_second_of_two_desks_is_told_that_a_file_has_changed(home):
    changed = "was changed elsewhere since you opened or saved it here"
    save(Folder(home), "room")
    one, two = Folder(home), Folder(home)
    for each in (one, two):
        assert "exists" in each.question("room")
    save(one, "room", replace(PROJECT, seed=1), may_replace=True)
    with pytest.raises(ParameterError, match="exists"):
        save(two, "room", replace(PROJECT, seed=2), may_replace=True)
    assert changed in two.question("room")
    save(two, "room", replace(PROJECT, seed=2), may_replace=True)
    assert changed in one.question("room")
    assert read(one, "room.kiks").seed == 2
    assert "exists" in one.question("room")
    save(two, "new")
    assert changed in one.question("new")


def test_long_lists_are_cut_and_a_folder_has_at_most_so_many_files(home):
    folder = ProgramFolder(home)
    folder.count_max = 2
    for name in ("a", "b", "b"):
        folder.save(b"1", name, "a program", may_replace=True)
    with pytest.raises(ParameterError, match="at most 2 files"):
        folder.save(b"1", "c", "a program")
    for number in range(LISTED_MAX + 20):
        (home / f"{number}.kiks").touch()
    assert (len(Folder(home).names()), Folder(home / "none").names()) == (LISTED_MAX, [])


def test_uploads_become_projects_or_are_refused():
    picture = io.BytesIO()
    Image.fromarray(np.zeros((120, 150), np.uint8)).save(picture, "PNG")
    project = replace(PROJECT, arena=replace(PROJECT.arena, lamps=(Lamp(50, 50),)))
    for name, data, width_mm in [
        ("a.kiks", project.to_bytes(), 300),
        ("C:\\docs\\a.KAD", encode(project, "a.kad"), 300),
        ("../a.toml", b"size_mm = [400, 300]\n", 400),
        ("a.png", picture.getvalue(), 150),
    ]:
        arena = decode(name, data).arena
        assert (arena.width_mm, arena.name in ("a", "box")) == (width_mm, True)
    for name, data, words in [
        ("a.exe", b"", "end in"),
        ("", b"", "name of a file"),
        ("a.png", b"none", "picture"),
        ("a.kad", b"none", "level 5"),
        ("a.toml", b'picture = "/etc/passwd.png"', "comes alone"),
        ("a.kiks", b"kiks = 3", "kiks must be 1"),
        *((f"a{ending}", bytes(UPLOAD_BYTES_MAX + 1), "at most") for ending in OPENED),
    ]:
        with pytest.raises((ArenaError, ParameterError), match=words):
            decode(name, data)


def test_own_programs_and_examples_are_offered(tmp_path: Path) -> None:
    for name in ("b.py", "a.py", ".hidden.py", "text.txt"):
        (tmp_path / name).write_text("")
    (tmp_path / "folder.py").mkdir()
    (tmp_path / "folder.py" / "below.py").write_text("")
    labels = [*offered(ProgramFolder(tmp_path)).values()]
    assert labels[:3] == ["a.py", "b.py", "example: avoid"]
    examples = sum(path.parent.name == "demos" for path in demonstrations().values())
    assert len(labels) == 2 + examples
    assert len(offered(ProgramFolder(tmp_path / "nowhere"))) == examples


def test_programs_are_saved_in_the_folder_alone_and_read_again(tmp_path: Path) -> None:
    folder = ProgramFolder(tmp_path)
    assert folder.save(encode_script("print('grün')\n"), " mine ", "a program") == "mine.py"
    assert read_script(tmp_path / "mine.py") == "print('grün')\n"
    assert folder.full_name("text.txt") == "text.txt.py"
    with pytest.raises(ParameterError, match="less deep"):
        folder.save(b"pass", "a/b.py", "a program")
    (tmp_path / "long.py").write_bytes(b"#" * (PROGRAM_BYTES_MAX + 1))
    (tmp_path / "odd.py").write_bytes(b"\xff\xfe")
    for name, message in (("long.py", "at most 200000 bytes"), ("odd.py", "readable"), ("none.py", "readable")):
        with pytest.raises(ParameterError, match=message):
            read_script(tmp_path / name)
    with pytest.raises(ParameterError, match=r"at most 200000 bytes"):
        encode_script("#" * (PROGRAM_BYTES_MAX + 1))


def test_syntax_errors_have_their_line_and_their_place_in_it() -> None:
    for line, *texts in (
        (1, "x = (1,\n", "x = '\n", "x = 1\0", "(" * 10000),
        (2, "pass\nif x\n    pass\n", "def f():\nreturn 1\n", "a = 1\n\tb = 2\n"),
        (3, "pass\n\nreturn 1\n"),
    ):
        for text in texts:
            mistake = find_mistake(text)
            assert mistake.line == line, text[:99]
            assert str(mistake).startswith(f"Line {line}: ")
    mistake = find_mistake(text := "# größer 🤖\nif größe = 2:\n    pass\n")
    assert text[mistake.begin : mistake.end] == "größe = 2"
    for script in scripts.EXAMPLES.glob("[!_]*.py"):
        assert not find_mistake(read_script(script))


@given(st.text(max_size=200))
def test_any_text_is_a_program_or_has_a_mistake(text: str) -> None:
    if (mistake := find_mistake(text)) is not None:
        assert 0 <= mistake.begin <= mistake.end <= len(text)
        assert 1 <= mistake.line <= text.count("\n") + 1


def test_arguments_are_words() -> None:
    assert scripts.split_arguments("""1 "two words" -x 'it'""") == ["1", "two words", "-x", "it"]
    with pytest.raises(ParameterError, match=r"no closing quotation. Close the quotes"):
        scripts.split_arguments("'it")

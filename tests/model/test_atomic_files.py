"""Files are written whole or not at all, whatever goes wrong on the way."""

import os
import stat
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from tests.model.refusals import full_disk, refused

import kiks
from kiks.clock.thinking import save_thinking
from kiks.control.controllers import linear
from kiks.export.pictures import Picture
from kiks.learn.champion import Champion
from kiks.model.arena import Arena
from kiks.model.arena_file import save_arena
from kiks.model.atomic_files import (
    FileBeside,
    check_writable,
    make_folder,
    path_of,
    replace_file,
    replace_files,
    target_of,
)
from kiks.model.kad import save_kad
from kiks.model.project import Project
from kiks.model.robot import RobotSpec, save_robot
from kiks.model.thesis_networks import NetworkResponse

ROOM = Arena.box(300, 200)


def champion() -> Champion:
    return Champion(linear(), (0.5,) * linear().parameter_count, task="avoid", fitness=1.0, measures={}, generation=1)


WRITERS: dict[str, Callable[[Path], object]] = {
    "arena.toml": lambda path: save_arena(ROOM, path),
    "arena.kad": lambda path: save_kad(ROOM, path),
    "project.kiks": lambda path: Project().save(path),
    "robot.toml": lambda path: save_robot(kiks.RobotSpec.load("khepera"), path),
    "networks.json": lambda path: NetworkResponse.load().save(path),
    "thinking.txt": lambda path: save_thinking([12_345] * 100, path),
    "champion.toml": lambda path: champion().save(path),
    "picture.png": lambda path: Picture.of_arena(ROOM).save(path),
}


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("name", WRITERS)
def test_on_a_full_disk_all_is_as_it_was(name: str, tmp_path: Path) -> None:
    path = tmp_path / name

    def refuse(bytes_left: int) -> None:
        before = content(tmp_path)
        with full_disk(bytes_left):
            refused("must go to a file that can be written", WRITERS[name], path)
        assert content(tmp_path) == before

    refuse(0)
    refuse(100)
    for each in (path, path.with_suffix(".png")):
        each.write_bytes(b"old")
    refuse(0)
    refuse(100)
    WRITERS[name](path)
    assert content(tmp_path)[name] != b"old"


def test_files_that_belong_together_are_replaced_together(tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    first.write_text("old")
    with full_disk(100):
        refused("second", replace_files, {first: "new", second: bytes(200)})
    assert content(tmp_path) == {"first": b"old"}


def test_rights_are_those_of_the_umask_and_of_the_earlier_file(tmp_path: Path) -> None:
    def rights(name: str) -> int:
        return stat.S_IMODE((tmp_path / name).stat().st_mode)

    before = os.umask(0o027)
    try:
        replace_file(tmp_path / "new", b"")
        replace_file(tmp_path / "private", b"", rights=0o600)
        (tmp_path / "old").touch()
        (tmp_path / "old").chmod(0o604)
        replace_file(tmp_path / "old", b"")
        (tmp_path / "taken").touch()
        replace_file(tmp_path / "taken", b"", rights=0o600)
    finally:
        os.umask(before)
    assert [rights(name) for name in ("new", "private", "old", "taken")] == [0o640, 0o600, 0o604, 0o600]


def test_a_link_stays_a_link_and_what_is_no_file_is_written_to(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("file")
    for text in ("one", "two"):
        replace_file(tmp_path / "link", text)
        assert (tmp_path / "file").read_text() == text
    assert (tmp_path / "link").is_symlink()
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    check_writable(pipe, "--out")
    replace_file(pipe, "text")
    assert os.read(reader, 100) == b"text"
    os.close(reader)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    check_writable("/dev/null", "--out")


def test_what_cannot_be_written_is_told_before_and_after_in_the_same_words(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").touch()
    before = sorted(tmp_path.rglob("*"))
    words = r"^--out must go to a file that can be written, but '"
    for name in ("none/x", "file/x", "folder", ""):
        refused(words, check_writable, tmp_path / name, "--out")
        refused(words, replace_file, tmp_path / name, b"", "--out")
    assert sorted(tmp_path.rglob("*")) == before


def test_a_check_leaves_nothing_and_changes_nothing(tmp_path: Path) -> None:
    check_writable(tmp_path / "new", "--out")
    assert content(tmp_path) == {}
    old = tmp_path / "old"
    old.write_text("old")
    check_writable(old, "--out")
    words = r"--out must name a new file, but .*old' exists"
    refused(words, lambda: check_writable(old, "--out", is_new=True))
    words = r"--out must go to a folder that can be written, but .* \(File exists\)"
    refused(words, make_folder, old, "--out")
    assert content(tmp_path) == {"old": b"old"}


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write everywhere")
def test_a_protected_file_is_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("old")
    path.chmod(0o444)
    refused("write-protected", check_writable, path, "--out")
    refused("write-protected", replace_file, path, b"", "--out")


def test_what_a_killed_writer_left_goes_and_what_a_living_one_writes_stays(tmp_path: Path) -> None:
    left, note, folder = tmp_path / f".kiks-{'0' * 16}", tmp_path / ".kiks-note", tmp_path / f".kiks-{'1' * 16}"
    with closing(FileBeside(tmp_path / "living")) as living:
        for path in (left, note):
            path.write_text("half")
        folder.mkdir()
        replace_file(tmp_path / "next", "whole")
        assert set(tmp_path.iterdir()) == {living.path, note, folder, tmp_path / "next"}
        living.take_place()
    assert set(tmp_path.iterdir()) == {tmp_path / "living", note, folder, tmp_path / "next"}


@pytest.mark.parametrize("earlier", [None, b"", b"old"])
def test_of_those_that_want_to_be_the_only_one_there_is_one(earlier: bytes | None, tmp_path: Path) -> None:
    target = tmp_path / "file"
    (tmp_path / "link").symlink_to(target)
    if earlier is not None:
        target.write_bytes(earlier)

    def is_refused() -> None:
        for name in ("file", "link"):
            with pytest.raises(BlockingIOError):
                FileBeside(target_of(tmp_path / name), is_only=True)

    with closing(FileBeside(target, is_only=True)) as one:
        assert one.has_earlier == bool(earlier)
        is_refused()
        one.file.write(b"new")
        one.settle()
        one.take_place()
        is_refused()
    with closing(FileBeside(target, is_only=True)) as other:
        assert other.has_earlier
    assert content(tmp_path) == {"file": b"new", "link": b"new"}


def test_an_empty_file_that_was_made_for_the_lock_goes(tmp_path: Path) -> None:
    FileBeside(tmp_path / "new", is_only=True).close()
    with pytest.raises(IsADirectoryError):
        FileBeside(tmp_path, is_only=True)
    assert content(tmp_path) == {}


def test_what_is_no_path_is_named() -> None:
    words = "must be the name of a file, of at most 255 bytes, but it was"
    for path in (5, None, b"a", "", "a\0b", "a" * 256, "a/" * 4096, "\ud800"):
        refused(words, path_of, path)
        refused(r"^--out must be the name of a file", check_writable, path, "--out")
        refused(r"^--out must be the name of a file", replace_file, path, b"", "--out")
        refused(r"robot, if .*, must be the name of a file", RobotSpec.load, path)

"""What is handed in: files, folders, archives of platforms; and what a stranger may put into an archive."""

import os
import zipfile
from pathlib import Path

import pytest

from kiks.errors import ParameterError
from kiks.trials import hand_in
from kiks.trials.similarity import alike
from kiks.trials.submissions import BYTES_MAX, Submission, submissions_in

TEXT = "print('hello')\n"


def zipped(path: Path, files: dict[str, str | bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def found_in(tmp_path: Path, *paths: Path) -> list[Submission]:
    return submissions_in(paths, tmp_path / "copies")


def test_files_and_folders(tmp_path: Path) -> None:
    (tmp_path / "ann.py").write_text(TEXT)
    home = tmp_path / "class"
    for name in ("bob.py", "carl/robot.py", "dora/main.py", "dora/own/helper.py", "eve/a.py", "eve/b.py", ".git/x.py"):
        (home / name).parent.mkdir(parents=True, exist_ok=True)
        (home / name).write_text(TEXT)
    (home / "notes.txt").write_text("none of them")
    (home / "link.py").symlink_to("/etc/passwd")
    *single, dora, eve = found = found_in(tmp_path, tmp_path / "ann.py", home)
    assert [each.name for each in found] == ["ann", "bob", "carl", "dora", "eve"]
    assert {each.command.file.read_text() for each in single} == {TEXT}
    assert dora.command.program.is_dir()
    assert set(dora.files) == {"main.py", "own/helper.py"}
    assert (dora.command.program / "own/helper.py").is_file()
    assert eve.command is None
    assert eve.problem == "it must have one program, but it has a.py, b.py; the one that runs is called __main__.py"


def test_an_export_of_moodle_names_students_and_their_numbers(tmp_path: Path) -> None:
    files: dict[str, str | bytes] = {
        "Ann Lee_1201_assignsubmission_file_/wall.py": TEXT,
        "Bob O'Hara_1202_assignsubmission_file_lamp.py": TEXT,
        "Zoë_1203_assignsubmission_file_/__MACOSX/._x.py": "",
        "Zoë_1203_assignsubmission_file_/task/main.py": TEXT,
        "Zoë_1203_assignsubmission_file_/task/other.py": TEXT,
    }
    found = found_in(tmp_path, zipped(tmp_path / "moodle.zip", files))
    assert [(each.name, each.id, each.participant, each.problem) for each in found] == [
        ("Ann Lee", "Ann-Lee", "1201", ""),
        ("Bob O'Hara", "Bob-O-Hara", "1202", ""),
        ("Zoë", "Zoë", "1203", ""),
    ]


def test_an_export_of_gradescope_names_students(tmp_path: Path) -> None:
    listed = (
        "submission_77:\n  :submitters:\n  - :name: Ann Lee\n    :sid: '5'\n    :email: ann@example.org\n"
        "  :created_at: 2026-11-26\nsubmission_78:\n  :submitters:\n  - :name: Bob\n    :email: bob@example.org\n"
    )
    files = {"submission_metadata.yml": listed, "submission_77/p.py": TEXT, "submission_78/p.py": TEXT}
    in_folder = {f"assignment_9_export/{name}": text for name, text in files.items()}
    found = found_in(tmp_path, zipped(tmp_path / "export.zip", {**in_folder}))
    assert [(each.name, each.email) for each in found] == [("Ann Lee", "ann@example.org"), ("Bob", "bob@example.org")]


def test_a_file_of_the_page_alone_and_within_an_export(tmp_path: Path) -> None:
    data = hand_in.packed({"lamp.py": TEXT.encode()}, {"points": 1}, recording=b"\x89MCAP", page=b"<html>")
    (tmp_path / "ann.zip").write_bytes(data)
    export = zipped(tmp_path / "all.zip", {"Bob_7_assignsubmission_file_/lamp.zip": data})
    for each in found_in(tmp_path, tmp_path / "ann.zip", export):
        assert each.command.file.read_bytes() == TEXT.encode()


def test_what_an_archive_of_a_stranger_may_hold_is_named_and_reaches_nothing(tmp_path: Path) -> None:
    link = zipfile.ZipInfo("link.py")
    link.external_attr = 0o120777 << 16
    with zipfile.ZipFile(tmp_path / "link.zip", "w") as archive:
        archive.writestr(link, "/etc/passwd")
    deep = zipped(tmp_path / "deep.zip", {"deeper.zip": TEXT}).read_bytes()
    held: dict[str, tuple[str, str | bytes, str]] = {
        "outside": ("../../outside.py", TEXT, "names a file outside of it, '../../outside.py'"),
        "absolute": ("/etc/outside.py", TEXT, ""),
        "windows": ("..\\..\\outside.py", TEXT, ""),
        "bomb": ("main.py", b" " * (BYTES_MAX + 1), "more than 10 MiB"),
        "none": ("folder/text.txt", "hello", "no program"),
        "nested": ("deep.zip", deep, "no program"),
        "damaged": ("main.py", os.urandom(1000), ""),
    }
    paths = [zipped(tmp_path / f"{name}.zip", {file: data}) for name, (file, data, _) in held.items()]
    data = bytearray(paths[-1].read_bytes())
    data[100] ^= 255
    paths[-1].write_bytes(data)
    before = set(tmp_path.rglob("*"))
    found = found_in(tmp_path, tmp_path / "link.zip", *paths)
    assert not any(each.command for each in found)
    for each, words in zip(found, ["has a link, 'link.py'", *(words for *_, words in held.values())], strict=True):
        assert words in each.problem
    assert {path for path in set(tmp_path.rglob("*")) - before if path.suffix == ".py"} == set()


def test_names_are_words_that_differ(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "a b\x1b[31m.py").write_text(TEXT)
    first, second = found_in(tmp_path, tmp_path / "one", tmp_path / "two")
    assert first.name == "a b [31m"
    assert (first.id, second.id) == ("a-b-31m", "a-b-31m-2")


def test_a_folder_that_grade_has_not_made_is_not_deleted(tmp_path: Path) -> None:
    (tmp_path / "copies").mkdir()
    (tmp_path / "copies" / "precious.py").write_text(TEXT)
    with pytest.raises(ParameterError, match="the output folder must be new"):
        found_in(tmp_path, tmp_path / "copies")
    assert (tmp_path / "copies" / "precious.py").exists()
    (tmp_path / "empty").mkdir()
    for name, words in (("nowhere.py", r"there is no '.*nowhere.py'"), ("empty", "SUBMISSIONS must hold programs")):
        with pytest.raises(ParameterError, match=words):
            found_in(tmp_path, tmp_path / name)


def test_programs_are_alike_whatever_their_names_comments_and_layout_are() -> None:
    given = "import kiks\nrobot = kiks.Khepera('/dev/ttyUSB0')\nwhile True:\n    values = robot.proximity()\n"
    lines = (
        *("left = values[0] + 2 * values[1]", "right = values[5] * 2 - values[4]", "if left > right and left > 300:"),
        *("    robot.set_speed(-3, 4)", "    robot.pause(0.2)", "elif values[6] > 100:", "    robot.stop()", "else:"),
        *("    robot.set_speed(8, min(8, right // 10))", "for step in range(3):", "    print(robot.encoders()[0])"),
    )
    one = given + "".join(f"    {line}\n" for line in lines)
    other = "# mine\n" + one.replace("values", "w").replace("left", "l").replace("    ", "\t")
    added = one + "    print('something else')\n"
    lines = "left, right = sum(values[:3]), sum(values[3:6])", "robot.set_speed(5 - left // 99, 5 - right // 99)"
    own = given + "".join(f"    {line}\n" for line in lines)
    pairs = alike({"a": one, "b": other, "c": added, "d": own}, given)
    found = {(each.first, each.second): each.share for each in pairs}
    assert found[("a", "b")] == 1
    assert 0.8 <= found[("a", "c")] < 1
    assert not any("d" in pair for pair in found)
    # What all were given, or what is no Python, is no likeness.
    assert alike({"a": given, "b": given}, given) == []
    assert alike({"a": "\0(((", "b": "x" * 100_000}) == []

"""What is handed in: files, folders, archives of platforms; and what a stranger may put into an archive."""

import os
import random
import tarfile
import zipfile
from datetime import UTC, datetime
from pathlib import Path

import pytest

from kiks.errors import ParameterError
from kiks.model.program_kinds import program_text
from kiks.trials import hand_in
from kiks.trials.file_tree import BYTES_MAX
from kiks.trials.similarity import alike
from kiks.trials.students import NOTHING, read_students, with_students
from kiks.trials.submissions import Submission, submissions_in

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
    (home / "hal.ipynb").write_text("{")
    (home / "ina.py").write_text("\n")
    for name in (b"caf\xe9.py", b"fay.m", b"gil.rar", b"ida.tar.gz", b"kim.zip"):
        Path(os.fsdecode(os.fsencode(home) + b"/" + name)).write_text(TEXT)
    for name, text in {"drive.py": "import speeds", "speeds.py": TEXT, "test_drive.py": "import drive"}.items():
        (home / "lea" / name).parent.mkdir(exist_ok=True)
        (home / "lea" / name).write_text(text)
    (home / "empty" / "__pycache__").mkdir(parents=True)
    (home / "link.py").symlink_to("/etc/passwd")
    with tarfile.open(home / "joe.tar.gz", "w:gz") as archive:
        archive.add(home / "dora", "dora")
    found = {each.name: each for each in found_in(tmp_path, tmp_path / "ann.py", home)}
    texts = {name: each.command.file.read_text() for name, each in found.items() if each.command}
    assert (texts.pop("lea"), {*texts.values()}) == ("import speeds", {TEXT})
    assert set(texts) == {"ann", "bob", "caf", "carl", "dora", "fay", "joe"}
    assert (found["ann"].time_s is None, found["joe"].command.program.is_dir()) == (False, True)
    assert set(found["dora"].files) == {"main.py", "own/helper.py"}
    problems = {
        "empty": "it has no program, a file that ends in .py, .ipynb, .m: its folder is empty",
        "eve": "it must have one program, but it has a.py, b.py; the one that runs is called __main__.py",
        "gil": "it has no program, a file that ends in .py, .ipynb, .m: there is gil.rar",
        "hal": "it cannot be read (hal.ipynb must be a notebook of Jupyter",
        "ina": "ina.py has no code",
        "ida": "its archive cannot be read (",
        "kim": "its archive cannot be read (",
        "link": "'link.py' is a link, which is not followed",
    }
    assert {name for name, each in found.items() if each.problem} == set(problems)
    for name, words in problems.items():
        assert words in found[name].problem


def test_an_export_of_moodle_names_students_and_their_numbers(tmp_path: Path) -> None:
    files: dict[str, str | bytes] = {
        "Ann Lee_1201_assignsubmission_file_/wall.py": TEXT,
        "Bob O'Hara_1202_assignsubmission_file_lamp.py": TEXT,
        "Zoë_1203_assignsubmission_file_/__MACOSX/._x.py": "",
        "Zoë_1203_assignsubmission_file_/task/main.py": TEXT,
        "Zoë_1203_assignsubmission_file_/task/other.py": TEXT,
    }
    files |= {
        "Ann Lee_1201_assignsubmission_onlinetext/onlinetext.html": "<p>See the file.</p>",
        "Zoë_1204_assignsubmission_onlinetext_onlinetext.html": "print(1)",
    }
    found = found_in(tmp_path, zipped(tmp_path / "moodle.zip", files))
    assert [(each.name, each.id, each.participant, each.problem) for each in found] == [
        ("Ann Lee", "Ann-Lee", "1201", ""),
        ("Bob O'Hara", "Bob-O-Hara", "1202", ""),
        ("Zoë", "Zoë", "1203", ""),
        ("Zoë", "Zoë-2", "1204", "it has a text that was written online, and no file"),
    ]


def test_an_export_of_gradescope_names_students(tmp_path: Path) -> None:
    listed = """
submission_77:
  :submitters:
  - :name: "Ann \\u00d8"
    :sid: '5'
    :email: ann@example.org
  :created_at: 2026-11-26 10:00:00.000000000 Z
  :results: !ruby/hash:ActiveSupport::HashWithIndifferentAccess {score: 1}
submission_78:
  :submitters:
  - :name: Bob
    :email: b@x.org
  - :name: Cy
    :email: c@x.org
submission_79:
  :submitters: 7
"""
    files = {"submission_metadata.yml": listed, **{f"submission_{number}/p.py": TEXT for number in (77, 78, 79)}}
    in_folder = {f"assignment_9_export/{name}": text for name, text in files.items()}
    found = found_in(tmp_path, zipped(tmp_path / "export.zip", {**in_folder}))
    names = [("Ann Ø", "ann@example.org"), ("Bob, Cy", "b@x.org, c@x.org"), ("submission_79", "")]
    assert [(each.name, each.email) for each in found] == names
    assert found[0].time_s == datetime(2026, 11, 26, 10, tzinfo=UTC).timestamp()
    broken = zipped(tmp_path / "broken.zip", {"submission_metadata.yml": "a: [", "x/p.py": TEXT, "y/p.py": TEXT})
    assert [each.name for each in found_in(tmp_path, broken)] == ["x", "y"]


def test_a_file_of_the_page_alone_and_within_an_export(tmp_path: Path) -> None:
    data = hand_in.packed({"lamp.py": TEXT.encode()}, {"points": 1}, recording=b"\x89MCAP", page=b"<html>")
    (tmp_path / "ann.zip").write_bytes(data)
    export = zipped(tmp_path / "all.zip", {"Bob_7_assignsubmission_file_/lamp.zip": data})
    for each in found_in(tmp_path, tmp_path / "ann.zip", export):
        assert each.command.file.read_bytes() == TEXT.encode()
    for name, kept in {"lamp.m": "program.m", "lamp.ipynb": "program.ipynb", "__main__.py": "program.py"}.items():
        (tmp_path / "ann.zip").write_bytes(hand_in.packed({name: b"{}", "table.csv": b""}, {}, page=b"<html>"))
        (each,) = found_in(tmp_path, tmp_path / "ann.zip")
        assert [*each.files] == [kept]


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
    held["secret"] = ("main.py", TEXT, "its archive has an encrypted file, 'main.py'")
    paths.append(zipped(tmp_path / "secret.zip", {"main.py": TEXT}))
    data = bytearray(paths[-1].read_bytes())
    data[data.find(b"PK\1\2") + 8] |= 1
    paths[-1].write_bytes(data)
    before = set(tmp_path.rglob("*"))
    found = found_in(tmp_path, tmp_path / "link.zip", *paths)
    assert not any(each.command for each in found)
    for each, words in zip(found, ["has a link, 'link.py'", *(words for *_, words in held.values())], strict=True):
        assert words in each.problem
    assert {path for path in set(tmp_path.rglob("*")) - before if path.suffix == ".py"} == set()


def test_a_damaged_or_hostile_entry_costs_its_own_row_alone(tmp_path: Path) -> None:
    held = {
        "ann.py": TEXT,
        "../../out.py": TEXT,
        "a/b": TEXT,
        "a": TEXT,
        "d/" * 999 + "e.py": TEXT,
        "l" * 999 + ".py": TEXT,
    }
    found = found_in(tmp_path, zipped(tmp_path / "class.zip", {**held, "bob/p.py": TEXT}))
    assert {each.name for each in found if each.command} == {"ann", "bob"}
    assert {each.name for each in found if not each.command} == {"out", "a", "d", "l" * 80}
    # Whatever bytes change, no other exception comes out.
    chance, sound = random.Random(1), zipped(tmp_path / "class.zip", {"ann.py": TEXT * 9, "bob.py": TEXT}).read_bytes()
    with tarfile.open(tmp_path / "class.tar.gz", "w:gz") as archive:
        archive.add(tmp_path / "class.zip", "ann.zip")
    for name, whole in (("a.zip", sound), ("b.tar.gz", (tmp_path / "class.tar.gz").read_bytes())):
        for _ in range(60):
            data = bytearray(whole)
            for _ in range(chance.randint(1, 4)):
                data[chance.randrange(len(data))] = chance.randrange(256)
            (tmp_path / name).write_bytes(data)
            assert found_in(tmp_path, tmp_path / name)


def test_students_are_found_on_lists_as_platforms_write_them(tmp_path: Path) -> None:
    home = tmp_path / "class"
    for name in ("Ann_Lee", "Jörg", "who"):
        (home / f"{name}.py").parent.mkdir(exist_ok=True)
        (home / f"{name}.py").write_text(TEXT)
    found = found_in(
        tmp_path, home, zipped(tmp_path / "m.zip", {"B_7_assignsubmission_file_/a.py": TEXT, "who.py": ""})
    )
    late = "Saturday, 28 November 2026, 5:06 PM"
    for data, names in (
        ("Ann Lee\nJörg\n\nCy\n", ["Ann Lee", "Jörg", "Cy"]),
        ("\ufeffName;E-Mail\r\nAnn Lee;a@x\r\nJörg;\r\nCy;\r\n".encode(), ["Ann Lee", "Jörg", "Cy"]),
        ("sep=;\n\nFörnamn;Efternamn;E-postadress\nAnn;Lee;\nJörg;;\nCy;;", ["Ann Lee", "Jörg", "Cy"]),
        ("First name\tLast name\nAnn\tLee\n\tJörg\nCy\t\n".encode("utf-16"), ["Ann Lee", "Jörg", "Cy"]),
        ('"Full name",Email\n"Lee, Ann",a@x\nJo\u0308rg,j\nCy,c'.encode(), ["Lee, Ann", "Jörg", "Cy"]),
        (
            "Identifier,Full name,Email address,Status,Last modified (submission),Last modified (grade)\n"
            f'Participant 7,Ann Lee,a@x,Submitted,"{late}",-\nParticipant 8,Jörg,j@x,,-,\nParticipant 9,Cy,,,-,-\n',
            ["Ann Lee", "Jörg", "Cy"],
        ),
        (
            "ID,Vollständiger Name,E-Mail-Adresse,Zuletzt geändert (Bewertung)\n"
            "Teilnehmer/in7,Ann Lee,a@x,-\nTeilnehmer/in8,Jörg,j@x,\nTeilnehmer/in9,Cy,,",
            ["Ann Lee", "Jörg", "Cy"],
        ),
    ):
        (tmp_path / "names.csv").write_bytes(data if isinstance(data, bytes) else data.encode())
        students = read_students(tmp_path / "names.csv")
        assert [each.name for each in students] == names
        rows, strangers = with_students(found, students)
        assert [each.name for each in rows if each.problem == NOTHING] == ["Cy"]
        is_worksheet = bool(students[0].participant)
        assert [each.name for each in strangers] == ["who", *([] if is_worksheet else ["B"]), "who"]
        if is_worksheet:
            assert [(each.name, each.email, each.last_graded) for each in rows if each.participant == "7"] == [
                ("Ann Lee", "a@x", "-")
            ] * 2
        if late.encode() in (tmp_path / "names.csv").read_bytes():
            assert rows[0].time_s == datetime(2026, 11, 28, 17, 6).timestamp()
    (tmp_path / "names.csv").write_text("Ann;a@x\n")
    with pytest.raises(ParameterError, match="must begin with the names of its columns"):
        read_students(tmp_path / "names.csv")


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
    # So it is in other encodings and with other line ends.
    texts = {
        "bom": b"\xef\xbb\xbf" + one.encode(),
        "latin": b"# coding: latin-1\r\n# \xe9\r\n" + one.replace("\n", "\r\n").encode(),
        "no coding": b"# \xe9\r" + one.replace("\n", "\r").encode(),
        "wide": one.encode("utf-16"),
    }
    pairs = alike({"a": one} | {name: program_text(Path("a.py"), data) for name, data in texts.items()})
    assert [pair.share for pair in pairs] == [1] * 10
    # What all were given, or what is no Python, is no likeness.
    assert alike({"a": given, "b": given}, given) == []
    assert alike({"a": "\0(((", "b": "x" * 100_000}) == []

"""What belongs to a program: what it imports and names of its folder, and nothing else, wherever it is asked for."""

import json
import os
from pathlib import Path

import pytest

from kiks.errors import ParameterError
from kiks.model.program_files import BYTES_MAX, ProgramFiles

FOLDER = (
    *("helper.py", "other.py", "lib/__init__.py", "lib/maths.py", "lib/table.csv", "space/deep.py", "solution.py"),
    *("go.m", "private/turn.m"),
    *("table.csv", "map1.txt", "map2.txt", "data/a.bin", "data/more/b.bin", "data/.hidden", ".secret", "notes.txt"),
)

CASES = {
    "import os, helper": "helper.py",
    "from lib import maths": "lib/__init__.py lib/maths.py",
    "from lib.maths import half": "lib/__init__.py lib/maths.py",
    "import space.deep": "space/deep.py",
    "from . import helper": "helper.py",
    "def late():\n    import other": "other.py",
    "import importlib\nimportlib.import_module('helper')": "helper.py",
    "open('table.csv')": "table.csv",
    "open(HERE + '/table.csv')": "table.csv",
    "open(f'{HERE}/table.csv')": "lib/table.csv table.csv",
    "open(f'map{number}.txt')": "map1.txt map2.txt",
    "open('map%d.txt' % 1); open('map{}.txt'.format(1))": "map1.txt map2.txt",
    "glob.glob('map?.txt')": "map1.txt map2.txt",
    "Path(__file__).with_name('lib') / 'table.csv'": "lib/__init__.py lib/maths.py lib/table.csv table.csv",
    "os.listdir('data')": "data/a.bin data/more/b.bin",
    "print(f'{a}.{b}', f'{a} {b}', '*', '', '.', 'a.b' * 99)": "",
    "open('../beside.txt'); open('.secret'); open('/etc/passwd'); open('away.txt'); open('a\\0b')": "",
    "solution = 1; print('the data of table.csv')": "",
    "def broken(": "",
    "\0": "",
}


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A folder with many files, of which each program needs a few."""
    for name in FOLDER:
        (tmp_path / "home" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "home" / name).write_text("")
    (tmp_path / "beside.txt").write_text("")
    (tmp_path / "home/away.txt").symlink_to(tmp_path / "beside.txt")
    return tmp_path / "home"


def test_what_is_imported_and_named_belongs_to_a_program_and_nothing_else(home: Path) -> None:
    for text, names in CASES.items():
        (home / "drive.py").write_text(text)
        found = ProgramFiles(home / "drive.py")
        assert (next(iter(found.files)), sorted([*found.files][1:])) == ("drive.py", names.split()), text
        assert found.shown == list(found.files.values())
    (home / "drive.py").write_text("")
    assert [*ProgramFiles(home / "drive.py", "", ["table.csv", "-n"]).files] == ["drive.py", "table.csv"]
    (home / "lib/maths.py").write_text("open('table.csv'); from .. import helper; import solution; import lib")
    (home / "drive.py").write_text("import lib.maths")
    belonging = {"drive.py", "lib/__init__.py", "lib/maths.py", "lib/table.csv", "table.csv", "helper.py"}
    assert {*ProgramFiles(home / "drive.py").files} == belonging | {"solution.py"}
    # As a module of a package, it is found from where the package lies; as a folder, all in it is the program.
    assert {*ProgramFiles(home / "lib/maths.py", "lib.maths").files} == belonging - {"drive.py"} | {"solution.py"}
    (home / "__main__.py").write_text("")
    assert {*ProgramFiles(home).files} == {"__main__.py", "drive.py", *FOLDER} - {"data/.hidden", ".secret"}
    assert ProgramFiles(home).shown == [home]


def test_a_program_of_octave_and_a_notebook_have_files_too(home: Path) -> None:
    octave = "y = x';\ngo(y), turn; load table.csv\nd = load('map1.txt'); % notes"
    (home / "lab.m").write_text(octave)
    assert {*ProgramFiles(home / "lab.m").files} == {"lab.m", "go.m", "private/turn.m", "table.csv", "map1.txt"}
    cells = ["%matplotlib inline\nimport helper", "!ls\nopen('table.csv')"]
    made = [{"cell_type": "code", "source": cell} for cell in cells]
    (home / "lab.ipynb").write_text(json.dumps({"nbformat": 4, "cells": made}))
    assert [*ProgramFiles(home / "lab.ipynb").files] == ["lab.ipynb", "helper.py", "table.csv"]


def test_a_change_of_what_belongs_to_it_and_of_nothing_else_is_another_digest(home: Path) -> None:
    (home / "drive.py").write_text("import helper; open('map1.txt'); open('new.txt'); open('large')")
    digests = [ProgramFiles(home / "drive.py").digest]
    (home / "notes.txt").write_text("other notes")
    assert ProgramFiles(home / "drive.py").digest == digests[0]
    for name in ("helper.py", "map1.txt", "new.txt", "drive.py", "large"):
        with (home / name).open("a") as file:
            file.write("# changed")
        os.truncate(home / "large", BYTES_MAX + 1) if name == "large" else None
        digests.append(ProgramFiles(home / "drive.py").digest)
    (home / "helper.py").unlink()
    digests.append(ProgramFiles(home / "drive.py").digest)
    assert len({*digests}) == 7


def test_what_is_packed_is_a_program_again(home: Path, tmp_path: Path) -> None:
    (home / "drive.py").write_text("import lib")
    for program, made in ((home / "drive.py", "copy"), (home / "other.py", "copy/other.py")):
        packed = ProgramFiles(program).pack()
        assert ProgramFiles.unpack(packed, tmp_path / program.stem / "copy") == tmp_path / program.stem / made
        assert sorted(ProgramFiles(tmp_path / program.stem / made).pack().values()) == sorted(packed.values())
    assert {*ProgramFiles(tmp_path / "drive/copy").files} == {"__main__.py", "lib/__init__.py"}
    (home / "drive.py").write_text("open('large')")
    with (home / "large").open("wb") as file:
        file.truncate(BYTES_MAX + 1)
    with pytest.raises(ParameterError, match=r"a program must have at most 200 files and 10 MiB, but drive\.py has"):
        ProgramFiles(home / "drive.py").pack()
    with pytest.raises(ParameterError, match=r"must be one that can be read, but '.*nowhere\.py' cannot"):
        ProgramFiles(home / "nowhere.py").pack()

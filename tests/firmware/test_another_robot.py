"""The page "Another kind of robot": the robot that it adds is built of its blocks, as they stand there, and works."""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from tests.documents import ROOT, Block, Reader, blocks

PAGE = ROOT / "docs" / "howto" / "another_robot.md"
SOURCES = ROOT / "src" / "kiks"
KINDS = Path("model", "robot_kinds.py")
BLOCKS = blocks(PAGE)


def name_of(block: Block) -> str:
    """Return the name of the file that a block is, below `src/kiks`: its first line."""
    return block.code.partition("\n")[0].removeprefix("# ")


FILES = {name_of(block): block.code for block in BLOCKS if "/" in name_of(block)}
(PROGRAM,) = (block.code for block in BLOCKS if block.code.startswith("# around.py\n"))
(ROW,) = (block.code for block in BLOCKS if block.language == "diff")
(COMMAND,) = (block.code for block in BLOCKS if block.language == "sh")


def sources_with_the_robot(folder: Path) -> Path:
    """Make the sources of KiKS with the robot of the page in a folder, and return it: what Python shall find first."""
    copied = folder / "src" / "kiks"
    shutil.copytree(SOURCES, copied)
    for name, code in FILES.items():
        path = copied / name
        assert not path.exists()
        path.parent.mkdir(exist_ok=True)
        path.write_text(code, encoding="utf-8")
    reader = Reader(folder)
    reader.save_at(copied / KINDS)
    reader.do_diff(ROW)
    (folder / "examples").symlink_to(ROOT / "examples")
    (folder / "around.py").write_text(PROGRAM, encoding="utf-8")
    return copied.parent


def test_the_page_touches_one_row_of_what_is_there() -> None:
    assert [line[0] for line in ROW.splitlines()] == ["+", " "]
    assert not [name for name in FILES if (SOURCES / name).exists()]
    folders = {str(Path(name).parent) for name in FILES}
    assert folders == {"firmware/beetle", "model/robots"}
    assert tomllib.loads(FILES["model/robots/beetle.toml"])["kind"] == "beetle"


@pytest.mark.slow
def test_the_robot_of_the_page_works_everywhere(tmp_path: Path) -> None:
    """Its tests run in another process, whose KiKS has the robot; those of all kinds of robots, too."""
    sources = sources_with_the_robot(tmp_path)
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("KIKS_", "PYTEST_"))}
    environment |= {"PYTHONPATH": str(sources), "BEETLE_FOLDER": str(tmp_path), "BEETLE_COMMAND": COMMAND}
    here = Path(__file__).parent
    tests = [str(here / "beetle.py"), str(here / "test_robot_kinds.py")]
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-p", "no:xdist", "--tb=short", *tests]
    # The example in a docstring of the page, too.
    command += [str(sources / "kiks" / "firmware" / "beetle" / "receiver.py")]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False, timeout=400)
    assert done.returncode == 0, done.stdout + done.stderr

"""The engine for browsers: that the file is of these sources, and that building it again gives the same bytes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from kiks.engine.webassembly import section_of
from kiks.export.browser_engine import ENGINE, compilers, sources

pytestmark = pytest.mark.skipif(sys.version_info[:2] != (3, 11), reason="another Python has other digests of sources")


def test_the_file_is_of_these_sources() -> None:
    assert section_of(ENGINE.read_bytes())["sources"] == sources(), "run: make engine"


def test_the_file_names_no_folder() -> None:
    assert b".py" not in ENGINE.read_bytes()


@pytest.mark.slow
def test_the_same_sources_give_the_same_bytes(tmp_path: Path) -> None:
    made_by = section_of(ENGINE.read_bytes())["compilers"]
    if made_by != compilers():
        pytest.skip(f"the file was made by {made_by}, which make other bytes than {compilers()}")
    tool, made = Path(__file__).parents[2] / "tools" / "build_engine.py", tmp_path / "engine.wasm"
    subprocess.run([sys.executable, tool, made], check=True, env=os.environ | {"PYTHONHASHSEED": "7"}, timeout=600)
    assert made.read_bytes() == ENGINE.read_bytes()
    assert b"site-packages" not in made.read_bytes()

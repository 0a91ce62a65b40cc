"""The scripts of the gallery run as they stand, say what came out, and leave a picture.

`make docs` runs all of them for the site and ends with the first that fails, so that `make test` has one.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image
from tests import forked
from tests.at_length import cases

SCRIPTS = Path(__file__).parents[2] / "examples" / "gallery"

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", cases(sorted(path.stem for path in SCRIPTS.glob("*.py"))))
def test_a_script_leaves_a_picture(name: str, tmp_path: Path) -> None:
    code = (SCRIPTS / f"{name}.py").read_text(encoding="utf-8")
    result = forked.run(code=code, cwd=tmp_path, env={"MPLBACKEND": "agg"})
    assert result.returncode == 0, result.stderr
    assert result.stdout
    pictures = [path for path in tmp_path.iterdir() if path.suffix in (".png", ".webp")]
    assert pictures
    for path in pictures:
        assert path.stem.startswith(name)
        with Image.open(path) as picture:
            assert min(picture.size) > 200

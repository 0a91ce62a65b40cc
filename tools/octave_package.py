"""Build the Octave package: python tools/octave_package.py FOLDER.

The result, FOLDER/kiks-octave-VERSION.tar.gz, is for `pkg install`. Everything in it comes from elsewhere: the
functions from matlab/, and the page from docs/howto/matlab.md, whose table gives the categories that
`pkg describe -verbose kiks` lists. Licence and version are those of KiKS.
"""

from __future__ import annotations

import io
import re
import sys
import tarfile
from datetime import date
from pathlib import Path

from kiks.version import __version__

ROOT = Path(__file__).parent.parent
TOOLBOX = ROOT / "matlab"
PAGE = ROOT / "docs" / "howto" / "matlab.md"

DESCRIPTION = """\
Name: kiks
Version: {version}
Date: {date}
Author: The KiKS developers
Maintainer: The KiKS developers
Title: KiKS, a simulator of Khepera robots
Description: {description}
Categories: Robotics
Depends: octave (>= 7.0.0)
License: MIT
"""

SUMMARY = (
    "Programs for the Matlab KiKS, or for a real Khepera robot with kMatlab, run on simulated robots. The simulator "
    "itself is a program of Python, the command kiks, which must be installed, too."
)

ON_LOAD = """\
addpath(fullfile(fileparts(mfilename('fullpath')), 'demos'));
"""

ON_UNLOAD = """\
rmpath(fullfile(fileparts(mfilename('fullpath')), 'demos'));
"""


def version() -> str:
    """Return the version in whole numbers, as `pkg` wants it: 3.1.0 for 3.1.0.dev0."""
    found = re.match(r"\d+\.\d+\.\d+", __version__)
    assert found is not None
    return found[0]


def index() -> str:
    """Return the list of functions by categories, as docs/howto/matlab.md has it, and the demos."""
    page = PAGE.read_text(encoding="utf-8")
    table = page[page.index("## Functions") :].split("\n\n")[1]
    rows = re.findall(r"^\| (\w.*?) \| (.*)\|$", table, re.MULTILINE)
    categories = {name: re.findall(r"`(k\w+)`", row) for name, row in rows}
    categories["demos"] = sorted(path.stem for path in (TOOLBOX / "demos").glob("*.m"))
    lines = ["kiks >> KiKS, a simulator of Khepera robots"]
    for name, functions in categories.items():
        lines += [name.capitalize(), *(f" {function}" for function in functions)]
    return "\n".join(lines) + "\n"


def contents() -> dict[str, bytes]:
    """Return the files of the package by their names."""
    texts = {
        "DESCRIPTION": DESCRIPTION.format(version=version(), date=date.today().isoformat(), description=SUMMARY),
        "INDEX": index(),
        "PKG_ADD": ON_LOAD,
        "PKG_DEL": ON_UNLOAD,
    }
    files = {name: text.encode() for name, text in texts.items()}
    files["COPYING"] = (ROOT / "LICENSE").read_bytes()
    files["doc/matlab.md"] = PAGE.read_bytes()
    for path in sorted(TOOLBOX.rglob("*.m")):
        files[f"inst/{path.relative_to(TOOLBOX).as_posix()}"] = path.read_bytes()
    return files


def build(folder: Path) -> Path:
    """Write the package into a folder and return its file."""
    name = f"kiks-octave-{version()}"
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{name}.tar.gz"
    with tarfile.open(file, "w:gz") as archive:
        for path, data in contents().items():
            member = tarfile.TarInfo(f"{name}/{path}")
            member.size = len(data)
            archive.addfile(member, io.BytesIO(data))
    return file


if __name__ == "__main__":
    print(build(Path(sys.argv[1])))

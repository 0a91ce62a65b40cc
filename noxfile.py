"""Tests under the other interpreters that are here, of those that `pyproject.toml` names: `make interpreters`."""

from __future__ import annotations

import functools
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import nox

PROJECT = nox.project.load_toml("pyproject.toml")
OWN = platform.python_version_tuple()[:2]
OTHERS = [each for each in nox.project.python_versions(PROJECT) if tuple(each.split(".")) != OWN]

# What these tests import beside KiKS; the extra `dev` holds much that has nothing to do with the interpreter.
TESTED_WITH = (
    *("aioserial", "debugpy", "hypothesis", "jsonschema", "pyserial-asyncio"),
    *("pygame; python_version < '3.14'", "pygame-ce; python_version >= '3.14'"),
    *("pytest", "pytest-timeout", "pytest-xdist"),
)
OUTCOMES = ("-m", "tests.outcomes")
PYTEST = ("-m", "pytest", "-n", str(1 + (os.cpu_count() or 1)), "--dist", "worksteal")
PACKAGES, ALL = "tests/script/test_packages.py", {"KIKS_AT_LENGTH": "1"}
"""`make test` runs few of the programs with packages; here, all of them run."""

USE_LIBRARIES = tuple(f"tests/{name}" for name in ("test_libraries.py", "engine", "recording", "client", "cli", "desk"))
"""Most private names of Numba and NiceGUI are used in these, and most of KiKS."""

nox.options.default_venv_backend = "uv|venv"
nox.options.reuse_venv = "yes"
nox.options.error_on_missing_interpreters = True
nox.options.download_python = "never"


def find_pyenv() -> None:
    """Put the interpreters of pyenv, if it is there, before its shims, which start only those that are switched on."""
    root = os.environ.get("PYENV_ROOT")
    if root is None and shutil.which("pyenv"):
        root = subprocess.run(["pyenv", "root"], capture_output=True, text=True, check=True).stdout.strip()
    folders = [] if root is None else sorted(map(str, Path(root).glob("versions/3.*/bin")))
    os.environ["PATH"] = os.pathsep.join([*folders, os.environ["PATH"]])


find_pyenv()
# One that is not here is skipped; one that is here must work.
HERE = [each for each in OTHERS if shutil.which(f"python{each}")]
for missing in sorted({*OTHERS} - {*HERE}):
    print(f"Python {missing} is not here, so nothing is tested under it.")


@functools.cache
def own_outcomes() -> Path:
    """Return the file that says what programs do under the interpreter that runs this."""
    path = Path(tempfile.mkdtemp()) / f"{'.'.join(OWN)}.json"
    subprocess.run([sys.executable, *OUTCOMES, path], check=True)
    return path


@nox.session(python=HERE or False)
def tests(session: nox.Session) -> None:
    """Test what depends on the interpreter, and require the same outcomes of programs, to the bit."""
    if not HERE:
        session.skip("no other Python is here")
    session.install("--quiet", "--editable", ".", *TESTED_WITH)
    session.run("python", "-m", "kiks", "warmup")
    own, other = own_outcomes(), Path(session.create_tmp()) / f"{session.python}.json"
    session.run("python", *OUTCOMES, str(other), str(own))
    expected, found = (json.loads(path.read_text()) for path in (own, other))
    if changed := [name for name in expected if found[name] != expected[name]]:
        session.error(
            f"{changed[0]!r} and {len(changed) - 1} more must do the same under Python {'.'.join(OWN)} and "
            f"{session.python}, but did not. Compare {own} and {other}."
        )
    # What programs do is compared above.
    left_out = [f"--ignore=tests/script/test_{name}.py" for name in ("corpus", "threads", "packages")]
    # Debuggers start many processes: the newest interpreter stands for the others.
    followed = ["tests/debugging"] if session.python == HERE[-1] else []
    session.run("python", *PYTEST, *left_out, "tests/script", "tests/client", *followed)
    session.run("python", *PYTEST, PACKAGES, env=ALL)
    session.run("python", *PYTEST, "-m", "not slow", "tests/ports", "tests/cli")


@nox.session(venv_backend="uv", default=False)
@nox.parametrize("resolution", [nox.param("lowest-direct", id="lowest"), nox.param("highest", id="newest")])
def libraries(session: nox.Session, resolution: str) -> None:
    """Test the lowest or the newest versions of libraries that are allowed, or others, which stand after `--`."""
    bounds = ("--upgrade", "--resolution", resolution)
    session.install("--quiet", *bounds, "--editable", ".", *session.posargs)
    session.install("--quiet", *TESTED_WITH)
    session.run("python", "-m", "kiks", "warmup")
    # Old libraries use what the newest ones that they bring will take away.
    quiet = ("-W", "ignore::DeprecationWarning") if resolution == "lowest-direct" else ()
    session.run("python", *PYTEST, *quiet, "-m", "not slow", *USE_LIBRARIES)


@nox.session(python=False)
def packages(session: nox.Session) -> None:
    """Test all programs with packages under the interpreter that runs this, too."""
    session.run(sys.executable, *PYTEST, PACKAGES, env=ALL)

"""Tests under the other interpreters that are here, of those that `pyproject.toml` names: `make interpreters`."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

import nox

PROJECT = nox.project.load_toml("pyproject.toml")
OWN = platform.python_version_tuple()[:2]
OTHERS = [each for each in nox.project.python_versions(PROJECT) if tuple(each.split(".")) != OWN]

# What these tests import beside KiKS; the extra `dev` holds much that has nothing to do with the interpreter.
TESTED_WITH = (
    *("aioserial", "hypothesis", "jsonschema", "pygame", "pyserial-asyncio"),
    *("pytest", "pytest-timeout", "pytest-xdist"),
)
DEMONSTRATION = ("-m", "kiks", "demo", "follow", "--arena", "examples/arenas/office.toml", "--seconds", "60")

nox.options.default_venv_backend = "uv|venv"
nox.options.reuse_venv = "yes"
nox.options.error_on_missing_interpreters = False


def find_pyenv() -> None:
    """Put the interpreters of pyenv, if it is there, before its shims, which start only those that are switched on."""
    root = os.environ.get("PYENV_ROOT")
    if root is None and shutil.which("pyenv"):
        root = subprocess.run(["pyenv", "root"], capture_output=True, text=True, check=True).stdout.strip()
    folders = [] if root is None else sorted(map(str, Path(root).glob("versions/3.*/bin")))
    os.environ["PATH"] = os.pathsep.join([*folders, os.environ["PATH"]])


find_pyenv()


@nox.session(python=OTHERS)
def tests(session: nox.Session) -> None:
    """Test what depends on the interpreter, and require the same run of a demonstration, to the bit."""
    wheels = ("--only-binary", ":all:", "--no-binary", "kiks")
    session.install("--quiet", *wheels, "--editable", ".", *TESTED_WITH)
    session.run("python", "-m", "kiks", "warmup")
    pytest = ("python", "-m", "pytest", "-n", str(1 + (os.cpu_count() or 1)), "--dist", "worksteal")
    session.run(*pytest, "tests/script", "tests/client")
    session.run(*pytest, "-m", "not slow", "tests/ports", "tests/cli")
    own = state_in(subprocess.run([sys.executable, *DEMONSTRATION], capture_output=True, text=True, check=True).stdout)
    other = state_in(str(session.run("python", *DEMONSTRATION, silent=True)))
    if other != own:
        session.error(f"the demonstration must end in the state {own} of Python {'.'.join(OWN)}, but it was {other}.")


def state_in(output: str) -> str:
    """Return the state at the end of a run."""
    return output.partition("state ")[2].partition(":")[0]

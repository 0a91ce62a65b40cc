"""A wheel that brings compiled kernels: they are used where they fit, and quietly ignored elsewhere."""

import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from llvmlite import binding
from tests.at_length import at_length
from tests.wheels import ROOT, build, install

from kiks.engine import code_cache
from kiks.engine.processor import LEVELS, level_of

RUN = """
from kiks.cli.engine_start import compile_everything
compile_everything()
"""

pytestmark = [
    at_length,
    pytest.mark.skipif(level_of(binding.get_host_cpu_features()) is None, reason="kernels in wheels are for x86-64"),
]


def environment(tmp_path: Path) -> dict[str, str]:
    """Return an environment without any compiled code, for which only what is installed counts."""
    dropped = ("PYTHONPATH", "NUMBA_CACHE_DIR")
    (tmp_path / "temporary").mkdir(exist_ok=True)
    changes = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "TMPDIR": str(tmp_path / "temporary")}
    return {name: value for name, value in os.environ.items() if name not in dropped} | changes


@pytest.fixture(scope="module")
def kernels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder as `tools/compile_kernels.py` fills it, for one level: that of the tests."""
    folder = tmp_path_factory.mktemp("kernels")
    here = next(each for each in code_cache.cache_folders() if each.is_dir())
    (folder / "kiks" / here.name).mkdir(parents=True)
    for path in here.glob("kiks.*.code"):
        shutil.copy(path, folder / "kiks" / here.name)
    return folder


@pytest.fixture(scope="module")
def python(kernels: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the Python of an environment in which the wheel with kernels is installed."""
    folder = tmp_path_factory.mktemp("wheel")
    wheel = build(folder / "dist", KIKS_KERNELS=str(kernels))
    version = f"cp{sys.version_info.major}{sys.version_info.minor}"
    assert f"-{version}-{version}-linux_" in wheel.name
    return install(wheel, folder / "venv") / "python"


def run(python: Path, program: str, tmp_path: Path, **changes: str) -> str:
    """Run a program with the kiks that is installed; return what it prints."""
    program = "import kiks\nassert 'site-packages' in kiks.__file__, kiks.__file__\n" + program
    command, settings = [str(python), "-c", program], environment(tmp_path) | changes
    done = subprocess.run(command, cwd=tmp_path, env=settings, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert all(line.startswith("Compiling the engine") for line in done.stderr.splitlines()), done.stderr
    return done.stdout


def kept(tmp_path: Path) -> list[str]:
    return sorted(path.name for path in tmp_path.rglob("*.code"))


def test_a_first_start_from_a_wheel_with_kernels_compiles_nothing(python: Path, tmp_path: Path) -> None:
    run(python, RUN, tmp_path)
    assert kept(tmp_path) == []


def test_kernels_of_another_numba_or_processor_are_quietly_ignored(python: Path, tmp_path: Path) -> None:
    assert call_one(python, tmp_path) == []
    (of_version,) = call_one(python, tmp_path, "import numba; numba.__version__ = '0.0'\n")
    (of_processor,) = call_one(python, tmp_path, NUMBA_CPU_NAME="generic", NUMBA_CPU_FEATURES="")
    assert {name.partition("-")[0] for name in (of_version, of_processor)} == {"kiks.engine.scalar_math.sin_cos"}


def call_one(python: Path, tmp_path: Path, before: str = "", **changes: str) -> list[str]:
    """Call one kernel in a new process; return the files that its process has written."""
    program = before + "from kiks.engine.scalar_math import sin_cos\nsin_cos(0.5)\n"
    run(python, program, tmp_path, **changes)
    return kept(tmp_path)


def test_a_wheel_without_kernels_is_for_all_computers(tmp_path: Path) -> None:
    assert build(tmp_path).name.endswith("-py3-none-any.whl")


def test_the_same_functions_are_compiled_for_levels_that_are_not_here(kernels: Path, tmp_path: Path) -> None:
    (full,) = (kernels / "kiks").iterdir()
    (tmp_path / "small").mkdir()
    for path in full.glob("*.sin_cos-*"):
        shutil.copy(path, tmp_path / "small")
    program, found = str(ROOT / "tools" / "compile_kernels.py"), {}
    for level in LEVELS:
        settings = {"NUMBA_CPU_NAME": level, "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(tmp_path / level)}
        command = [sys.executable, program, str(tmp_path), "--like", str(tmp_path / "small")]
        subprocess.run(command, env=os.environ | settings, check=True)
        (path,) = (tmp_path / level).rglob("*.code")
        head, _, rest = path.read_bytes().partition(b"\n")
        _, (_, name, features) = pickle.loads(rest[: int(head.split(b" ")[1])])
        found[path.parent.name] = name, features
    assert sorted(found.values()) == [(level, "") for level in LEVELS]
    assert full.name in found or any(name.startswith("NUMBA_") for name in os.environ)

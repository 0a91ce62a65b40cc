"""Settings of Numba with which KiKS cannot work are one line; those in the current folder are left alone."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.at_length import cases

pytestmark = pytest.mark.slow

BAD = {
    "NUMBA_NUM_THREADS=x": "demo",
    "NUMBA_DISABLE_JIT=1": "demo",
    "NUMBA_CPU_FEATURES=avx": "demo",
    "NUMBA_NUM_THREADS=0": "warmup",
    "NUMBA_OPT=9": "evolve",
    "NUMBA_BOUNDSCHECK=yes": "replay",
}


def python(*words: str, folder: Path, **settings: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, **settings}
    command = [sys.executable, "-P", *words]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("setting", cases(BAD, 3))
def test_a_command_refuses_them_in_one_line(setting: str, tmp_path: Path) -> None:
    name, _, value = setting.partition("=")
    words = {
        "demo": ["demo", "square"],
        "evolve": ["evolve", "--out", "out"],
        "replay": ["replay", "--check", "run.mcap"],
    }
    done = python("-m", "kiks", *words.get(BAD[setting], [BAD[setting]]), folder=tmp_path, **{name: value})
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("kiks: Numba must be able to work with")
    assert f"'{name}': '{value}'" in line


@pytest.mark.parametrize("module", ["kiks.control.compiled_function", "kiks.batch.callbacks", "kiks.engine.state"])
def test_whatever_is_imported_first(module: str, tmp_path: Path) -> None:
    done = python("-c", f"import {module}", folder=tmp_path, NUMBA_NUM_THREADS="x")
    assert done.stderr.splitlines()[-1].startswith("kiks.errors.ParameterError: Numba must be able")


def test_a_file_of_the_current_folder_sets_nothing(tmp_path: Path) -> None:
    (tmp_path / ".numba_config.yaml").write_text("disable_jit: 1\nchrome_trace: trace.json\n")
    code = "import yaml, kiks.engine, numba, sys; numba.config.reload_config(); print(numba.config.DISABLE_JIT)"
    for program in (code, code.replace("yaml, ", "").replace("print(", "import yaml; print(")):
        done = python("-W", "error", "-c", program, folder=tmp_path)
        assert (done.stdout, done.stderr) == ("0\n", "")

"""How kernels are compiled: for which processor, with which settings of Numba, linked, and the line that says so."""

from pathlib import Path

import numba
import pytest
from llvmlite import binding
from tests.at_length import AT_LENGTH, cases
from tests.engine.processes import python
from tests.model.refusals import refused

from kiks import engine
from kiks.engine.processor import LEVELS, level_of

pytestmark = pytest.mark.slow

PROGRAM = """
import gc
import kiks
from numba import types
from kiks.engine.code_cache import is_compiled
from kiks.engine.compiling import compiling_s, entry, kernel, linked, make_ready

@kernel
def more(x):
    return x + 1

@linked(types.int64(types.int64))
def twice(x):
    return 2 * more(x)

@linked(types.void(types.float64[::1], types.int64), part="rare")
def fill(numbers, x):
    numbers[0] = twice(x)

@entry
def work(numbers, x):
    if x > 9:
        fill(numbers, x)
    return twice(x) + 1

import numpy as np
numbers = np.zeros(1)
print([work(numbers, x) for x in (1, 2)], is_compiled("twice"), is_compiled("fill"))
try:
    work(numbers, 10)
except RuntimeError as error:
    print("fill" in str(error), str(error).endswith("is not ready"))
make_ready("rare")
print(work(numbers, 10), numbers[0], gc.isenabled(), compiling_s() > 0)

@kiks.controller(parameters=1)
def ahead(sensors, memory, parameters, wheels):
    wheels[:] = parameters

if is_compiled("fill") and __name__ == "__main__":
    ahead.kernel.compile((types.float64[::1],) * 4)
"""

ENGINE = "Compiling the engine for this computer: once, half a minute or so ..."
YOURS = "Compiling functions of yours: some seconds at each start ..."


def test_a_linked_kernel_is_compiled_once_and_whatever_compiles_says_so_once(tmp_path: Path) -> None:
    (tmp_path / "linking.py").write_text(PROGRAM)
    said = []
    for _ in range(2):
        done = python("linking.py", folder=tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
        assert done.returncode == 0, done.stderr
        said.append(done.stderr.splitlines())
        first, missing, later = done.stdout.splitlines()
        assert first.startswith("[5, 7] True ")
        assert missing == "True True"
        assert later.startswith("23 22.0 True ")
    assert said == [[ENGINE, YOURS], [YOURS]]
    assert later.endswith(" False")


SHOWN = """
from kiks.engine.compiling import entry
from kiks.engine.processor import processor
compiler = entry(lambda: None).targetctx.codegen()
assert processor()[1] == compiler.magic_tuple()[2]
print('/'.join(processor()), end='')
"""


def test_a_processor_has_a_level_if_it_has_all_its_features() -> None:
    for level, needed in LEVELS.items():
        assert level_of(dict.fromkeys(needed, True)) == level
        assert level_of(dict.fromkeys(needed, True) | {"amx-tile": True, "sse4a": False}) == level
        assert all(level_of(dict.fromkeys(needed, True) | {each: False}) != level for each in needed)
    assert level_of({"neon": True}) is None


def test_kernels_are_compiled_for_the_level_of_this_computer_unless_the_user_has_set_or_used_another() -> None:
    here, features = binding.get_host_cpu_name(), binding.get_host_cpu_features()
    for program, settings, shown in (
        (SHOWN, {}, f"{level_of(features)}/"),
        (SHOWN, {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": "+sse3"}, "x86-64/+sse3"),
        (SHOWN, {"NUMBA_CPU_NAME": "generic"}, "generic/"),
        ("from numba import njit\nassert njit(lambda x: x + 1)(1) == 2\n" + SHOWN, {}, f"{here}/{features.flatten()}"),
    ):
        has_level = settings or program != SHOWN or level_of(features)
        if has_level and (AT_LENGTH or shown != "generic/"):
            done = python("-c", program, **settings)
            assert done.stdout == shown, done.stderr


BAD = {
    "NUMBA_NUM_THREADS=x": ("demo", "square"),
    "NUMBA_DISABLE_JIT=1": ("demo", "square"),
    "NUMBA_CPU_FEATURES=avx": ("demo", "square"),
    "NUMBA_NUM_THREADS=0": ("warmup",),
    "NUMBA_OPT=9": ("evolve", "--out", "out"),
    "NUMBA_BOUNDSCHECK=yes": ("replay", "--check", "run.mcap"),
}


@pytest.mark.parametrize("setting", cases(BAD))
def test_a_command_refuses_settings_with_which_kiks_cannot_work_in_one_line(setting: str, tmp_path: Path) -> None:
    name, _, value = setting.partition("=")
    done = python("-P", "-m", "kiks", *BAD[setting], folder=tmp_path, **{name: value})
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("kiks: Numba must be able to work with")
    assert f"'{name}': '{value}'" in line


def test_settings_that_numba_takes_and_kiks_cannot_work_with_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value, why in (("DISABLE_JIT", 1, "without its compiler"), ("CPU_FEATURES", "avx", "with [+] or -")):
        with monkeypatch.context() as context:
            context.setenv(f"NUMBA_{name}", str(value))
            context.setattr(numba.config, name, value)
            refused(f"^Numba must be able to work with .*{why}.*'NUMBA_{name}': '{value}'", engine._load_numba)


MODULES = ("kiks.control.compiled_function", "kiks.batch.callbacks", "kiks.engine.state")


@pytest.mark.parametrize("module", cases(MODULES))
def test_they_are_refused_whatever_is_imported_first(module: str, tmp_path: Path) -> None:
    done = python("-P", "-c", f"import {module}", folder=tmp_path, NUMBA_NUM_THREADS="x")
    assert done.stderr.splitlines()[-1].startswith("kiks.errors.ParameterError: Numba must be able")


def test_a_file_of_the_current_folder_sets_nothing(tmp_path: Path) -> None:
    (tmp_path / ".numba_config.yaml").write_text("disable_jit: 1\nchrome_trace: trace.json\n")
    code = "import yaml, kiks.engine, numba, sys; numba.config.reload_config(); print(numba.config.DISABLE_JIT)"
    for program in (code, code.replace("yaml, ", "").replace("print(", "import yaml; print(")):
        done = python("-P", "-W", "error", "-c", program, folder=tmp_path)
        assert (done.stdout, done.stderr) == ("0\n", "")

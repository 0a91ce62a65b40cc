"""How kernels are compiled: linked kernels, and the line that says that something is compiled."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

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
        done = subprocess.run(
            [sys.executable, "linking.py"],
            cwd=tmp_path,
            env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        said.append(done.stderr.splitlines())
        first, missing, later = done.stdout.splitlines()
        assert first.startswith("[5, 7] True ")
        assert missing == "True True"
        assert later.startswith("23 22.0 True ")
    assert said == [[ENGINE, YOURS], [YOURS]]
    assert later.endswith(" False")

"""How long the first start takes: in a clone, where kernels are compiled, and from a wheel that brings them.

Run: python benchmarks/start.py [--json]. Some minutes. Each figure is one start of a process with an empty cache, from
its beginning to the end of what it is named for:

* `start.demo_s`: the follow-wall demo in the office has made its first step, and only its kernels are compiled;
* `start.clone_s`: the same after all kernels of the engine, as `kiks run` compiles them at its first start;
* `start.all_s`: all kernels are compiled, those of batches as well, as `kiks warmup` does;
* `start.batch_s`: the first batch has run, after all kernels of the engine: it compiles its own;
* `start.wheel_s`: the demo's first step, from a copy of the package that brings the kernels, as `make wheel` packs it;
* `start.again_s`: the demo's first step at the second start in a clone.

`NAME_cpu_s` is the time of processors in it, and `NAME_over_calibration` that time in repetitions of a fixed piece of
plain Python, measured in the same run.
"""

from __future__ import annotations

import argparse
import compileall
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import kiks
from calibration import calibration_loops_per_s, report

ARENA = Path(__file__).parent.parent / "examples" / "arenas" / "office.toml"

DEMO = f"""
import kiks
robot = kiks.Khepera(kiks.Simulation(kiks.Arena.load({str(ARENA)!r}), seed=1).port(1))
robot.proximity()
robot.set_speed(5, 5)
"""
ENGINE = "from kiks.cli.engine_start import ready_engine\nready_engine()\n"
BATCH = """
import kiks
kiks.Batch(kiks.Arena.box(1000, 1000), 8).run(kiks.controllers.linear(), [0.0] * 18, seconds=1)
"""
ALL = "from kiks.cli.warmup import warmup\nwarmup()\n"


def start_s(program: str, package: Path, cache: Path) -> tuple[float, float]:
    """Return the real time and the time of processors [s] that a program takes in a process of its own.

    Args:
        program: Its text.
        package: The folder that holds the package.
        cache: The folder for compiled code.
    """
    # Nothing of the user's settings or caches may help or hinder.
    environment = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    environment |= {"PYTHONPATH": str(package), "XDG_CACHE_HOME": str(cache), "TMPDIR": str(cache)}
    cache.mkdir(exist_ok=True)
    before, begin_s = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run([sys.executable, "-c", program], env=environment, check=True, capture_output=True)
    real_s, after = time.perf_counter() - begin_s, resource.getrusage(resource.RUSAGE_CHILDREN)
    return real_s, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def packed(source: Path, cache: Path, target: Path) -> Path:
    """Return a folder with a copy of the package that brings what a cache holds."""
    package = target / "kiks"
    shutil.copytree(source / "kiks", package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(cache / "kiks", package / "engine" / "compiled", dirs_exist_ok=True)
    compileall.compile_dir(package, quiet=1)  # as pip does
    return target


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    options = arguments.parse_args()

    calibration = calibration_loops_per_s()
    source = Path(kiks.__file__).parent.parent
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        times = {
            "demo": start_s(DEMO, source, folder / "demo"),
            "clone": start_s(ENGINE + DEMO, source, folder / "clone"),
            "batch": start_s(BATCH, source, folder / "clone"),
            "all": start_s(ALL, source, folder / "all"),
            "again": start_s(ENGINE + DEMO, source, folder / "all"),
        }
        wheel = packed(source, folder / "all", folder / "wheel")
        times["wheel"] = start_s(ENGINE + DEMO, wheel, folder / "empty")
    rows = []
    for name, (real_s, cpu_s) in times.items():
        rows.append((f"start.{name}_s", real_s, "s"))
        rows.append((f"start.{name}_cpu_s", cpu_s, "s of processors"))
        rows.append((f"start.{name}_over_calibration", cpu_s * calibration, "calibration loops"))
    report(rows, as_json=options.json)


if __name__ == "__main__":
    main()

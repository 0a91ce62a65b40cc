"""Compiles the kernels for every level of x86-64, into a folder that a wheel can bring.

Run: python tools/compile_kernels.py FOLDER. `make wheel` does it, and `tools/kernels_in_wheel.py` puts the folder into
the wheel.

First the engine and the batch run for this computer's level, which tells with which types each function is called. Then
processes side by side compile the same functions for the other levels. They run none of that code, so this computer
need not be able to.
"""

from __future__ import annotations

import argparse
import importlib
import logging
import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path


def compile_by_running() -> None:
    """Compile all kernels for the processor of this process."""
    from kiks.cli.engine_start import compile_batch, compile_everything

    compile_everything()
    compile_batch()


def compile_like(folder: Path) -> None:
    """Compile the functions that a folder holds code of, for the processor of this process, and run none.

    Args:
        folder: What `compile_by_running` has filled.
    """
    import kiks.batch.batch
    import kiks.sim.simulation  # noqa: F401  # they define the types of signatures

    for path in sorted(folder.glob("*.code")):
        module, name = path.name.rsplit("-", 2)[0].rsplit(".", 1)
        head, _, rest = path.read_bytes().partition(b"\n")
        signature, _ = pickle.loads(rest[: int(head.split(b" ")[1])])
        getattr(importlib.import_module(module), name).compile(tuple(signature))


def start(root: Path, level: str, *arguments: str) -> subprocess.Popen[bytes]:
    """Start this program for a level."""
    settings = {"NUMBA_CPU_NAME": level, "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(root)}
    return subprocess.Popen([sys.executable, __file__, str(root), *arguments], env=os.environ | settings)


def folders(root: Path) -> list[Path]:
    """Return the folders of code that have been filled, one for each level."""
    return [each for each in (root / "kiks").iterdir() if each.is_dir()]


def fill(root: Path) -> None:
    """Fill an empty folder with the code for all levels.

    Raises:
        SystemExit: If a process fails, or this computer has none of the levels.
    """
    from llvmlite import binding

    from kiks.engine.processor import LEVELS, level_of

    own = level_of(binding.get_host_cpu_features())
    if own is None:
        raise SystemExit("The kernels in a wheel are for x86-64-v2 and above, but this processor is another.")
    if start(root, own, "--run").wait():
        raise SystemExit(f"The kernels could not be compiled for {own}.")
    (filled,) = folders(root)
    others = {level: start(root, level, "--like", str(filled)) for level in LEVELS if level != own}
    failed = [level for level, process in others.items() if process.wait()]
    if failed:
        raise SystemExit(f"The kernels could not be compiled for {' and '.join(failed)}.")
    counts = {len(list(folder.iterdir())) for folder in folders(root)}
    if len(counts) != 1 or len(folders(root)) != len(LEVELS):
        raise SystemExit(f"Each level must have the same functions, but their numbers are {sorted(counts)}.")


def main() -> None:
    """Read the command line."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path, help="what to fill; anything in it is deleted")
    arguments.add_argument("--run", action="store_true", help=argparse.SUPPRESS)
    arguments.add_argument("--like", type=Path, help=argparse.SUPPRESS)
    options = arguments.parse_args()
    logging.basicConfig(level=logging.WARNING)
    if options.run:
        compile_by_running()
    elif options.like:
        compile_like(options.like)
    else:
        shutil.rmtree(options.folder, ignore_errors=True)
        options.folder.mkdir(parents=True)
        fill(options.folder.absolute())


if __name__ == "__main__":
    main()

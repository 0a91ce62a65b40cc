"""Mutation testing: plant faults in a copy of KiKS, one at a time, and say which of them the tests find.

It judges whether a change of the tests loses protection: what was found before it is found after it. The faults are in
`planted_faults.toml`. First the tests near a fault run. With --whole, all tests run once with all those faults together
that the near tests do not find, and then what has failed with each fault alone. Results stay in a file, so that the
same command goes on after Ctrl-C. The copy is that of the last commit, with a compiled engine of its own.

    python tools/mutation.py --baseline
    python tools/mutation.py --only redo-goes-nowhere default-gain
    python tools/mutation.py --whole --checkout ../before
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
TABLE = Path(__file__).with_name("planted_faults.toml")

NEAR_S, WHOLE_S = 1800, 7200
"""Time limits of the near tests of a fault, and of all tests [s]: with a fault that hangs, they are over."""

NEAR = ("-x", "-n", "2")
WHOLE = ("-n", "3", "--dist", "worksteal")


@dataclass(frozen=True)
class Fault:
    """A row of the table.

    Attributes:
        name: Its name.
        file: The file, seen from the repository.
        old: A text that the file has once.
        new: What takes its place.
        wrong: What goes wrong, in a sentence.
        tests: The tests that are near, as arguments of pytest.
    """

    name: str
    file: str
    old: str
    new: str
    wrong: str
    tests: tuple[str, ...]

    @property
    def digest(self) -> str:
        """A digest of the row: results of another row of this name do not count."""
        return hashlib.sha256(repr(self).encode()).hexdigest()[:16]

    def plant(self, root: Path) -> None:
        """Plant it in a checkout."""
        file = root / self.file
        text = file.read_bytes() if file.exists() else b""
        if (count := text.count(self.old.encode())) != 1:
            sys.exit(f"{self.name}: {self.file} must have its old text once, but has it {count} times. Write it anew.")
        file.write_bytes(text.replace(self.old.encode(), self.new.encode()))

    def near(self, root: Path) -> list[str]:
        """Return the near tests that a checkout has: another commit may not have all."""
        tests = [test for test in self.tests if (root / test.partition("::")[0]).exists()]
        return tests or sys.exit(f"{self.name}: a near test must be in {root}, but none of {self.tests} is.")


def load_faults() -> list[Fault]:
    """Return the rows of the table."""
    rows = tomllib.loads(TABLE.read_text(encoding="utf-8"))["fault"]
    return [Fault(**row | {"tests": tuple(row["tests"])}) for row in rows]


class Result(NamedTuple):
    """What tests say about a fault.

    Attributes:
        is_found: Whether they find it.
        by: The first test that fails, or what happened instead.
        seconds: How long they took.
    """

    is_found: bool
    by: str
    seconds: int


class Copy:
    """A checkout of the last commit of another one, with an environment whose commands run its own sources.

    Args:
        checkout: The checkout, whose environment is complete.
        folder: An empty folder.
    """

    def __init__(self, checkout: Path, folder: Path) -> None:
        if not (checkout / ".venv" / "bin" / "python").exists():
            sys.exit(f"{checkout} must have an environment, but it has none. Run make setup there.")
        self.root, self._output = folder / "kiks", folder / "output.txt"
        subprocess.run(["git", "clone", "--quiet", checkout, self.root], check=True)
        if (shared := checkout.parent / "shared").exists():
            (folder / "shared").symlink_to(shared.resolve())  # measured samples, which some tests read
        copy_environment(checkout, self.root)
        cache = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        if (code := Path(cache, "kiks")).exists():
            shutil.copytree(code, folder / "code" / "kiks")
        # Python keeps bytecode, as in `make test`.
        self._environment = os.environ | {"NUMBA_CACHE_DIR": str(folder / "code"), "PYTHONDONTWRITEBYTECODE": ""}

    @contextmanager
    def planted(self, faults: Sequence[Fault]) -> Iterator[None]:
        """Have faults in the copy meanwhile."""
        before = {file: file.read_bytes() for fault in faults if (file := self.root / fault.file).exists()}
        try:
            for fault in faults:
                fault.plant(self.root)
            yield
        finally:
            for file, text in before.items():
                file.write_bytes(text)

    def test(self, faults: Sequence[Fault], words: Sequence[str], limit_s: float) -> tuple[int | None, list[str], int]:
        """Run pytest with faults.

        Returns:
            Its exit code, None if it was not done in time; the tests that failed; how long it took [s].
        """
        command = [self.root / ".venv" / "bin" / "python", "-m", "pytest", "-q", "-rfE", *words]
        begin_s = time.monotonic()
        # No pipe: a process that a test leaves behind would keep it open.
        with self.planted(faults), self._output.open("wb") as output:
            process = subprocess.Popen(
                command,
                cwd=self.root,
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            try:
                code: int | None = process.wait(limit_s)
            except subprocess.TimeoutExpired:
                code = None
            finally:
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGKILL)
                    process.wait()
        text = self._output.read_text(encoding="utf-8", errors="replace")
        failed = re.findall(r"^(?:FAILED|ERROR) (\S+?\.py.*?)(?: - .*)?$", text, re.MULTILINE)
        return code, failed, round(time.monotonic() - begin_s)

    def try_fault(self, fault: Fault, words: Sequence[str]) -> Result:
        """Return what some tests say about a fault."""
        code, failed, seconds = self.test([fault], [*NEAR, *words], NEAR_S)
        if code is None:
            return Result(True, "timeout", seconds)
        return Result(code != 0, failed[0] if failed else f"pytest ends with {code}" if code else "", seconds)


def copy_environment(checkout: Path, copy: Path) -> None:
    """Copy the environment of a checkout by links, but the files that name the checkout."""

    def link(source: str, target: str) -> None:
        try:
            os.link(source, target)
        except OSError:  # another disk
            shutil.copy2(source, target)

    home = copy / ".venv"
    shutil.copytree(checkout / ".venv", home, symlinks=True, copy_function=link)
    packages = [*home.glob("lib/*/site-packages/*.pth"), *home.glob("lib/*/site-packages/kiks-*.dist-info/*")]
    for file in [home / "pyvenv.cfg", *home.glob("bin/*"), *packages]:
        if not file.is_symlink() and file.is_file() and bytes(checkout) in (data := file.read_bytes()):
            mode = file.stat().st_mode
            file.unlink()
            file.write_bytes(data.replace(bytes(checkout), bytes(copy)))
            file.chmod(mode)


class Results:
    """Results, also of earlier starts, in a file.

    Args:
        file: The file, of JSON.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        self._known: dict[str, list[Any]] = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}

    def of(self, fault: Fault, kind: str) -> Result | None:
        """Return what tests of a kind, 'near' or 'whole', have said about a fault; None if they did not run."""
        known = self._known.get(f"{fault.name} {fault.digest} {kind}")
        return None if known is None else Result(*known)

    def note(self, fault: Fault, kind: str, result: Result) -> Result:
        """Keep a result, and return it."""
        self._known[f"{fault.name} {fault.digest} {kind}"] = list(result)
        self._file.parent.mkdir(parents=True, exist_ok=True)
        self._file.write_text(json.dumps(self._known, indent=1), encoding="utf-8")
        return result


def check_baseline(copy: Copy, faults: Sequence[Fault]) -> None:
    """End if near tests fail without a fault."""
    tests = sorted({test for fault in faults for test in fault.near(copy.root)})
    code, failed, seconds = copy.test([], ["-n", "2", *tests], WHOLE_S)
    if code != 0:
        sys.exit(f"Near tests must pass without a fault, but pytest ended with {code}: {failed}")
    print(f"Near tests pass without a fault, in {seconds} s.", flush=True)


def try_whole(copy: Copy, faults: Sequence[Fault], results: Results) -> None:
    """Run all tests with faults together, and then those that fail with each fault alone."""
    code, failed, seconds = copy.test(faults, WHOLE, WHOLE_S)
    print(f"All tests with {len(faults)} faults together: {len(failed)} fail, in {seconds} s.", flush=True)
    if code != 0 and not failed:
        sys.exit(f"All tests with these faults must end, but pytest ended with {code}. Choose fewer by --only.")
    # With all examples of a test: their names may have blanks.
    suspects = {test.partition("[")[0] for test in failed}
    amiss = {test.partition("[")[0] for test in copy.test([], ["-n", "2", *suspects], WHOLE_S)[1]} if suspects else ()
    for test in sorted(amiss):
        print(f"It fails without a fault, too: {test}", flush=True)
    suspects -= set(amiss)
    for fault in faults:
        results.note(fault, "whole", copy.try_fault(fault, sorted(suspects)) if suspects else Result(False, "", 0))


def main() -> None:
    """Plant the faults, and print a row for each."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False
    )
    parser.add_argument("--only", nargs="+", metavar="NAME", help="the faults to plant; all if left out")
    parser.add_argument("--baseline", action="store_true", help="check first that near tests pass without a fault")
    parser.add_argument("--whole", action="store_true", help="run all tests for faults that near tests do not find")
    parser.add_argument("--checkout", type=Path, default=ROOT, help="the checkout whose last commit is tested")
    parser.add_argument("--results", type=Path, help="file of results; build/mutation-COMMIT.jsonl if left out")
    told = parser.parse_args()
    checkout, faults = told.checkout.resolve(), load_faults()
    if unknown := set(told.only or ()) - {fault.name for fault in faults}:
        parser.error(f"--only must name faults of {TABLE.name}, but has {', '.join(sorted(unknown))}")
    faults = [fault for fault in faults if not told.only or fault.name in told.only]
    commit = subprocess.check_output(["git", "-C", checkout, "rev-parse", "--short=8", "HEAD"], text=True).strip()
    results = Results(told.results or ROOT / "build" / f"mutation-{commit}.jsonl")

    def tell(fault: Fault, kind: str, result: Result) -> None:
        found = "found" if result.is_found else "NOT found"
        print(f"{fault.name:30} {kind:6} {found:10} {result.seconds:5} s  {result.by}", flush=True)

    with tempfile.TemporaryDirectory(prefix="kiks-mutation-", ignore_cleanup_errors=True) as folder:
        copy = Copy(checkout, Path(folder))
        with copy.planted(faults):
            pass  # what cannot be planted is said before the first test
        if told.baseline:
            check_baseline(copy, faults)
        left = []
        for fault in faults:
            near = results.of(fault, "near")
            near = near or results.note(fault, "near", copy.try_fault(fault, fault.near(copy.root)))
            tell(fault, "near", near)
            left += [] if near.is_found else [fault]
        if told.whole and (untried := [fault for fault in left if not results.of(fault, "whole")]):
            try_whole(copy, untried, results)
        for fault in left if told.whole else ():
            tell(fault, "whole", results.of(fault, "whole") or Result(False, "", 0))
    missed = [fault for fault in left if not (whole := results.of(fault, "whole")) or not whole.is_found]
    print(f"{len(faults) - len(missed)} of {len(faults)} faults are found in {commit}.")
    for fault in missed:
        print(f"Not found: {fault.name} in {fault.file}: {fault.wrong}")


if __name__ == "__main__":
    main()

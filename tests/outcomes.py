"""What programs do under this Python: those of the corpus, threads that do random steps, and a demonstration.

Arguments: the file to write, in JSON; then that of another Python, if there is one, whose threads do the same steps.
Those are the names of their outcomes.
"""

from __future__ import annotations

import gc
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, Phase, given, settings
from tests.cli.test_cli import KIKS
from tests.script.test_corpus import run_alone
from tests.script.test_threads import PROGRAMS, run_threads

COUNT = 200
"""Number of programs of several threads."""
DEMONSTRATION = ("demo", "follow", "--arena", "examples/arenas/office.toml", "--seconds", "60")


def random_programs() -> list[Any]:
    """Return programs of several threads."""
    drawn: list[Any] = []

    @settings(
        max_examples=COUNT,
        derandomize=True,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=[HealthCheck.too_slow],
    )
    @given(PROGRAMS)
    def draw(program: list[Any]) -> None:
        drawn.append(program)

    draw()
    # Hypothesis measures the collection of garbage, in programs that run here by their clock.
    gc.callbacks.clear()
    return drawn


def main(path: str, other: str = "") -> None:
    if other:
        programs = [json.loads(name) for name in json.loads(Path(other).read_text()) if name.startswith("[")]
    else:
        programs = random_programs()
    outcomes: dict[str, Any] = {json.dumps(program): run_threads(program) for program in programs}
    demonstration = subprocess.run([*KIKS, *DEMONSTRATION], capture_output=True, text=True, check=True)
    outcomes[" ".join(DEMONSTRATION)] = demonstration.stdout.partition("state ")[2]
    with tempfile.TemporaryDirectory() as folder:
        outcomes |= run_alone(Path(folder), again=())[0]
    Path(path).write_text(json.dumps(outcomes, indent=1))


if __name__ == "__main__":
    main(*sys.argv[1:])

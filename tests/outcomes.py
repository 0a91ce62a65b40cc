"""What programs do under this Python: those of the corpus, threads that do random steps, and a demonstration.

Arguments: the file to write, in JSON; then that of another Python, if there is one, whose threads do the same steps.
Those are the names of their outcomes.
"""

import gc
import json
import signal
import sys
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, Phase, given, settings
from tests import forked
from tests.script.test_corpus import CORPUS, run_alone
from tests.script.test_threads import PROGRAMS, run_threads

COUNT = 200
"""Number of programs of several threads."""
DEMONSTRATION = ("demo", "follow", "--arena", "examples/arenas/office.toml", "--seconds", "60")


def random_programs() -> list[Any]:
    """Return programs of several threads."""
    drawn: list[Any] = []

    quiet = [HealthCheck.too_slow]

    @settings(max_examples=COUNT, derandomize=True, database=None, phases=[Phase.generate], suppress_health_check=quiet)
    @given(PROGRAMS)
    def draw(program: list[Any]) -> None:
        drawn.append(program)

    draw()
    # Hypothesis measures the collection of garbage, in programs that run here by their clock.
    gc.callbacks.clear()
    return drawn


def main(path: str, other: str = "") -> None:
    # As in tests/conftest.py: programs here send themselves Ctrl-C.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if other:
        programs = [json.loads(name) for name in json.loads(Path(other).read_text()) if name.startswith("[")]
    else:
        programs = random_programs()
    outcomes: dict[str, Any] = {json.dumps(program): run_threads(program) for program in programs}
    demonstration = forked.run(*DEMONSTRATION)
    assert demonstration.returncode == 0, demonstration.stderr
    outcomes[" ".join(DEMONSTRATION)] = demonstration.stdout.partition("state ")[2]
    outcomes |= {name: run_alone(name) for name in CORPUS}
    Path(path).write_text(json.dumps(outcomes, indent=1))


if __name__ == "__main__":
    main(*sys.argv[1:])

"""A busy computer, on which the operating system runs programs in an ever different order."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

SPIN = [sys.executable, "-c", "while True: pass"]


@contextmanager
def busy_computer(processes: int = 2) -> Iterator[None]:
    """Keep processors busy until the block ends."""
    with ExitStack() as stack:
        for _ in range(processes):
            process = stack.enter_context(subprocess.Popen(SPIN))
            stack.callback(process.kill)
        yield

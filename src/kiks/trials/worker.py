"""A warm worker of a crew: `python -m kiks.trials.worker SOCKET` takes jobs, and sends the result of each."""

from __future__ import annotations

import gc
import logging
import signal
import sys
from contextlib import suppress
from multiprocessing.connection import Connection

import kiks.trials.one_run  # noqa: F401 (what most jobs need: loaded before the collector leaves out what is there)
from kiks.ending import end_with_parent
from kiks.errors import KiksError
from kiks.trials.crew import JobResult
from kiks.trials.sandboxes import sandboxes_of_process


def main() -> None:
    """Take jobs from the socket until it ends."""
    end_with_parent()
    # Ctrl-C is for the process that hands out the jobs, which ends this one.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    logging.getLogger("kiks").setLevel(logging.CRITICAL)
    gc.freeze()
    # The process that hands them out may have been killed.
    with suppress(EOFError, ConnectionError), Connection(int(sys.argv[1])) as connection:
        while True:
            job = connection.recv()
            try:
                result = JobResult(job())
            except KiksError as error:
                result = JobResult(error=str(error))
            connection.send(result)
    sandboxes_of_process().close()


if __name__ == "__main__":
    main()
    sys.exit(0)

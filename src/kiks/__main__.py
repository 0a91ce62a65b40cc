"""`python -m kiks` is the command `kiks`."""

import os
import sys

from kiks.ending import end_at_once, tell
from kiks.ports.environment_marks import HASH_SEED, SAFE_PATH

_DEBUGGERS = {"bdb", "pydevd", "_pydevd_bundle"}
"""Modules of debuggers: the second one may run under another name."""


def main() -> None:
    """Run the command."""
    words = sys.argv[1:]
    if words[:1] == ["run"] and sys.orig_argv[-len(words) :] == words and not HASH_SEED.keys() & os.environ.keys():
        # This command runs a program in this process, and the order of its sets is settled when the process starts.
        if not _DEBUGGERS & sys.modules.keys():
            os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], os.environ | HASH_SEED)
        # A new process would be without the debugger.
        tell(
            "sets of texts have the same order in each run if PYTHONHASHSEED is set before a debugger starts, but it "
            'is not: set it to 2000, in launch.json of VS Code by "env": {"PYTHONHASHSEED": "2000"}.'
        )
    end_at_once()
    # The current folder may be a stranger's: processes that libraries start import nothing from it, either.
    os.environ.update(SAFE_PATH | os.environ)
    from kiks.cli import main as run_command

    run_command()


if __name__ == "__main__":
    main()

"""`python -m kiks` is the command `kiks`."""

import os
import sys

from kiks.ending import end_at_once


def main() -> None:
    """Run the command."""
    words = sys.argv[1:]
    if words[:1] == ["run"] and sys.orig_argv[-len(words) :] == words and "PYTHONHASHSEED" not in os.environ:
        # Sets of strings must have the same order in each run of a program. Python reads this when it starts.
        os.environ["PYTHONHASHSEED"] = "0"
        os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])
    end_at_once()
    # The current folder may be a stranger's: processes that libraries start import nothing from it, either.
    os.environ.setdefault("PYTHONSAFEPATH", "kiks")
    from kiks.cli import main as run_command

    run_command()


if __name__ == "__main__":
    main()

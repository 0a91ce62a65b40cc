"""`python -m kiks` is the command `kiks`."""

import os

from kiks.ending import end_at_once


def main() -> None:
    """Run the command."""
    end_at_once()
    # The current folder may be a stranger's: processes that libraries start import nothing from it, either.
    os.environ.setdefault("PYTHONSAFEPATH", "kiks")
    from kiks.cli import main as run_command

    run_command()


if __name__ == "__main__":
    main()

"""`python -m kiks` is the command `kiks`."""

from kiks.ending import end_at_once


def main() -> None:
    """Run the command."""
    end_at_once()
    from kiks.cli import main as run_command

    run_command()


if __name__ == "__main__":
    main()

"""`python -m kiks` is the command `kiks`."""

from kiks.cli import main

main()

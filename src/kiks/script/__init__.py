"""Whole Python programs, unchanged, in simulated time: their threads, clocks, ports and event loops."""

import sys

from kiks.errors import KiksError
from kiks.script.cpython import check_interpreter

try:
    check_interpreter()
except KiksError as error:
    # The other modules look at the insides when they are imported, and a traceback would say less.
    sys.exit(f"kiks: {error}")

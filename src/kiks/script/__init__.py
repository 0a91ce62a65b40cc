"""Whole Python programs, unchanged, in simulated time: their threads, clocks, ports and event loops."""

import os
import sys

from kiks.errors import KiksError
from kiks.script.cpython import check_interpreter

if not hasattr(os, "openpty"):
    sys.exit(
        "kiks: a program in simulated time must run on Linux, but this system has no pseudo-terminals. Let the program "
        "open the port kiks://1 instead."
    )
try:
    check_interpreter()
except KiksError as error:
    # The other modules look at the insides when they are imported, and a traceback would say less.
    sys.exit(f"kiks: {error}")

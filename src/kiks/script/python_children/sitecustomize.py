"""Any version of Python runs this file at its start, if the folder is in its `PYTHONPATH` (`script/children.py`).

It tells the simulated program, one of whose child processes it is, and ends: its time and its ports would be real.
"""

import os
import sys

_PROGRAM = os.environ.get("KIKS_PROGRAM")
if _PROGRAM:
    try:
        with open(_PROGRAM, "wb", 0) as pipe:
            pipe.write(b"1")
    except OSError:
        sys.stderr.write(
            "kiks: a program in simulated time must start no process of Python, but one of its child processes did. "
            "Name it beside this one: kiks run A.py B.py; or run it on kiks serve, where time is real.\n"
        )
    os._exit(1)

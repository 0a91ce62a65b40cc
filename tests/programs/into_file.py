"""Runs a program whose output goes to a file, not among that of others. Arguments: file, program, its own."""

import runpy
import sys

_, file, *sys.argv = sys.argv
with open(file, "w") as sys.stdout:
    runpy.run_path(sys.argv[0], run_name="__main__")

"""Runs a program whose output goes to a file, not among that of others. Arguments: file, program, its own."""

import os
import runpy
import sys

_, file, *sys.argv = sys.argv
os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 1)
runpy.run_path(sys.argv[0], run_name="__main__")

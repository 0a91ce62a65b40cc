"""Does `kiks run` for many programs, each in a fork of one process that has the engine ready.

Arguments: a folder for what they print, two files for each run; how many at once; options of `kiks run`; then "--" and
a word for each run: its name, program and arguments, as a shell has them.
"""

import os
import shlex
import signal
import sys
import tempfile
from pathlib import Path

from kiks.cli import main
from kiks.cli.engine_start import compile_everything

folder, at_once = Path(sys.argv[1]), int(sys.argv[2])
middle = sys.argv.index("--")
options, runs = sys.argv[3:middle], sys.argv[middle + 1 :]
compile_everything()
# A shell lets what it starts in the background ignore Ctrl-C, and a program that sends itself one would never end.
signal.signal(signal.SIGINT, signal.default_int_handler)


def run(name, *words):
    """Run one in this process, which ends with it."""
    for descriptor, kind in ((1, "out"), (2, "err")):
        os.dup2(os.open(folder / f"{name}.{kind}", os.O_WRONLY | os.O_CREAT | os.O_TRUNC), descriptor)
    # The names of temporary files follow from the seed: in one folder, programs would be in each other's way.
    (own := folder / f"{name.partition('.')[0]}.tmp").mkdir(exist_ok=True)
    os.environ["TMPDIR"], tempfile.tempdir = str(own), None
    sys.argv = ["kiks", "run", *options, *words]
    try:
        main()
    except SystemExit as leaving:
        code = leaving.code
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code if isinstance(code, int) else 1)


running = 0
while runs or running:
    if runs and running < at_once:
        words = shlex.split(runs.pop(0))
        if os.fork() == 0:
            run(*words)
        running += 1
    else:
        os.wait()
        running -= 1

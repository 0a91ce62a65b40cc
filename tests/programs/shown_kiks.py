"""The command `kiks` as pages show it: what waits for a person ends when it is ready.

Usage: python shown_kiks.py 'COMMAND' short|whole WORDS..., where COMMAND is what does the work. Evolutions and matches
are short or whole.
"""

import re
import shlex
import subprocess
import sys

READY = re.compile(r"The desk: http|For you alone: http|  TCP  ")
"""How the line begins that says where a desk, a room or a served robot is."""

_, command, length, *words = sys.argv
if length == "short" and words[0] == "evolve":
    words = ["2" if before == "--seeds" else word for before, word in zip(["", *words], words, strict=False)]
    words += ["--generations", "12", "--population", "6"]
if length == "short" and words[:2] == ["demo", "soccer"] and "--seconds" not in words:
    words[2:2] = ["--seconds", "20"]
process = subprocess.Popen([*shlex.split(command), *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
assert process.stdout is not None
for line in process.stdout:
    print(line, end="", flush=True)
    if READY.match(line):
        process.terminate()
        process.wait()
        sys.exit(0)
sys.exit(process.wait())

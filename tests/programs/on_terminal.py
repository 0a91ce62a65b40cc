"""Runs a command on a terminal of its own; what it prints beside its screens is printed.

A person types `q` and Enter when it says `ready`.
"""

import os
import pty
import re
import sys

os.environ["TERM"] = "xterm"
process, terminal = pty.fork()
if process == 0:
    os.execvp(sys.argv[1], sys.argv[1:])
shown = b""
try:
    while piece := os.read(terminal, 1 << 16):
        if b"ready" in piece:
            os.write(terminal, b"q\n")
        shown += piece
except OSError:
    # Nobody has the terminal any more.
    pass
_, status = os.waitpid(process, 0)
# A screen lasts from the one of these to the other; then the cursor goes back to the left.
text = re.sub(rb"\x1b\[\?1049h.*\x1b\[\?1049l.*?\x1b>", b"", shown, flags=re.DOTALL)
sys.stdout.write(text.replace(b"\r\n", b"\n").decode())
sys.exit(os.waitstatus_to_exitcode(status))

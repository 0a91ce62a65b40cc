"""The tests find the same around them however they are started, and so does all that they start."""

import os
import subprocess
import sys

from tests import forked

SHOW = """
import locale, os, signal, time
ignored = {number for number in signal.valid_signals() if signal.getsignal(number) is signal.SIG_IGN}
blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ())
umask = os.umask(0)
os.umask(umask)
names = [name for name in ("COLUMNS", "DISPLAY", "https_proxy", "LC_TIME", "KIKS_ROBOT") if name in os.environ]
show = *sorted(ignored), blocked, umask, names, os.environ["LC_ALL"], locale.getencoding(), time.tzname
print(*show, flush=True)
"""

KNOWN = f"13 25 set() {0o022} [] C.UTF-8 UTF-8 ('UTC', 'UTC')\n"
"""Python itself ignores SIGPIPE and SIGXFSZ."""

HOSTILE = """
import os, signal
for number in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM, signal.SIGTSTP, signal.SIGTTOU, signal.SIGUSR1):
    signal.signal(number, signal.SIG_IGN)
signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGCHLD})
os.umask(0o077)
os.environ |= {"COLUMNS": "20", "DISPLAY": ":7", "https_proxy": "http://proxy", "LC_TIME": "C", "KIKS_ROBOT": "2"}
os.environ |= {"LC_ALL": "POSIX", "TZ": "Asia/Tokyo"}
"""


def test_signals_rights_and_environment_are_known_also_after_a_hostile_start() -> None:
    # This process itself is not asked, as a test before this one may have changed it.
    assert subprocess.run([sys.executable, "-c", SHOW], capture_output=True, text=True, check=False).stdout == KNOWN
    assert forked.run(code=SHOW).stdout == KNOWN
    child = "import subprocess, sys\nsubprocess.run([sys.executable, '-c', SHOW])\n"
    code = f"{HOSTILE}\nfrom tests.surroundings import settle\nsettle()\n{SHOW}\nSHOW = {SHOW!r}\n{child}"
    assert forked.run(code=code).stdout == 2 * KNOWN
    assert "XDG_RUNTIME_DIR" in os.environ

"""What the tests, and all that they start, find around them: the same under nohup, cron, CI, git and a desktop."""

import contextlib
import locale
import os
import signal
import time

KEPT = ("KIKS_AT_LENGTH", "KIKS_SHARED", "KIKS_TEST_COSTS", "KIKS_TESTS_FORKED", "PYTHONPATH")
DROPPED = {
    *("COLUMNS", "LINES", "TERMINAL_WIDTH", "NO_COLOR", "FORCE_COLOR", "PY_COLORS", "TTY_COMPATIBLE", "GITHUB_ACTIONS"),
    *("DISPLAY", "WAYLAND_DISPLAY", "BROWSER", "MPLBACKEND", "LANGUAGE", "SOURCE_DATE_EPOCH"),
}
PREFIXES = ("GIT_", "KIKS_", "LC_", "OCTAVE_", "PYTHON")
SET = {"LANG": "C.UTF-8", "LC_ALL": "C.UTF-8", "TERM": "xterm", "TZ": "UTC"}
OF_PYTHON = {signal.SIGPIPE, signal.SIGXFSZ}
"""Signals that Python ignores, but not the processes that it starts."""


def settle() -> None:
    """Give this process default signals, the usual rights of files, UTC, C.UTF-8, and no settings of a person."""
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    for number in signal.valid_signals() - OF_PYTHON:
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.umask(0o022)
    for name in os.environ.keys() - KEPT:
        if name.startswith(PREFIXES) or name.lower().endswith("_proxy"):
            del os.environ[name]
    for name in DROPPED:
        os.environ.pop(name, None)
        os.unsetenv(name)  # readline gives the size of the terminal to processes, but not to `os.environ`
    os.environ.update(SET)
    time.tzset()
    with contextlib.suppress(locale.Error):  # Python has chosen UTF-8 itself where the system has no such locale
        locale.setlocale(locale.LC_CTYPE, "")

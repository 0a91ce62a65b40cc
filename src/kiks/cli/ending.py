"""However a process is ended from outside, it ends as with Ctrl-C, so that what has to be done at the end is done."""

from __future__ import annotations

import signal
import threading


def end_as_with_ctrl_c() -> None:
    """Let SIGTERM and SIGHUP raise KeyboardInterrupt; `nohup` keeps a process alive as ever."""
    if threading.current_thread() is not threading.main_thread():
        return
    for name in ("SIGTERM", "SIGHUP"):
        ending = getattr(signal, name, None)
        if ending is not None and signal.getsignal(ending) is not signal.SIG_IGN:
            signal.signal(ending, signal.default_int_handler)

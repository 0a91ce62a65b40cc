"""curses: waits for keys in simulated time. A person's key is there when it is looked for, or it is not."""

from __future__ import annotations

import time
from types import ModuleType
from typing import Any

from kiks.script.libraries.host import BLINK_S, Host, refuse_keyboard


def adapt(curses: ModuleType, host: Host) -> dict[Any, dict[str, Any]]:
    """Return what stands in for names of `curses`."""
    scheduler, clock = host.scheduler, host.clock
    # What `halfdelay` says for windows that say nothing themselves [ms]; None: wait.
    shared: dict[str, int | None] = {"delay_ms": None}

    class Window:
        """A window of curses that waits for keys in simulated time; all else is the window's."""

        def __init__(self, window: Any) -> None:
            self._window = window
            self._delay_ms: int | None = None
            window.nodelay(True)

        def __getattr__(self, name: str) -> Any:
            return getattr(self._window, name)

        def timeout(self, delay: int, /) -> None:
            self._delay_ms = None if delay < 0 else delay

        def nodelay(self, flag: bool, /) -> None:
            self._delay_ms = 0 if flag else None

        def subwin(self, *args: Any) -> Window:
            return Window(self._window.subwin(*args))

        def derwin(self, *args: Any) -> Window:
            return Window(self._window.derwin(*args))

        def getch(self, *args: Any) -> int:
            self._wait_for_key()
            return int(self._window.getch(*args))

        def getkey(self, *args: Any) -> str:
            self._wait_for_key()
            return str(self._window.getkey(*args))

        def get_wch(self, *args: Any) -> Any:
            self._wait_for_key()
            return self._window.get_wch(*args)

        def _has_key(self) -> bool:
            key = self._window.getch()
            if key != -1:
                curses.ungetch(key)
            return bool(key != -1)

        def _wait_for_key(self) -> None:
            delay_ms = shared["delay_ms"] if self._delay_ms is None else self._delay_ms
            if self._has_key():
                return
            if delay_ms is None:
                refuse_keyboard(scheduler)
                while not self._has_key():
                    time.sleep(BLINK_S)
            elif delay_ms:
                clock.sleep(delay_ms / 1000)
            else:
                clock.ask_ns()

    def napms(ms: int, /) -> int:
        clock.sleep(max(ms, 0) / 1000)
        return 0

    def halfdelay(tenths: int, /) -> None:
        real_halfdelay(tenths)
        shared["delay_ms"] = 100 * tenths

    def nocbreak() -> None:
        real_nocbreak()
        shared["delay_ms"] = None

    real_initscr, real_newwin, real_newpad = curses.initscr, curses.newwin, curses.newpad
    real_halfdelay, real_nocbreak = curses.halfdelay, curses.nocbreak
    return {
        curses: {
            "initscr": lambda: Window(real_initscr()),
            "newwin": lambda *args: Window(real_newwin(*args)),
            "newpad": lambda *args: Window(real_newpad(*args)),
            "napms": napms,
            "halfdelay": halfdelay,
            "nocbreak": nocbreak,
        }
    }

"""tkinter: `after` and `mainloop` in simulated time. What a person does comes in real time, and takes none."""

from __future__ import annotations

import sys
import time
from types import ModuleType
from typing import Any

from kiks.script.libraries.host import BLINK_S, Host
from kiks.script.thread_scheduler import STUCK, Task
from kiks.sim.read_completion import NEVER_NS
from kiks.units import NS_PER_S

_DONT_WAIT = 1 << 1
"""TCL_DONT_WAIT of Tcl (tcl.h)."""


class _Timers:
    """The queue of due callbacks, and the threads that wait for them in a main loop."""

    def __init__(self, host: Host) -> None:
        self._host = host
        self._due: list[tuple[int, int, Any, Any, tuple[Any, ...]]] = []
        self._count = 0
        self._loops: list[Task] = []

    def add(self, widget: Any, delay_ms: float, function: Any, arguments: tuple[Any, ...]) -> str:
        """Let a function be called later; return its name."""
        self._count += 1
        at_ns = self._host.scheduler.world.now_ns + max(round(delay_ms * NS_PER_S / 1000), 0)
        self._due.append((at_ns, self._count, widget, function, arguments))
        self._due.sort(key=lambda entry: entry[:2])
        for task in self._loops:
            self._host.scheduler.wake(task, None)
        return f"after#kiks{self._count}"

    def cancel(self, name: str) -> bool:
        """Forget one; return whether it was there."""
        before = len(self._due)
        self._due = [entry for entry in self._due if f"after#kiks{entry[1]}" != name]
        return len(self._due) < before

    def run_due(self) -> bool:
        """Call the first function that is due; return whether there was one."""
        if not self._due or self._due[0][0] > self._host.scheduler.world.now_ns:
            return False
        _, _, widget, function, arguments = self._due.pop(0)
        try:
            function(*arguments)
        except SystemExit:
            raise
        except Exception:
            widget._root().report_callback_exception(*sys.exc_info())
        return True

    def wait(self) -> None:
        """Let time pass until the next one is due, or other threads have done something."""
        scheduler = self._host.scheduler
        task = scheduler.current
        self._loops.append(task)
        try:
            until_ns = self._due[0][0] if self._due else NEVER_NS
            cause = scheduler.wait("a window", until_ns=until_ns, when_stuck=True)
        finally:
            self._loops.remove(task)
        if cause is STUCK:
            # Only a person can go on.
            time.sleep(BLINK_S)


def adapt(tkinter: ModuleType, host: Host) -> dict[Any, dict[str, Any]]:
    """Return what stands in for names of tkinter."""
    timers = _Timers(host)
    quits: set[int] = set()
    Misc = tkinter.Misc
    real_after, real_cancel, real_update = Misc.after, Misc.after_cancel, Misc.update

    def after(self: Any, ms: Any, func: Any = None, *args: Any) -> Any:
        if ms == "idle":
            return real_after(self, ms, func, *args)
        if func is None:
            host.clock.sleep(max(float(ms), 0) / 1000)
            return None
        return timers.add(self, float(ms), func, args)

    def after_cancel(self: Any, id: Any) -> None:
        if not id:
            raise ValueError("id must be a valid identifier returned from after or after_idle")
        if not timers.cancel(str(id)) and not str(id).startswith("after#kiks"):
            real_cancel(self, id)

    def turn(self: Any) -> None:
        """Do what is to be done at this instant, or wait."""
        while self.tk.dooneevent(_DONT_WAIT):
            pass
        if not exists(self) or timers.run_due():
            return
        timers.wait()

    def exists(self: Any) -> bool:
        try:
            return bool(int(self.tk.call("winfo", "exists", ".")))
        except tkinter.TclError:
            return False

    def mainloop(self: Any, n: int = 0) -> None:
        root = id(self._root())
        quits.discard(root)
        while exists(self) and root not in quits:
            turn(self)
        quits.discard(root)

    def quit(self: Any) -> None:
        quits.add(id(self._root()))

    def update(self: Any) -> None:
        real_update(self)
        while timers.run_due():
            real_update(self)

    def wait_variable(self: Any, name: Any = "PY_VAR") -> None:
        written: list[object] = []
        command = self.register(lambda *_: written.append(None))
        trace = ("variable", str(name), "write", command)
        self.tk.call("trace", "add", *trace)
        while exists(self) and not written:
            turn(self)
        if exists(self):
            self.tk.call("trace", "remove", *trace)
            self.deletecommand(command)

    def wait_window(self: Any, window: Any = None) -> None:
        window = self if window is None else window
        while exists(self) and window.winfo_exists():
            turn(self)

    return {
        Misc: {
            "after": after,
            "after_cancel": after_cancel,
            "mainloop": mainloop,
            "quit": quit,
            "update": update,
            "wait_variable": wait_variable,
            "waitvar": wait_variable,
            "wait_window": wait_window,
        },
        tkinter: {"mainloop": lambda n=0: tkinter._get_default_root("run the main loop").mainloop(n)},
    }

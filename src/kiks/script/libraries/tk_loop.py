"""tkinter: `after` and `mainloop` in simulated time. What a person does comes in real time, and takes none."""

from __future__ import annotations

from bisect import insort
from collections.abc import Callable
from contextlib import suppress
from itertools import count
from types import ModuleType
from typing import Any

from kiks.script.libraries.host import Host
from kiks.script.patching import Replacements
from kiks.sim.read_completion import NEVER_NS

_DONT_WAIT = 1 << 1
"""TCL_DONT_WAIT of Tcl (tcl.h)."""

_NEVER_MS = 1 << 31
"""Delay of a timer of Tcl that KiKS calls itself [ms of real time]."""


def adapt(tkinter: ModuleType, host: Host) -> Replacements:
    """Return what stands in for names of tkinter."""
    world, numbers = host.scheduler.world, count()
    # Timers of Tcl, each with the time at which it is due; Tcl knows what it calls, and whether it was cancelled.
    due: list[tuple[int, int, str, Any]] = []
    quits: set[Any] = set()
    Misc = tkinter.Misc
    real_after, real_update = Misc.after, Misc.update

    def after(self: Any, ms: Any, func: Any = None, *args: Any) -> Any:
        if ms == "idle":
            return real_after(self, ms, func, *args)
        if func is None:
            return host.clock.sleep(max(float(ms), 0) / 1000)
        name = real_after(self, _NEVER_MS, func, *args)
        insort(due, (world.now_ns + max(round(float(ms) * 1_000_000), 0), next(numbers), name, self.tk))
        host.note_event()
        return name

    def run_due() -> bool:
        """Call the first function that is due; return whether there was one."""
        if not due or due[0][0] > world.now_ns:
            return False
        _, _, name, tk = due.pop(0)
        with suppress(tkinter.TclError):  # it was cancelled, or its window is gone
            command = tk.splitlist(tk.call("after", "info", name))[0]
            tk.call("after", "cancel", name)
            tk.call(command)
        return True

    def exists(self: Any) -> bool:
        try:
            return bool(int(self.tk.call("winfo", "exists", ".")))
        except tkinter.TclError:
            return False

    def run_until(self: Any, is_over: Callable[[], object]) -> None:
        while exists(self) and not is_over():
            while self.tk.dooneevent(_DONT_WAIT):
                pass
            if exists(self) and not run_due():
                host.wait_for_event(due[0][0] if due else NEVER_NS)

    def mainloop(self: Any, n: int = 0) -> None:
        root = self._root()
        quits.discard(root)
        run_until(self, lambda: root in quits)

    def update(self: Any) -> None:
        real_update(self)
        while run_due():
            real_update(self)

    def wait_variable(self: Any, name: Any = "PY_VAR") -> None:
        written: list[object] = []
        trace = ("variable", str(name), "write", self.register(lambda *_: written.append(None)))
        self.tk.call("trace", "add", *trace)
        run_until(self, lambda: written)
        if exists(self):
            self.tk.call("trace", "remove", *trace)
            self.deletecommand(trace[-1])

    waits = {
        "mainloop": mainloop,
        "wait_variable": wait_variable,
        "waitvar": wait_variable,
        "wait_window": lambda self, window=None: run_until(self, lambda: not (window or self).winfo_exists()),
    }
    default = {"mainloop": lambda n=0: tkinter._get_default_root("run the main loop").mainloop(n)}
    quit_ = {"quit": lambda self: quits.add(self._root())}
    return {"tkinter.Misc": {"after": after, "update": update, **waits, **quit_}, "tkinter": default}

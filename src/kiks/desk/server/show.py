"""Showing a desk in browsers: `sim.show()`, its driver thread and its display in notebooks."""

from __future__ import annotations

import html
import logging
import sys
import threading
import webbrowser
from collections.abc import Callable
from typing import Any

from kiks.desk.screen import has_screen
from kiks.desk.server.desk import Desk, NewsHandler, OutsidePrograms
from kiks.desk.server.public_address import PublicAddress, address_for_notebooks, why_unreachable
from kiks.desk.server.rights import Rights
from kiks.desk.server.server import SERVER
from kiks.export.frames import pack_frame
from kiks.model.checks import check_count, check_kind
from kiks.run import Run
from kiks.sim.simulation import Simulation
from kiks.units import NS_PER_S

SLICE_NS = NS_PER_S // 50
"""Simulated time that passes in one piece while no program moves the world [ns]; the gate controls the pace."""

ROUND_S = 0.05
"""Longest wait for a request of a program [s of real time]; a closed desk is noticed after it."""


class Driver(threading.Thread):
    """Moves the world of a desk: in a thread of its own after `start`, or in the thread that calls `run`.

    Args:
        desk: The desk.
        programs_ended: Called with the locked world when all programs that moved it have ended.
    """

    def __init__(self, desk: Desk, programs_ended: Callable[[Simulation], None] = lambda sim: None) -> None:
        super().__init__(name="kiks driver", daemon=True)
        self._desk = desk
        self._programs_ended = programs_ended
        self._is_over = threading.Event()

    def run(self) -> None:
        """Let time pass, as programs and the gate allow, until `stop`."""
        while not self._is_over.is_set():
            programs = self._desk.programs
            had_programs = programs.are_there
            programs.round(ROUND_S if programs.drive else 0)
            if not programs.drive:
                with programs.sim.lock:
                    if had_programs and not programs.are_there:
                        self._desk.programs_ended()
                        self._programs_ended(programs.sim)
                    programs.sim.advance_to(programs.sim.now_ns + SLICE_NS)
                    programs.sim.sync()
            self._desk.clear_away()

    def stop(self) -> None:
        """End `run`; from any thread."""
        self._is_over.set()
        self._desk.present.gate.close()


STOP_S = 10.0
"""Timeout of the end of the world's thread [s]."""


class Shown:
    """A desk that browsers can see; as the value of a notebook's cell it appears below the cell.

    Args:
        desk: The desk.
        host: Address to listen at.
        port: TCP port, 0 for a free one; if left out, 8123, or a free one if that is taken.
        public: The address that people open, if a proxy stands before the server.
        number: Its number in its address; the next one if left out.

    Attributes:
        desk: The desk.
        gateway: Serves its browsers.
        url: URL of the desk, with its token.

    Raises:
        LinkError: If it cannot listen there.
    """

    def __init__(
        self,
        desk: Desk,
        *,
        host: str = "127.0.0.1",
        port: int | None = None,
        public: PublicAddress | None = None,
        number: int | None = None,
    ) -> None:
        self.desk = desk
        with desk.sim.lock:
            # Compile the code for frames before the first browser waits for it.
            pack_frame(desk.sim, scene=0)
        desk.looking.start_history()
        SERVER.start(host=host, port=port, public=public)
        self.gateway = SERVER.open(desk, number)
        self.url = SERVER.url(self.gateway.number)
        self._driver: Driver | None = None
        self._cell: int | None = None
        self._news = NewsHandler(desk)
        logging.getLogger("kiks").addHandler(self._news)

    def drive(self) -> None:
        """Start a thread that moves the world."""
        if self._driver is None:
            self._driver = Driver(self.desk)
            self._driver.start()
            if self.desk.rights.is_for_others:
                self._news.thread = self._driver.ident

    def browse(self) -> None:
        """Open the desk in a browser if there is a screen."""
        if has_screen():
            # Other users can see the URL that a browser is started with, so it must not contain the token.
            webbrowser.open(SERVER.url_for_once(self.gateway.number))

    def present(self, *, browser: bool) -> None:
        """Show the desk below the cell of a notebook; elsewhere print its URL and open a browser.

        Args:
            browser: False to print the URL only.
        """
        ipython = _ipython()
        if browser and hasattr(ipython, "kernel"):
            self._ipython_display_()
            return
        if ipython is not None:
            self._cell = ipython.execution_count
        print(f"The desk: {self.url}")
        if browser:
            self.browse()

    def stop(self) -> None:
        """Let all that goes on here end, without a wait."""
        self.desk.tries.stop()
        if self._driver is not None:
            self._driver.stop()

    def close(self) -> None:
        """Close the desk and release the world."""
        logging.getLogger("kiks").removeHandler(self._news)
        self.stop()
        if self._driver is not None:
            # It may be in a long step; as a daemon thread it does not block the end of the process.
            self._driver.join(STOP_S)
        SERVER.close(self.gateway)

    def __repr__(self) -> str:
        return f"<KiKS desk at {self.url}>"

    def _ipython_display_(self) -> None:
        """Show the desk below the cell of a notebook, or its URL in a terminal, once per cell."""
        ipython = _ipython()
        if ipython.execution_count != self._cell:
            self._cell = ipython.execution_count
            ipython.display_pub.publish({"text/plain": repr(self), "text/html": self._repr_html_()})

    def _repr_html_(self) -> str:
        if SERVER.visitors.public is None and (why := why_unreachable()):
            from kiks.export.notebook import simulation  # with the library that draws, which a desk needs here alone

            pixels = simulation(self.desk.sim)[0]["image/png"]
            return f'<p>{html.escape(why)}</p><img width="480" alt="" src="data:image/png;base64,{pixels}">'
        return f'<iframe src="{html.escape(self.url)}" style="width: 100%; height: 640px; border: 0"></iframe>'


def show(
    sim: Simulation,
    *,
    speed: float | None = 1.0,
    is_alive: bool = False,
    port: int | None = None,
    browser: bool = True,
    address: str | None = None,
) -> Shown:
    """Show a world in a browser; see `Simulation.show`.

    Raises:
        LinkError: If the desk cannot listen there.
    """
    check_kind("is_alive", is_alive, bool)
    port = None if port is None else check_count("port", port, 0, 65535, "Leave it out for a free one.")
    desk = Desk(Run.in_world(sim, speed=speed), Rights.NOTEBOOK if is_alive else Rights.VISITOR)
    shown = Shown(desk, port=port, public=address_for_notebooks(address))
    if is_alive:
        shown.drive()
    else:
        desk.outside = OutsidePrograms(desk.gate.halt)
    shown.present(browser=browser)
    return shown


def _ipython() -> Any:
    """Return the running IPython, which has a `kernel` in a notebook; None in plain Python."""
    module = sys.modules.get("IPython")
    return None if module is None else module.get_ipython()

"""A registry of simulations by name, like the operating system's table of serial ports.

`serial_for_url("kiks://1")` and `kopen([-1])` carry nothing but a name, so its meaning has to stand somewhere. The
registry keeps no simulation alive.
"""

from __future__ import annotations

import weakref
from typing import Generic, Protocol, TypeVar

from kiks.errors import LinkError, shown


class Named(Protocol):
    """An object that a registry holds."""

    name: str


Entry = TypeVar("Entry", bound=Named)

SHOWN_NAMES = 5
"""Most simulations that a message names: the newest."""


class Registry(Generic[Entry]):
    """Simulations in the order of their creation."""

    def __init__(self) -> None:
        self._simulations: weakref.WeakValueDictionary[str, Entry] = weakref.WeakValueDictionary()
        self._count = 0

    def enter(self, sim: Entry) -> str:
        """Give a simulation a name."""
        self._count += 1
        name = f"sim{self._count}"
        self._simulations[name] = sim
        return name

    def find(self, name: str) -> Entry:
        """Return the simulation of a name.

        Raises:
            LinkError: If none is alive under that name.
        """
        sim = self._simulations.get(name)
        if sim is None:
            known = sorted(self._simulations, key=lambda name: int(name[3:]))[-SHOWN_NAMES:]
            alive = " or ".join(known) or "none now"
            raise LinkError(
                f"a simulation's name must be one that is alive, such as {alive}, but it was {shown(name)}. "
                f"'kiks://1' without a name is robot 1 of the newest simulation."
            )
        return sim

    def newest(self) -> Entry | None:
        """Return the simulation created last, if one is alive."""
        return max(self._simulations.values(), key=lambda sim: int(sim.name[3:]), default=None)

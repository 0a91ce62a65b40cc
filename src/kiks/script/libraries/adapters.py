"""Libraries whose code in C waits by itself: each has an adapter here, put in place when a program imports it."""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from operator import attrgetter
from types import ModuleType

from kiks.script.libraries import c_calls, c_waits, debuggers, tk_loop
from kiks.script.libraries.host import Host
from kiks.script.patching import Replacements, change
from kiks.script.refusals import is_of_program
from kiks.script.robot_sockets import CONSTANTS
from kiks.units import NS_PER_S

Adapter = Callable[[ModuleType, Host], Replacements]
"""Gets a library that has been imported; returns what stands in for its names."""

PYBLUEZ = os.path.join(os.path.dirname(__file__), "pybluez.py")
"""What stands in for PyBluez, installed or not."""


def _adapters() -> dict[str, Adapter]:
    return {
        "tkinter": tk_loop.adapt,
        "pygame.time": c_waits.adapt_pygame,
        "pygame.event": c_waits.adapt_pygame_events,
        "curses": c_waits.adapt_curses,
        "cv2": _adapt_cv2,
        "socket": _adapt_socket,
        "bluetooth": _adapt_bluetooth,
        "bdb": debuggers.adapt_bdb,
        "pydevd": debuggers.adapt_pydevd,
        "debugpy.server.api": debuggers.adapt_start("listen", "connect"),
        "ipdb.__main__": debuggers.adapt_start("_init_pdb"),
        "numpy": c_calls.adapt_extension("numpy._core._multiarray_umath"),
        "pydantic_core": c_calls.adapt_extension("pydantic_core._pydantic_core"),
        "sqlite3": c_calls.adapt_sqlite,
        "ssl": lambda _, host: {"_ssl": dict.fromkeys(("RAND_bytes", "RAND_priv_bytes"), host.chance.read)},
        **{name: _adapt_chance(seed, bits) for name, (seed, bits) in _SEEDS.items()},
        **dict.fromkeys(_OF_THEIR_OWN.split(), _adapt_chance()),
    }


_SEEDS = {
    "cupy.random": ("seed", 32),
    "graph_tool": ("seed_rng", 31),
    "numpy.random": ("seed", 32),
    "paddle": ("seed", 31),
    "polars": ("set_random_seed", 63),
    "tensorflow": ("random.set_seed", 31),
    "torch": ("manual_seed", 63),
}
"""Libraries with a generator in C that one call seeds, with the bits of the seed.

Others need none: their generators are Python's or NumPy's (igraph, scikit-learn), are seeded by the same number in each
process (OpenCV, XGBoost, LightGBM), or want a seed at each call (JAX, PyArrow).
"""

_OF_THEIR_OWN = "cryptography duckdb fastuuid nacl panda3d rpy2 rustworkx uuid_utils whenever"
"""Libraries that draw by chance, or tell a time, in C, without a way to seed that."""


def _adapt_chance(seed: str = "", bits: int = 0) -> Adapter:
    """Return an adapter that seeds a library by its function `seed`, or notes that its chance is its own."""

    def adapt(module: ModuleType, host: Host) -> Replacements:
        library = module.__name__.partition(".")[0]
        try:
            attrgetter(seed)(module)(host.chance.number(library, bits))
        except Exception:
            # It has none, or none in this version, or lacks its device.
            host.chance.doubt(library)
        return {}

    return adapt


def _adapt_cv2(_: ModuleType, host: Host) -> Replacements:
    """Count ticks in simulated nanoseconds."""
    return {"cv2": {"getTickCount": host.clock.ask_ns, "getTickFrequency": lambda: float(NS_PER_S)}}


def _adapt_socket(module: ModuleType, host: Host) -> Replacements:
    """Give programs the constants of Bluetooth, with which not every Python was built."""
    for name, value in CONSTANTS.items():
        if not hasattr(module, name):
            setattr(module, name, value)
            host.undo.add(partial(delattr, module, name))
    return {}


def _adapt_bluetooth(module: ModuleType, host: Host) -> Replacements:
    """Tell the stand-in for PyBluez what robots there are."""
    if module.__file__ == PYBLUEZ:
        module.nearby.update(host.addresses)
        for name in [name for name, each in sys.modules.items() if each is module]:
            host.undo.add(partial(sys.modules.pop, name))
    return {}


@contextmanager
def adapted(host: Host) -> Iterator[None]:
    """Let libraries wait in simulated time, those that are imported meanwhile, too."""
    adapters = _adapters()

    def adapt(name: str, module: ModuleType) -> None:
        change(adapters[name](module, host).items(), host.scheduler, host.undo)

    for name in adapters:
        if name in sys.modules:
            adapt(name, sys.modules[name])
    finder = _Finder(set(adapters), adapt)
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)
        host.undo()


class _Finder(MetaPathFinder):
    """Finds a library as Python does, and adapts it when it has been imported."""

    def __init__(self, names: set[str], adapt: Callable[[str, ModuleType], None]) -> None:
        self._names = names
        self._adapt = adapt

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname not in self._names:
            return None
        self._names.discard(fullname)
        spec = importlib.util.find_spec(fullname)
        # A module of the program's own may have that name.
        if fullname == "bluetooth" and (spec is None or not is_of_program(spec.origin or "")):
            spec = importlib.util.spec_from_file_location(fullname, PYBLUEZ)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_and_adapt(module: ModuleType) -> None:
                execute(module)
                self._adapt(fullname, module)

            spec.loader.exec_module = execute_and_adapt  # type: ignore[method-assign]
        return spec

"""Engines that play packed inputs (`tests.recording.played`): native kernels, and those for browsers in wasmtime."""

from functools import lru_cache
from typing import Any

import numpy as np
import wasmtime
from numpy.typing import NDArray

from kiks.engine import step
from kiks.engine.compiling import make_ready
from kiks.engine.scene import MEETING, enter_worlds
from kiks.engine.sensing.floor_spots import plains_of
from kiks.engine.webassembly import section_of
from kiks.export.browser_engine import ENGINE
from kiks.model.raster import PAD
from kiks.model.wall_tables import WallTables

PAGE_BYTES = 1 << 16
MEMORY_BYTES = 1 << 29
STACK_BYTES = 1 << 20
HEAP_BYTES = 32 << 20
ALIGNMENT = 64


class Native:
    """The kernels of this computer."""

    def __init__(self) -> None:
        make_ready(MEETING)

    def zeros(self, shape: Any, element: Any) -> NDArray[Any]:
        """Return a new array."""
        return np.zeros(shape, element)

    def address(self, array: NDArray[Any]) -> int:
        """Return where an array lies."""
        return array.ctypes.data

    def advance(self, record: NDArray[np.void], tick: int, tick_count: int) -> None:
        step.advance(record, tick, tick_count)

    def enter_worlds(self, record: NDArray[np.void], worlds: NDArray[np.int64]) -> None:
        enter_worlds(record, worlds)

    def fill_tables(self, arrays: dict[str, NDArray[Any]], cell_mm: float) -> None:
        """Fill the tables that follow from walls and floor."""
        tables = WallTables(arrays["brightness"][PAD:-PAD, PAD:-PAD], cell_mm)
        made = {name: getattr(tables, name) for name in ("clearance", "rooms", "leaps", "faces")}
        for name, table in (made | {"plains": plains_of(arrays["floor"], cell_mm)}).items():
            assert table.shape == arrays[name].shape
            arrays[name][:] = table


class Wasmtime:
    """The engine for browsers, which wasmtime runs. Its memory never grows, so arrays stay where they are."""

    def __init__(self) -> None:
        self._store = wasmtime.Store(_engine())
        module = _module()
        self.about = section_of(ENGINE.read_bytes())
        self._top = _up(self.about["end"]) + STACK_BYTES
        pages = wasmtime.Limits(MEMORY_BYTES // PAGE_BYTES, PAGE_BYTES)
        memory = wasmtime.Memory(self._store, wasmtime.MemoryType(pages))
        table = wasmtime.TableType(wasmtime.ValType.funcref(), wasmtime.Limits(1, None))
        stack = wasmtime.GlobalType(wasmtime.ValType.i32(), True)
        env = {
            "__linear_memory": memory,
            "__stack_pointer": wasmtime.Global(self._store, stack, wasmtime.Val.i32(self._top)),
            "__indirect_function_table": wasmtime.Table(self._store, table, None),
        }
        instance = wasmtime.Instance(self._store, module, [env[str(each.name)] for each in module.imports])
        self._exports = {str(name): each for name, each in instance.exports(self._store).items()}
        self._memory: NDArray[np.uint8] = np.frombuffer(memory.get_buffer_ptr(self._store), np.uint8)
        self._returned = self.address(self.zeros(32, np.int64))

    def zeros(self, shape: Any, element: Any) -> NDArray[Any]:
        """Return a new array in the engine's memory."""
        count = int(np.prod(shape)) * np.dtype(element).itemsize
        at, self._top = self._top, _up(self._top + count)
        assert self._top + HEAP_BYTES < MEMORY_BYTES
        return self._memory[at : at + count].view(element).reshape(shape)

    def address(self, array: NDArray[Any]) -> int:
        """Return where an array lies."""
        return array.ctypes.data - self._memory.ctypes.data

    def call(self, name: str, *values: Any) -> None:
        """Call a kernel, as `web/engine.js` does."""
        letters = self.about["arguments"][name]
        flat = [self._returned, self._returned + 128, *(word for value in values for word in self._flattened(value))]
        self._exports["set_heap"](self._store, self._top)
        given = [float(word) if letter in "fd" else int(word) for letter, word in zip(letters, flat, strict=True)]
        status = self._exports[name](self._store, *given)
        assert status in (0, -2), f"{name} has failed with status {status}"

    def _flattened(self, value: Any) -> list[Any]:
        if not isinstance(value, np.ndarray):
            return [value]
        return [0, 0, value.size, value.itemsize, self.address(value), *value.shape, *value.strides]

    def advance(self, record: NDArray[np.void], tick: int, tick_count: int) -> None:
        self.call("advance", record, tick, tick_count)

    def enter_worlds(self, record: NDArray[np.void], worlds: NDArray[np.int64]) -> None:
        self.call("enter_worlds", record, worlds)

    def fill_tables(self, arrays: dict[str, NDArray[Any]], cell_mm: float) -> None:
        """Fill the tables that follow from walls and floor."""
        leaps = arrays["leaps"]
        self.call("fill_distances", arrays["brightness"], cell_mm, arrays["clearance"], arrays["rooms"], leaps)
        self.call("fill_faces", leaps, cell_mm, arrays["faces"])
        self.call("fill_plains", arrays["floor"], cell_mm, arrays["plains"])


@lru_cache(1)
def _engine() -> Any:
    return wasmtime.Engine()


@lru_cache(1)
def _module() -> Any:
    return wasmtime.Module(_engine(), ENGINE.read_bytes())


def _up(address: int) -> int:
    return -(-address // ALIGNMENT) * ALIGNMENT

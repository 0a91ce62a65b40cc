"""The oracle of `kiks.recording.engine_inputs`: plays packed inputs on an engine, and computes each hash.

It is slow and obvious, and knows no class of the product but the records and kernels of the engine.
"""

import json
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from tests.recording.engines import Native, Wasmtime

from kiks.engine.scene import _ARRAYS, SCENE
from kiks.engine.simd.addresses import address_of_array
from kiks.engine.state import State


class Played(NamedTuple):
    """What came out: recorded and own hashes of all checkpoints, the ticks of segments, and the last shown words."""

    recorded: list[str]
    own: list[str]
    segments: list[int]
    shown: list[int]
    state: State


class Bytes:
    """Reads numbers of four bytes that were taken apart."""

    def __init__(self, data: bytes) -> None:
        self._data, self._at = data, 0

    def take(self, count: int) -> bytes:
        self._at += count
        return self._data[self._at - count : self._at]

    def numbers(self, count: int) -> NDArray[np.int64]:
        planes = np.frombuffer(self.take(4 * count), np.uint8).reshape(4, count).astype(np.int64)
        return sum(planes[k] << 8 * k for k in range(4)) + np.zeros(count, np.int64)


def unpacked(data: bytes) -> tuple[dict[str, Any], list[tuple[int, int, Any]], list[bytes]]:
    """Return the head, the moments with what belongs to each, and the contents; also of what a page holds of a run."""
    size = int.from_bytes(data[:4], "little")
    head, rest = json.loads(data[4 : 4 + size]), Bytes(data[4 + size :])
    head = head.get("inputs", head)
    count = head["moment_count"]
    ticks, meanings = np.cumsum(rest.numbers(count)).tolist(), rest.numbers(count).tolist()
    hashes = iter([rest.take(8).hex() for _ in range(head["check_count"])])
    patterns = [
        [(array, word) for array, runs in enumerate(pattern) for k in range(0, len(runs), 2) for word in _run(runs, k)]
        for pattern in head["patterns"]
    ]
    columns: dict[tuple[int, int], Any] = {name: 0 for pattern in patterns for name in pattern}
    for what in meanings:
        for name in patterns[what - 2] if what >= 2 else []:
            columns[name] += 1
    for (name, number), is_summed in zip(list(columns.items()), head["is_summed"], strict=True):
        values = rest.numbers(number)
        if is_summed == "1":
            values = np.cumsum(values >> 1 ^ -(values & 1)) % 2**32
        columns[name] = iter(values.tolist())
    moments: list[tuple[int, int, Any]] = []
    for tick, what in zip(ticks, meanings, strict=True):
        given: Any = None
        if what == 0:
            given = next(hashes)
        elif what >= 2:
            given = [(*name, next(columns[name])) for name in patterns[what - 2]]
        moments.append((tick, what, given))
    assert not any(list(column) for column in columns.values())
    return head, moments, [rest.take(size) for size in head["contents"]]


def _run(runs: list[int], k: int) -> range:
    return range(runs[k], runs[k] + runs[k + 1])


def played(data: bytes, engine: Native | Wasmtime | None = None) -> Played:
    """Play inputs, on the native engine if none is given."""
    engine = engine or Native()
    head, moments, contents = unpacked(data)
    segments, recorded, own, begun = iter(head["segments"]), [], [], []
    arrays: list[NDArray[np.uint32]] = []
    keeps: Any = None
    record = engine.zeros(1, SCENE)
    world = engine.zeros(1, np.int64)
    state = State.empty(world_count=1, robot_count=0)
    for tick, what, given in moments:
        if tick > state.tick_count and arrays:
            engine.advance(record, state.tick_count, tick - state.tick_count)
        state.tick_count = tick
        if what == 0:
            recorded.append(given)
            own.append(state.hash())
        elif what == 1:
            begun.append(tick)
            record, keeps = _scene(next(segments), contents, engine)
            state.robots, state.bodies = keeps["robots"], keeps["bodies"]
            arrays = [keeps[name].reshape(-1).view(np.uint32) for name in ("robots", "bodies", "lamps", "shown")]
            engine.enter_worlds(record, world)
        else:
            for array, word, value in given:
                arrays[array][word] = value
            engine.enter_worlds(record, world)
    return Played(recorded, own, begun, arrays[3].tolist(), state)


def _scene(
    segment: dict[str, Any], contents: list[bytes], engine: Native | Wasmtime
) -> tuple[NDArray[np.void], dict[str, NDArray[Any]]]:
    """Return the record of a scene, and its arrays."""
    arrays = {}
    for name, told in segment["arrays"].items():
        element = np.dtype(_ARRAYS[name][0])
        assert element.itemsize == told["size"]
        array = engine.zeros(told["shape"], element)
        if "content" in told:
            array.reshape(-1).view(np.uint8)[:] = np.frombuffer(contents[told["content"]], np.uint8)
        arrays[name] = array
    assert all(segment["arrays"][name]["is_table"] for name in ("clearance", "rooms", "leaps", "faces", "plains"))
    engine.fill_tables(arrays, segment["numbers"]["cell_mm"])
    record = engine.zeros(1, SCENE)
    for name, (element, dimensions) in _ARRAYS.items():
        _, *shape = address_of_array(arrays[name], element, dimensions)
        record[name] = engine.address(arrays[name]), *shape
    for name, number in segment["numbers"].items():
        record[name] = number
    arrays["shown"] = np.frombuffer(contents[segment["shown"]], np.uint32).copy()
    return record, arrays

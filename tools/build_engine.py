"""Writes the engine for browsers, `src/kiks/engine/engine.wasm`: `make engine`, after a kernel has changed.

The same sources, with the same Numba and llvmlite, give the same bytes.
"""

from __future__ import annotations

import sys
import zlib
from pathlib import Path

from kiks.export.browser_engine import ENGINE, build

if __name__ == "__main__":
    file = Path(sys.argv[1]) if sys.argv[1:] else ENGINE
    made = build()
    file.write_bytes(made)
    print(f"{file.name}: {len(made)} bytes, {len(zlib.compress(made, 9))} packed")

"""WebAssembly of kernels: the same code that Numba makes for this computer, for the engine of a browser.

Need: a page that makes a run again must have the same bits, so no formula may be written a second time.
Method: Numba compiles for the processor that its target context names. `compile_for_browsers` puts another one there,
WebAssembly with addresses of 32 bits, which LLVM knows; then kernels are compiled as ever, linked into one module of
LLVM, and optimized together. LLVM writes an object file. In one that needs nothing from another, all addresses are
already right: it becomes a module that browsers take when its functions get names (`exported`), so no linker is needed.

A process that has called `compile_for_browsers` makes nothing that it could run itself.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from kiks.engine import compiling

# isort: split
from llvmlite import binding, ir
from numba import types
from numba.core import cgutils, codegen
from numba.core.callconv import CPUCallConv
from numba.core.compiler_lock import global_compiler_lock
from numba.core.cpu import CPUContext
from numba.core.registry import cpu_target
from numba.core.runtime import nrt

# Numba annotates these in part, and not as they are used here.
_cg: Any = codegen
_runtime: Any = nrt
_lock: Any = global_compiler_lock
_text: Any = cgutils.normalize_ir_text
_types: Any = types

TRIPLE = "wasm32-unknown-unknown"

FEATURES = "+simd128,+bulk-memory,+sign-ext,+nontrapping-fptoint,+mutable-globals"
"""What Chromium, Firefox and Safari have since 2023 (webassembly.org, "Feature Extensions")."""

SECTION = "kiks"
"""Name of the custom section that describes a module, in JSON."""

SET_HEAP = "set_heap"
"""Name of the function that says where the next memory is that a kernel asks for."""

PRODUCT = "__multi3"
"""LLVM's name of a function that it calls by itself."""

_KEPT = '@llvm.compiler.used = appending global [1 x ptr] [ptr @{}], section "llvm.metadata"'

HELPERS = Path(__file__).with_suffix(".ll")
"""What Numba and LLVM call that is in no kernel, in LLVM's language."""


class _LinkedLibrary(_cg.CPUCodeLibrary):  # type: ignore[misc, unused-ignore]
    """The code of a function: what it is linked into is optimized, once, and becomes machine code."""

    has_dynamic_globals = True  # so the cache of machine code does not take it

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return an address that stands for any: cells of linked kernels are filled in the module."""
        return 1


class _BrowserCodegen(_cg.CPUCodegen):  # type: ignore[misc, unused-ignore]
    _library_class = _LinkedLibrary

    def _init(self, module: Any) -> None:
        binding.initialize_all_targets()
        binding.initialize_all_asmprinters()
        target = binding.Target.from_triple(TRIPLE)
        self._tm = target.create_target_machine(cpu="generic", features=FEATURES, opt=3, reloc="static")
        self._target_data, self._data_layout = self._tm.target_data, str(self._tm.target_data)
        self._loopvect, self._opt_level = False, 0

    def _create_empty_module(self, name: str) -> Any:
        module = ir.Module(_text(name))
        module.triple = TRIPLE
        if self._data_layout:
            module.data_layout = self._data_layout
        return module

    def _add_module(self, module: Any) -> None:
        pass

    def magic_tuple(self) -> tuple[str, str, str]:
        """Return what code depends on."""
        return TRIPLE, "generic", FEATURES

    def optimize(self, module: Any) -> None:
        """Do what Numba does to a library, and once more, as for entries (`kiks.engine.compiling`)."""
        for options in ({"opt": 0, "loop_vectorize": False, "slp_vectorize": False, "cost": "cheap"}, {}, {}):
            manager, builder = self._module_pass_manager(**options)
            manager.run(module, builder)


_linked: dict[str, Any] = {}


def compile_for_browsers() -> None:
    """Let this process compile for browsers from now on."""
    changed: Any = compiling
    context: Any = cpu_target.target_context
    context.refresh()
    context._internal_codegen = _BrowserCodegen("kiks")
    # The runtime's own functions are made for the present target when it begins.
    _runtime.rtsys._init = False
    _runtime.rtsys.initialize(context)

    def define_pipelines(pipeline: Any) -> Any:
        state = pipeline.state
        state.library = context.codegen().create_library(state.func_id.func_qualname)
        return changed._Pipeline.define_pipelines(pipeline)

    def address_of(result: Any) -> int:
        _linked[f"{result.fndesc.modname}.{result.fndesc.qualname}"] = result
        return 1

    convention: Any = CPUCallConv
    # Browsers are told that a kernel has failed, and not by what: otherwise the module would hold the folders of files.
    convention.build_excinfo_struct = lambda self, error, arguments, place, name: (None, (), None)
    executable: Any = CPUContext
    executable.get_executable = lambda self, library, description, environment: str(description.qualname).format
    for each in (changed._WholePipeline, changed._PartPipeline):
        each.define_pipelines = define_pipelines
    changed.address_of = address_of


def module_of(
    functions: Mapping[str, tuple[Any, tuple[Any, ...]]],
    about: Mapping[str, Any],
    parts: Iterable[str] = (),
    *,
    begin: int = 0,
) -> bytes:
    """Return a module of WebAssembly that exports functions.

    Args:
        functions: What `kiks.engine.compiling` made, and the types of its arguments, by the name to export.
        about: What its section of JSON shall say beside what is told here: `functions`, the types of results by name,
            and `end`, the first address that is not taken by its data.
        parts: Parts of the engine that must be ready (`kiks.engine.compiling.make_ready`).
        begin: The first address of its data: a module that shares memory with another begins where that one ends.
    """
    context: Any = cpu_target.target_context
    results = {}
    for name, (function, argument_types) in functions.items():
        function.targetoptions.update(no_cpython_wrapper=True, no_cfunc_wrapper=True)
        results[name] = compiling.compiled_for(function, argument_types)
    for part in parts:
        compiling.make_ready(part)
    maker = context.codegen()
    head = f'target triple = "{TRIPLE}"\ntarget datalayout = "{maker._data_layout}"\n'
    # What comes first has the lowest addresses; `_as_module` leaves out data that are zeros.
    below = f"@below = internal global [{begin} x i8] zeroinitializer\n" + _KEPT.format("below") if begin else ""
    module = binding.parse_assembly(head + below)
    with _lock:
        for result in [*results.values(), *_linked.values()]:
            result.library._ensure_finalized()
            module.link_in(result.library._final_module.clone())
    cells = sorted(set(re.findall(r'^@"?(kiks\.[\w.<>]+\.[0-9a-f]{16})"? = external', str(module), re.MULTILINE)))
    symbols = {cell: _linked[cell.rpartition(".")[0]].fndesc.llvm_func_name for cell in cells}
    stubs = "".join(f'declare i32 @"{name}"()\n@"{cell}" = constant ptr @"{name}"\n' for cell, name in symbols.items())
    for text in (stubs, HELPERS.read_text("utf-8")):
        module.link_in(binding.parse_assembly(head + text))
    exported = {SET_HEAP: SET_HEAP} | {result.fndesc.llvm_func_name: name for name, result in results.items()}
    for each in [*module.functions, *module.global_variables]:
        if not each.is_declaration and each.name not in exported and each.name not in (PRODUCT, "llvm.compiler.used"):
            each.linkage = "internal"
    maker.optimize(module)
    returned = {name: _letters(result.signature.return_type) for name, result in results.items()}
    return _as_module(maker._tm.emit_object(module), exported, {"functions": returned, **about})


def _letters(kind: Any) -> str:
    """Return a letter for each number that a function returns: l for int64, d for float64."""
    if isinstance(kind, _types.BaseTuple):
        return "".join(_letters(each) for each in kind)
    return {_types.none: "", _types.int64: "l", _types.float64: "d"}[kind]


# ---- the format (webassembly.github.io/spec/core/binary; github.com/WebAssembly/tool-conventions, Linking) ----

_HEAD = b"\0asm\1\0\0\0"
_CUSTOM, _TYPE, _IMPORT, _FUNCTION, _EXPORT, _ELEMENTS, _DATA, _DATA_COUNT = 0, 1, 2, 3, 7, 9, 11, 12
_SYMBOL_TABLE = 8
_FUNCTION_SYMBOL, _DATA_SYMBOL, _SECTION_SYMBOL = 0, 1, 3
_UNDEFINED, _HAS_NAME = 0x10, 0x40
_VALUE_TYPES = {0x7F: "i", 0x7E: "l", 0x7D: "f", 0x7C: "d", 0x7B: "v"}


class _ModuleReader:
    """Reads numbers and names from a place on."""

    def __init__(self, data: bytes, place: int = 0) -> None:
        self.data, self.place = data, place

    def number(self) -> int:
        """Return a number of 7 bits a byte, the lowest first."""
        value = shift = 0
        while True:
            byte = self.data[self.place]
            self.place, value, shift = self.place + 1, value | (byte & 0x7F) << shift, shift + 7
            if byte < 0x80:
                return value

    def bytes(self, count: int) -> bytes:
        """Return the next bytes."""
        self.place += count
        return self.data[self.place - count : self.place]

    def name(self) -> str:
        """Return a name, which follows its length."""
        return self.bytes(self.number()).decode()


def _number(value: int) -> bytes:
    head, rest = value & 0x7F, value >> 7
    return bytes([head | 0x80]) + _number(rest) if rest else bytes([head])


def _with_length(content: bytes) -> bytes:
    return _number(len(content)) + content


def _sections(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield kind and content of each section."""
    reader = _ModuleReader(data, len(_HEAD))
    while reader.place < len(data):
        kind = reader.bytes(1)[0]
        yield kind, reader.bytes(reader.number())


def _as_module(data: bytes, exported: Mapping[str, str], about: Mapping[str, Any]) -> bytes:
    """Return a module of an object file.

    Args:
        data: The object file.
        exported: The name of each exported function, by its symbol.
        about: See `module_of`.
    """
    sections = list(_sections(data))
    linking = next(content for kind, content in sections if kind == _CUSTOM and content.startswith(b"\7linking"))
    functions = {exported[symbol]: index for symbol, index in _functions(linking).items() if symbol in exported}
    held = {kind: content for kind, content in sections if kind not in (_CUSTOM, _DATA_COUNT)}
    assert _ELEMENTS not in held, "kernels must name no functions in data"
    kinds = _arguments(held)
    arguments = {name: kinds[index] for name, index in functions.items()}
    pieces, end = _data(held.pop(_DATA, b"\0"))
    text = json.dumps({**about, "arguments": arguments, "end": end}, separators=(",", ":"), sort_keys=True)
    exports = [_with_length(name.encode()) + b"\0" + _number(index) for name, index in sorted(functions.items())]
    # The code comes last but for data.
    made = [each for each in held.items() if each[0] < _EXPORT]
    made += [(_EXPORT, _number(len(exports)) + b"".join(exports))]
    made += [each for each in held.items() if each[0] > _EXPORT]
    made += [(_DATA, pieces), (_CUSTOM, _with_length(SECTION.encode()) + text.encode())]
    return _HEAD + b"".join(bytes([kind]) + _with_length(content) for kind, content in made)


def section_of(data: bytes) -> dict[str, Any]:
    """Return what the section of a module says that `module_of` made."""
    named = _with_length(SECTION.encode())
    found = next(content for kind, content in _sections(data) if kind == _CUSTOM and content.startswith(named))
    about: dict[str, Any] = json.loads(found[len(named) :])
    return about


def _functions(linking: bytes) -> dict[str, int]:
    """Return the index of each function by its symbol."""
    reader, functions = _ModuleReader(linking), {}
    reader.name()
    reader.number()  # the version
    while reader.place < len(linking):
        kind, size = reader.bytes(1)[0], reader.number()
        end = reader.place + size
        for _ in range(reader.number() if kind == _SYMBOL_TABLE else 0):
            symbol, flags = reader.bytes(1)[0], reader.number()
            if symbol == _DATA_SYMBOL:
                reader.name()
                # A variable that is there has a segment, a place in it and a size.
                for _ in range(0 if flags & _UNDEFINED else 3):
                    reader.number()
                continue
            index = reader.number()
            if symbol != _SECTION_SYMBOL and (not flags & _UNDEFINED or flags & _HAS_NAME):
                name = reader.name()
                if symbol == _FUNCTION_SYMBOL:
                    functions[name] = index
        reader.place = end
    return functions


def _arguments(whole: Mapping[int, bytes]) -> list[str]:
    """Return the arguments of each function: i, l, f, d for 32 and 64 bits, whole and not, and v for a vector.

    Functions are numbered from those that are imported on: there is none, as kernels call nothing from elsewhere.
    """
    kinds, reader = [], _ModuleReader(whole[_TYPE])
    for _ in range(reader.number()):
        reader.bytes(1)
        kinds.append("".join(_VALUE_TYPES[each] for each in reader.bytes(reader.number())))
        reader.bytes(reader.number())
    reader = _ModuleReader(whole[_IMPORT])
    for _ in range(reader.number()):
        place = f"{reader.name()}.{reader.name()}"
        kind = reader.bytes(1)[0]
        assert kind, f"kernels must call nothing from elsewhere, but they call {place}"
        # Limits of a memory; type and limits of a table; type of a global variable, and whether it changes.
        is_memory, is_table = kind == 2, kind == 1
        if is_memory or is_table:
            reader.bytes(is_table)
            for _ in range(1 + reader.number()):
                reader.number()
        else:
            reader.bytes(2)
    reader = _ModuleReader(whole[_FUNCTION])
    return [kinds[reader.number()] for _ in range(reader.number())]


def _data(content: bytes) -> tuple[bytes, int]:
    """Return data but for pieces of zeros, as memory is zeros at the beginning, and the first address behind all."""
    reader, pieces, end = _ModuleReader(content), [], 0
    for _ in range(reader.number()):
        begins = reader.place
        reader.bytes(2)  # in memory 0, at a constant
        address = reader.number()
        reader.bytes(1)
        held = reader.bytes(reader.number())
        end = max(end, address + len(held))
        if any(held):
            pieces.append(content[begins : reader.place])
    return _number(len(pieces)) + b"".join(pieces), end

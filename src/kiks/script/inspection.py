"""The frames and variables of a program that stands still, in the words of the Debug Adapter Protocol.

The protocol is Microsoft's: https://microsoft.github.io/debug-adapter-protocol/specification
"""

from __future__ import annotations

import linecache
import os
import reprlib
import traceback
from collections.abc import Mapping
from contextlib import suppress
from inspect import isclass, ismodule, isroutine
from types import FrameType
from typing import Any, NamedTuple

from kiks.errors import KiksError
from kiks.script.cpython import write_locals
from kiks.script.here import here
from kiks.script.refusals import is_of_kiks, is_of_program

CHILDREN_MAX = 1000
"""Most parts of a value that are shown; the rest is asked for by their numbers, or not at all."""

NAMES_MAX = 500
"""Most names that complete a beginning."""

_repr = reprlib.Repr()
_repr.maxstring = _repr.maxother = 400
_repr.maxlist = _repr.maxtuple = _repr.maxdict = _repr.maxset = _repr.maxarray = _repr.maxdeque = 20

Body = dict[str, Any]


class _Scope(NamedTuple):
    """The variables of a frame, its own or those of its module, or what is known of its robot."""

    frame: FrameType
    names: dict[str, Any]
    path: str = ""


class Inspection:
    """What a debugger sees while a program stands at a line.

    Args:
        stacks: The frames of the threads by their numbers, the innermost first.

    Attributes:
        has_acted: Whether the program was changed, so that it may go on in another way.
    """

    has_acted = False

    def __init__(self, stacks: Mapping[int, list[FrameType]]) -> None:
        self._stacks = stacks
        self._frames: list[FrameType] = []
        # What has parts, and how each part is set; a reference is a place in this list, from 1.
        self._values: list[tuple[Any, str]] = []
        self._sources: list[str] = []

    def stack_trace(self, given: Body) -> Body:
        """Return the frames of a thread: those of the program, and of libraries, but not those of KiKS."""
        frames = self._stacks.get(int(given["threadId"]), [])
        frames = [frame for frame in frames if is_of_program(name := frame.f_code.co_filename) or not is_of_kiks(name)]
        # What starts a program is of no interest to it.
        while frames and not is_of_program(frames[-1].f_code.co_filename):
            frames.pop()
        begin = given.get("startFrame") or 0
        end = begin + (given.get("levels") or len(frames))
        return {"stackFrames": [self._described(frame) for frame in frames[begin:end]], "totalFrames": len(frames)}

    def scopes(self, given: Body) -> Body:
        """Return the scopes of a frame."""
        frame = self._frame(given)
        names = {"Locals": frame.f_locals}
        if frame.f_code.co_name != "<module>":
            names["Globals"] = frame.f_globals
        scopes = [(name, _Scope(frame, each)) for name, each in names.items()]
        with suppress(KiksError):  # where the world shows none
            scopes.insert(1, ("Robot", _Scope(frame, here.look()._asdict(), "kiks.here.")))
        references = [(name, self._reference(scope, "")) for name, scope in scopes]
        return {"scopes": [{"name": name, "expensive": False, "variablesReference": at} for name, at in references]}

    def variables(self, given: Body) -> Body:
        """Return the parts of a value, or the variables of a scope."""
        value, path = self._values[int(given["variablesReference"]) - 1]
        parts = self._parts(value, path)
        begin = given.get("start") or 0
        end = begin + (given.get("count") or CHILDREN_MAX)
        return {"variables": [{"name": name} | self._shown(part, at) for name, part, at in parts[begin:end]]}

    def evaluate(self, given: Body) -> Body:
        """Evaluate an expression in a frame, or carry out a statement."""
        frame, text = self._frame(given), str(given["expression"]).strip()
        return self._shown(self._value_of(text, frame, may_act=given.get("context") == "repl"), f"({text})")

    def set_variable(self, given: Body) -> Body:
        """Give a part of a value, or a variable, another value."""
        value, _ = self._values[int(given["variablesReference"]) - 1]
        frame = value.frame if isinstance(value, _Scope) else self._frame({})
        self.has_acted = True
        name, new = str(given["name"]), self._value_of(str(given["value"]), frame, may_act=False)
        try:
            if isinstance(value, _Scope):
                value.names[name] = new
                write_locals(frame)
            elif isinstance(value, dict):
                value[next(key for key in value if _short(key) == name)] = new
            elif name.startswith("["):
                value[int(name[1:-1])] = new
            else:
                setattr(value, name, new)
        except Exception as error:
            raise KiksError(f"{name} must be something that can be set, but {error}.") from None
        return self._shown(new, name)

    def completions(self, given: Body) -> Body:
        """Return the names that complete what is typed."""
        from rlcompleter import Completer

        frame = self._frame(given)
        text = str(given["text"])[: max(int(given.get("column") or 1) - 1, 0)]
        begin = len(text)
        while begin and (text[begin - 1].isidentifier() or text[begin - 1] in ".0123456789"):
            begin -= 1
        word = text[begin:]
        completer, found = Completer({**frame.f_globals, **frame.f_locals}), list[str]()
        while len(found) < NAMES_MAX and (name := completer.complete(word, len(found))) is not None:
            found.append(name)
        return {"targets": [{"label": name, "start": begin, "length": len(word)} for name in found]}

    def source(self, given: Body) -> Body:
        """Return the text of what is no file, such as a cell of a notebook."""
        number = given.get("sourceReference") or (given.get("source") or {}).get("sourceReference") or 0
        if not 0 < number <= len(self._sources):
            raise KiksError(f"a source must be one that a frame names, but {number} is none.")
        return {"content": "".join(linecache.getlines(self._sources[number - 1]))}

    # ---- inside ----

    def _frame(self, given: Body) -> FrameType:
        number = given.get("frameId")
        if number is None:
            return next(stack[0] for stack in self._stacks.values() if stack)
        return self._frames[int(number) - 1]

    def _described(self, frame: FrameType) -> Body:
        self._frames.append(frame)
        code = frame.f_code
        name = os.path.basename(code.co_filename)
        source: Body = {"name": name, "path": os.path.realpath(code.co_filename)}
        if not os.path.isfile(code.co_filename):
            self._sources.append(code.co_filename)
            source = {"name": name, "sourceReference": len(self._sources)}
        hint = {} if is_of_program(code.co_filename) else {"presentationHint": "subtle"}
        shown = {"name": code.co_name, "source": source, "line": frame.f_lineno, "column": 1}
        return {"id": len(self._frames), **shown, **hint}

    def _value_of(self, text: str, frame: FrameType, *, may_act: bool) -> Any:
        names = frame.f_globals, frame.f_locals
        try:
            try:
                return eval(compile(text, "<debugger>", "eval"), *names)
            except SyntaxError:
                if not may_act:
                    raise
            code = compile(text, "<debugger>", "single")
            self.has_acted = True
            exec(code, *names)
            write_locals(frame)
            return None
        except Exception as error:
            raise KiksError(traceback.format_exception_only(error)[-1].strip()) from None

    def _reference(self, value: Any, path: str) -> int:
        self._values.append((value, path))
        return len(self._values)

    def _shown(self, value: Any, path: str) -> Body:
        """Return how a value is shown; `path` is the expression that has it."""
        shown: Body = {"value": _short(value), "type": type(value).__name__, "variablesReference": 0}
        shown["result"] = shown["value"]
        if path:
            shown["evaluateName"] = path
        if _has_parts(value):
            shown["variablesReference"] = self._reference(value, path)
            if _is_row(value):
                shown["indexedVariables"] = len(value)
        return shown

    def _parts(self, value: Any, path: str) -> list[tuple[str, Any, str]]:
        """Return the parts of a value: the name of each, its value, and the expression that has it."""
        if isinstance(value, _Scope):
            names = [(name, each) for name, each in value.names.items() if name.isidentifier() and name[:2] != "__"]
            # What the program computes comes first, what it is made of last.
            names.sort(key=lambda item: ismodule(item[1]) or isroutine(item[1]) or isclass(item[1]))
            return [(name, each, value.path + name) for name, each in names]
        if isinstance(value, Mapping):
            return [(_short(key), each, f"{path}[{key!r}]") for key, each in [*value.items()][:CHILDREN_MAX]]
        if _is_row(value):
            return [(f"[{number}]", value[number], f"{path}[{number}]") for number in range(len(value))]
        if isinstance(value, set | frozenset):
            return [(f"[{number}]", each, "") for number, each in enumerate([*value][:CHILDREN_MAX])]
        return [(name, each, f"{path}.{name}") for name, each in _attributes(value)]


def _attributes(value: Any) -> list[tuple[str, Any]]:
    # Without the properties of its class: to read one might change something, such as open a file.
    found, names = dict[str, Any](getattr(value, "__dict__", {})), list[str]()
    for each in type(value).__mro__:
        slots = each.__dict__.get("__slots__", ())
        names += [slots] if isinstance(slots, str) else slots
    found |= {name: getattr(value, name) for name in names if name not in found and hasattr(value, name)}
    return [(name, each) for name, each in found.items() if not name.startswith("__")]


def _is_row(value: Any) -> bool:
    """Return whether the parts of a value have numbers, such as those of a list or an array of NumPy."""
    if isinstance(value, list | tuple):
        return True
    return bool(getattr(value, "shape", ())) and hasattr(value, "dtype") and hasattr(value, "__getitem__")


def _has_parts(value: Any) -> bool:
    if isinstance(value, str | bytes | int | float | complex | None.__class__) or isroutine(value) or isclass(value):
        return False
    if isinstance(value, Mapping | set | frozenset) or _is_row(value):
        return len(value) > 0
    return not ismodule(value) and bool(_attributes(value))


def _short(value: Any) -> str:
    """Return the text of a value; what its own class says may fail in any way."""
    try:
        return _repr.repr(value)
    except Exception as error:
        return f"<{type(value).__name__}, whose repr has failed: {type(error).__name__}>"

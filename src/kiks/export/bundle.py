"""Makes one script of the desk's JavaScript modules, for a page that is opened as a file.

Browsers load no modules from files, and a script that stands in the page itself can be named by its hash in the page's
security policy. So each module becomes a function that returns what the module exports.
"""

from __future__ import annotations

import re
from graphlib import TopologicalSorter
from pathlib import Path

_IMPORT = re.compile(r'^import \{([^}]*)\} from "\./(\w+\.js)";$', re.MULTILINE)
_EXPORT = re.compile(r"^export ((?:async )?(?:class|function|const) (\w+))", re.MULTILINE)
_OTHER = re.compile(r"^(?:import|export)\b.*|</script|<!--", re.MULTILINE | re.IGNORECASE)


def bundle(entry: Path) -> str:
    """Return the text of a script that does what a module and all that it imports do.

    Modules import names in braces from files beside them, and export classes, functions and constants where they
    define them. What they import while they run is left out.
    """
    texts: dict[str, str] = {}
    needs: dict[str, list[str]] = {}
    waiting = [entry.name]
    while waiting:
        name = waiting.pop()
        if name not in texts:
            texts[name] = (entry.parent / name).read_text("utf-8")
            needs[name] = [found[2] for found in _IMPORT.finditer(texts[name])]
            waiting += needs[name]
    order = TopologicalSorter(needs).static_order()
    return "\n".join(['"use strict";', "const modules = {};", *(_as_function(name, texts[name]) for name in order)])


def _as_function(name: str, text: str) -> str:
    exported = [found[2] for found in _EXPORT.finditer(text)]
    text = _EXPORT.sub(r"\1", _IMPORT.sub(_as_constants, text))
    other = _OTHER.search(text)
    assert other is None, f"{name} has what no bundle can have: {other and other[0]}"
    return f'modules["{name}"] = (() => {{\n{text}\nreturn {{ {", ".join(exported)} }};\n}})();'


def _as_constants(found: re.Match[str]) -> str:
    names = found[1].replace(" as ", ": ")
    return f'const {{{names}}} = modules["{found[2]}"];'

"""What a browser remembers of the desk from visit to visit: cookies, which all desks of a computer share."""

from __future__ import annotations

import re

from nicegui import ui

YEAR_S = 365 * 24 * 3600
"""For how long [s]."""


def remembered(name: str) -> str:
    """Return what the browser of this page remembers under a name; nothing if it remembers none."""
    request = ui.context.client.request
    return "" if request is None else request.cookies.get(f"kiks-{name}", "")


def remember(name: str, value: object) -> None:
    """Let the browser of this page remember a word or a number."""
    # A browser runs this text: nothing that comes from outside may be in it.
    assert re.fullmatch(r"[\w.-]+", f"{name}{value}", re.ASCII)
    code = f"document.cookie = 'kiks-{name}={value}; path=/; max-age={YEAR_S}; samesite=lax'"
    ui.run_javascript(code)

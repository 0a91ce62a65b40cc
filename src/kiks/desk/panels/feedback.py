"""What a person hears of what went wrong."""

from __future__ import annotations

import functools
from collections.abc import Awaitable, Callable
from typing import ParamSpec

from nicegui import ui

from kiks.errors import KiksError

Given = ParamSpec("Given")


def told(act: Callable[Given, Awaitable[None]]) -> Callable[Given, Awaitable[None]]:
    """Let what KiKS objects to in an action of the page be shown to the person who has done it."""

    @functools.wraps(act)
    async def acted(*args: Given.args, **kwargs: Given.kwargs) -> None:
        try:
            await act(*args, **kwargs)
        except KiksError as error:
            ui.notify(str(error), type="negative", multi_line=True, close_button="OK", timeout=10_000)

    return acted

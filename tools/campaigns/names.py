"""Names that look like markup, on all panels: they are texts, so the page has the elements of plain names."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from nicegui import Client, ui
from tools.campaigns.runner import Broken, Campaign, Play

import kiks
from kiks.desk.panels.page import Page
from kiks.desk.server.desk import Desk
from kiks.desk.server.live_editing import Editing
from kiks.desk.server.rights import Rights
from kiks.ports.program_command import ProgramCommand
from kiks.run import Run
from kiks.sim.from_project import described
from kiks.sim.ring_buffer import RingBuffer

CASES = 300
"""How many desks are opened."""

PIECES = (
    *(
        '"',
        "'",
        " ",
        "=",
        "<",
        ">",
        "[",
        "]",
        "{{",
        "}}",
        "${",
        "`",
        "\\",
        "&quot;",
        "#",
        "%22",
        "x",
        "\u00e9",
        "*",
        "remove",
    ),
    *('href="javascript:alert(1)"', "onclick=alert(1)", "<img src=x onerror=alert(1)>", ":class=", "v-html="),
)
"""What they consist of."""

PLAIN = "plain"


def _name(rng: random.Random) -> str:
    return "".join(rng.choices(PIECES, k=rng.randrange(1, 9)))


def _program(name: str, number: int, *, is_running: bool) -> Any:
    """Return what the panel needs of a program."""
    output: RingBuffer[Any] = RingBuffer(10)
    output.append(SimpleNamespace(text=name, is_error=is_running))
    return SimpleNamespace(
        command=ProgramCommand(Path(f"{name}.py")), number=number, robot=1, output=output,
        state="running" if is_running else "ended", is_running=is_running, code=None if is_running else 1,
    )  # fmt: skip


async def _elements(names: list[str]) -> list[tuple[str, list[str]]]:
    """Return tag and properties of all elements of a page on which things have some names."""
    sim = kiks.Simulation(kiks.Arena.box(300, 300), robots=2)
    project = described(sim)
    robots = tuple(replace(robot, name=name) for robot, name in zip(project.robots, names, strict=False))
    project = replace(project, arena=replace(project.arena, name=names[0]), robots=robots)
    desk = Desk(Run(project, Path(), sim=sim), Rights.NOTEBOOK, folder=Path(names[1]))
    desk.programs.handles[:] = [_program(name, number, is_running=number % 2 == 0) for number, name in enumerate(names)]
    desk.say(names[2])
    try:
        with Client(ui.page("/desk"), request=None) as client:
            page = Page(desk, Editing(desk), 1)
            for tab in page._builders:
                page._open(tab)
            page._tell_news()
            found = [(each.tag, sorted(each.props)) for each in client.elements.values()]
            client.delete()
            return found
    finally:
        desk.programs.handles.clear()
        desk.close()


def _prepare() -> Play:
    plain = asyncio.run(_elements([PLAIN] * 3))

    def play(rng: random.Random) -> None:
        names = [_name(rng) for _ in range(3)]
        found = asyncio.run(_elements(names))
        if found != plain:
            other = next((here for here, there in zip(found, plain, strict=False) if here != there), "their number")
            raise Broken("foreign", f"{names}: {other}", "a name became markup")

    return play


def campaigns() -> Iterator[Campaign]:
    """Yield one."""
    yield Campaign("names.desk", CASES, _prepare)

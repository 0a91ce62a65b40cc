"""`kiks arena`: creates arena files and describes their contents."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kiks.cli.command_line import command_group
from kiks.cli.options import arena_names
from kiks.cli.outputs import Command, has_results, output, tell_results
from kiks.errors import counted
from kiks.table import Table

if TYPE_CHECKING:
    from kiks.model.arena import Arena

Out = Annotated[
    Path,
    typer.Argument(
        metavar="OUT.toml",
        help="The arena file; its picture goes beside it as .png.",
        callback=output(".toml", beside=".png"),
    ),
]

arena = command_group("List, create and describe arenas.", no_args_is_help=True)


@arena.command(cls=Command)
def maze(
    out: Out,
    columns: Annotated[int, typer.Option(help="Cells side by side, without entrance and exit.")] = 4,
    rows: Annotated[int, typer.Option(help="Cells one above the other.")] = 4,
    path_mm: Annotated[int, typer.Option(help="Width of the passages [mm].")] = 120,
    wall_mm: Annotated[int, typer.Option(help="Thickness of the walls between them [mm].")] = 10,
    seed: Annotated[int, typer.Option(help="Seed: the same seed, the same maze.", min=0)] = 0,
) -> None:
    """Create a random maze.

    A robot starts at the entrance, upper left, and a lamp hangs at the exit, lower right.

    Example: kiks arena maze maze.toml --columns 6 --rows 5 --seed 3
    """
    from kiks.model.arena import Arena

    _save(Arena.maze(columns=columns, rows=rows, path_mm=path_mm, wall_mm=wall_mm, seed=seed), out)


@arena.command(cls=Command)
def room(
    out: Out,
    width_mm: Annotated[int, typer.Option(help="Outer width [mm].")] = 1100,
    height_mm: Annotated[int, typer.Option(help="Outer height [mm].")] = 1100,
    walls: Annotated[int, typer.Option(help="Number of walls.")] = 4,
    pillars: Annotated[int, typer.Option(help="Number of round pillars.")] = 3,
    lamps: Annotated[int, typer.Option(help="Number of lamps.")] = 1,
    seed: Annotated[int, typer.Option(help="Seed: the same seed, the same room.", min=0)] = 0,
) -> None:
    """Create a random room with walls, pillars and lamps.

    A robot reaches every place.

    Example: kiks arena room room.toml --walls 6 --seed 3
    """
    from kiks.model.arena import Arena

    sizes = {"width_mm": width_mm, "height_mm": height_mm}
    _save(Arena.room(**sizes, walls=walls, pillars=pillars, lamps=lamps, seed=seed), out)


@arena.command(cls=Command)
def new(
    out: Out,
    width_mm: Annotated[int, typer.Option(help="Outer width [mm].")],
    height_mm: Annotated[int, typer.Option(help="Outer height [mm].")],
    wall_mm: Annotated[int, typer.Option(help="Thickness of the wall around it [mm].")] = 10,
    rounded_mm: Annotated[int, typer.Option(help="Radius of the corners [mm].")] = 0,
    brightness: Annotated[str, typer.Option(help="Brightness of the wall, 1 to 255, or a material: wood.")] = "255",
) -> None:
    """Create an empty box to draw in.

    Its picture has one pixel per millimetre.

    Example: kiks arena new room.toml --width-mm 800 --height-mm 600 --brightness wood
    """
    from kiks.model.arena import Arena

    shade = int(brightness) if brightness.removeprefix("-").isdecimal() else brightness
    box = Arena.box(width_mm, height_mm, wall_mm=wall_mm, rounded_mm=rounded_mm, brightness=shade)
    _save(box, out)


@arena.command("list", cls=Command)
@has_results
def list_(context: typer.Context) -> None:
    """List the arenas that come with KiKS.

    Every command and `Arena.load` know them by name.

    Example: kiks arena list
    """
    from kiks.model.shipped import shipped_arena, shipped_arenas

    found, rows = [], []
    for name in shipped_arenas():
        if "/" not in name:
            place = shipped_arena(name)
            things = {"start": place.starts, "lamp": place.lamps, "ball": place.balls, "cylinder": place.cylinders}
            counts = {thing: len(each) for thing, each in things.items()}
            contents = ", ".join(counted(count, thing) for thing, count in counts.items() if count)
            rows.append((name, f"{place.width_mm:g} x {place.height_mm:g} mm, {contents}"))
            size = {"name": name, "width_mm": place.width_mm, "height_mm": place.height_mm}
            found.append(size | {f"{thing}s": count for thing, count in counts.items()})
    tell_results(context, found, [str(Table((), rows, left_count=2))])


@arena.command(cls=Command)
@has_results
def info(
    context: typer.Context,
    file: Annotated[
        Path,
        typer.Argument(metavar="ARENA", help="An arena's name, file or picture.", autocompletion=arena_names),
    ],
) -> None:
    """Describe an arena, and whether a Khepera fits at its starts.

    Example: kiks arena info maze
    """
    from kiks.model.arena import Arena
    from kiks.model.robot import RobotSpec

    place = Arena.load(file)
    robot_mm = RobotSpec.load("khepera").body.diameter_mm
    starts = []
    for start in place.starts:
        room_mm = max(2 * float(place.clearance_at_mm(start.x_mm, start.y_mm)), 0.0)
        fits = bool(place.free_for(start.x_mm, start.y_mm, robot_mm / 2))
        starts.append({**start._asdict(), "room_mm": room_mm, "khepera_fits": fits})
    found = {
        "name": place.name,
        "width_mm": place.width_mm,
        "height_mm": place.height_mm,
        "mm_per_cell": place.mm_per_cell,
        "wall_share": float((place.brightness > 0).mean()),
        # Clearance is measured between centres of cells, so half a cell of it is wall.
        "widest_mm": 2 * float(place.clearance.max()) - place.mm_per_cell,
        "starts": starts,
        **{
            f"{name}s": [each._asdict() for each in getattr(place, f"{name}s")] for name in ("lamp", "ball", "cylinder")
        },
        "walls": [each.table() for each in place.walls],
        "zones": [each.table() for each in place.zones],
        "floor_span": None if place.shades is None else [int(place.shades.min()), int(place.shades.max())],
    }
    tell_results(context, found, _lines_of(place, robot_mm, found))


def _lines_of(place: Arena, robot_mm: float, found: dict[str, Any]) -> Iterator[str]:
    """Yield what `info` tells people."""
    import math

    from kiks.model.arena_file import toml

    walls = f"{100 * found['wall_share']:.0f} % of it wall"
    yield f"{place.name}: {place.width_mm:g} x {place.height_mm:g} mm, cells of {place.mm_per_cell:g} mm, {walls}"
    yield f"Widest place: room for {found['widest_mm']:.1f} mm across"
    for number, start in enumerate(found["starts"], start=1):
        yield (
            f"Start {number}: {_at(start['x_mm'], start['y_mm'])}, heading "
            f"{math.degrees(start['heading_rad']):g} degrees, room for {start['room_mm']:.1f} mm across: a Khepera "
            f"({robot_mm:g} mm) {'fits' if start['khepera_fits'] else 'does not fit'}"
        )
    if not place.starts:
        where = "fits nowhere"
        if found["widest_mm"] >= robot_mm:
            x_mm, y_mm, _ = place.find_start(robot_mm / 2)
            where = f"starts at {_at(x_mm, y_mm)}"
        yield f"Start: none; a Khepera ({robot_mm:g} mm) {where}"
    for number, lamp in enumerate(place.lamps, start=1):
        switch = "on" if lamp.is_on else "off"
        yield f"Lamp {number}: {_at(lamp.x_mm, lamp.y_mm)}, {lamp.power_w:g} W, {switch}"
    for number, body in enumerate(place.bodies, start=1):
        is_ball = number <= len(place.balls)
        label = f"Ball {number}" if is_ball else f"Cylinder {number - len(place.balls)}"
        size = f"radius {body.radius_mm:g} mm, brightness {body.brightness}"
        yield f"{label}: {_at(body.x_mm, body.y_mm)}, {size}"
    for shapes in (place.walls, place.zones):
        for number, shape in enumerate(shapes, start=1):
            table = ", ".join(f"{name} = {toml(value)}" for name, value in shape.table().items())
            yield f"{shape.label.capitalize()} {number}: {table}"
    if (span := found["floor_span"]) is not None:
        yield f"Floor: brightness {span[0]} to {span[1]}"


def _at(x_mm: float, y_mm: float) -> str:
    return f"({x_mm:g}, {y_mm:g}) mm"


def _save(made: Arena, out: Path) -> None:
    """Write an arena, named after its file."""
    from dataclasses import replace

    from kiks.model.arena_file import save_arena

    save_arena(replace(made, name=out.stem), out)
    typer.echo(f"Arena: {out}   Picture: {out.with_suffix('.png')}")

"""The frames and messages of ghosts for the player of a page: one generation after the other, on one line of time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup, escape

from kiks.engine.parameters import RAY_COUNT
from kiks.export.frames import HEAD, NO_HIT, ROBOT, VERSION, arena_picture, describe_scene, describe_shapes
from kiks.export.frames import KIND as FRAME_KIND
from kiks.export.ghosts import GHOST_SHARE, Ghosts, check_scenes
from kiks.export.page import page_template, player_script, player_style, player_values
from kiks.export.run_frames import RunFrames, fitting_period_ns
from kiks.model.arena import Arena, Pose
from kiks.model.atomic_files import replace_file
from kiks.model.robot import SENSOR_COUNT
from kiks.sim.simulation import Simulation
from kiks.units import NS_PER_S, clock_text, s_from_ns


class GhostFrames(RunFrames):
    """The frames of generations.

    Args:
        generations: The generations.
    """

    def __init__(self, generations: Sequence[Ghosts]) -> None:
        self.frames, self.scenes, self.pictures, self.shapes = [], [], [], []
        most = max(len(each.ways) for each in generations)
        size = HEAD.itemsize + most * (ROBOT.itemsize + 2 * SENSOR_COUNT * RAY_COUNT)
        self.begin_ns = 0
        self.end_ns = sum(round(each.seconds * NS_PER_S) for each in generations)
        self.period_ns = fitting_period_ns(self.end_ns, size)
        begin_ns = 0
        for each in generations:
            until_ns = begin_ns + round(each.seconds * NS_PER_S)
            self._take_generation(each, begin_ns, until_ns)
            begin_ns = until_ns

    def _take_generation(self, ghosts: Ghosts, begin_ns: int, until_ns: int) -> None:
        """Add the frames of a generation."""
        arena, count = ghosts.arena, len(ghosts.ways)
        number, picture = len(self.scenes), arena_picture(arena)
        if picture not in self.pictures:
            self.pictures.append(picture)
        # Robots that stand apart lend their looks.
        side, apart_mm = math.ceil(math.sqrt(count)), math.ceil(3.0 * ghosts.spec.body.radius_mm)
        edge_mm = (side + 1) * apart_mm
        places = [((k % side + 1) * apart_mm, (k // side + 1) * apart_mm) for k in range(count)]
        room = replace(Arena.box(edge_mm, edge_mm), starts=tuple(Pose(*each, 0.0) for each in places))
        sim = Simulation(room, robots=count, robot=ghosts.spec)
        scene = describe_scene(sim, number)
        scene["arena"] = {
            "name": ghosts.title,
            "width_mm": float(arena.width_mm),
            "height_mm": float(arena.height_mm),
            "mm_per_cell": float(arena.mm_per_cell),
            "picture": self.pictures.index(picture),
        }
        for robot in scene["robots"]:
            robot["reach_mm"] = 0.0  # they sense worlds of their own
        for robot in scene["robots"][1:]:
            robot["opacity"] = GHOST_SHARE
        self.scenes.append(scene)
        self.shapes.append((len(self.frames), describe_shapes(sim)))
        lamps = np.array([tuple(each) for each in arena.lamps], "<f4").reshape(-1, 4)
        rays = np.full(count * SENSOR_COUNT * RAY_COUNT, NO_HIT, "<u2").tobytes()
        robots: Any = np.zeros(count, ROBOT)
        points = ghosts.ways.shape[1]
        for time_ns in range(begin_ns, until_ns, self.period_ns):
            place = (time_ns - begin_ns) / (until_ns - begin_ns) * (points - 1)
            robots["pose"] = ghosts.ways[:, round(place)]
            counts = count, 0, len(lamps), 0
            head = np.array((VERSION, FRAME_KIND, 0, number, s_from_ns(time_ns), 0.0, 0.0, *counts), HEAD)
            self.frames.append(b"".join((head.tobytes(), robots.tobytes(), lamps.tobytes(), rays)))


STYLE = """
.player { grid-template-columns: minmax(0, 1fr); }
.player .kiks-arena { height: 78vh; }
.beside, .more .hint, #facts { display: none; }
"""
"""What the player of ghosts leaves out: readings, which each ghost had in a world of its own."""


def save_ghost_page(generations: Sequence[Ghosts], path: str | Path) -> None:
    """Write a page with a player of generations, whose slider leads from one to the next.

    Args:
        generations: The generations.
        path: The page, .html.
    """
    check_scenes(generations)
    frames = GhostFrames(generations)
    begins_s = np.cumsum([0.0, *(each.seconds for each in generations)])
    listed = "".join(
        f"<li>{escape(f'from {clock_text(begin_s)}: {each.title}')}</li>"
        for begin_s, each in zip(begins_s.tolist(), generations, strict=False)
    )
    section = page_template("run_player.html").render(player_values(frames))
    style = Markup(player_style() + STYLE)
    page = page_template("run_frame.html").render(script=Markup(player_script()), style=style)
    for name, text in (("The run", "Ghosts"), ("SECTION", f"{section}<ol>{listed}</ol>"), ("FRAMES", frames.pack())):
        page = page.replace(name, text, 1)
    replace_file(path, page.encode("utf-8", "replace"), "a page")

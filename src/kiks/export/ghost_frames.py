"""The page of ghosts: a player of one generation after the other, on one line of time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup, escape

from kiks.engine.parameters import RAY_COUNT
from kiks.engine.sensing.frame_parts import NO_HIT, SHOWN_ROBOT
from kiks.export.frames import HEAD, KIND, VERSION, describe_arena, describe_scene, describe_shapes
from kiks.export.ghosts import GHOST_SHARE, Ghosts
from kiks.export.packed_text import packed_text
from kiks.export.page import page_template, player_script, player_style, player_values
from kiks.export.page_run import packed_engine
from kiks.export.shown_run import ShownRun
from kiks.model.arena import Arena, Pose
from kiks.model.atomic_files import replace_file
from kiks.model.robot import SENSOR_COUNT
from kiks.sim.simulation import Simulation
from kiks.units import NS_PER_S, clock_text, s_from_ns

STYLE = """
.player { grid-template-columns: minmax(0, 1fr); }
.player .kiks-arena { height: 78vh; }
.beside, .more .hint, #facts { display: none; }
"""
"""What the player of ghosts leaves out: readings, which each ghost had in a world of its own."""


FRAME_BYTES_MAX = 16 << 20
"""Most bytes of all frames together. Packed, they take a sixth of it or less."""


class GhostFrames(ShownRun):
    """The frames of generations; `web/recorded_feed.js` shows them.

    Args:
        scenes: The generations.

    Attributes:
        frames: As `pack_frame` returns them. The scene of each is an index of `scenes`.
    """

    def __init__(self, scenes: Sequence[Ghosts]) -> None:
        super().__init__(0, sum(round(each.seconds * NS_PER_S) for each in scenes))
        self.frames: list[bytes] = []
        most = max(len(each.trajectories) for each in scenes)
        frame_bytes = HEAD.itemsize + most * (SHOWN_ROBOT.itemsize + 2 * SENSOR_COUNT * RAY_COUNT)
        while self.end_ns // self.period_ns * frame_bytes > FRAME_BYTES_MAX:
            self.period_ns *= 2
        begin_ns = 0
        for each in scenes:
            until_ns = begin_ns + round(each.seconds * NS_PER_S)
            self._add(each, begin_ns, until_ns)
            begin_ns = until_ns

    def _add(self, ghosts: Ghosts, begin_ns: int, until_ns: int) -> None:
        """Add the frames of a generation."""
        number, (count, points) = len(self.scenes), ghosts.trajectories.shape[:2]
        looks = _standing_apart(ghosts)
        scene = describe_scene(looks, number)
        scene["arena"] = describe_arena(ghosts.arena) | {
            "name": ghosts.title,
            "picture": self.add_picture(ghosts.arena),
        }
        for index, robot in enumerate(scene["robots"]):
            robot["reach_mm"] = 0.0  # they sense worlds of their own
            if index:
                robot["opacity"] = GHOST_SHARE
        self.scenes.append(scene)
        self.shapes.append((len(self.frames), describe_shapes(looks)))
        lamps = np.array([tuple(each) for each in ghosts.arena.lamps], "<f4").reshape(-1, 4)
        rays = np.full(count * SENSOR_COUNT * RAY_COUNT, NO_HIT, "<u2").tobytes()
        robots: Any = np.zeros(count, SHOWN_ROBOT)
        for time_ns in range(begin_ns, until_ns, self.period_ns):
            place = (time_ns - begin_ns) / (until_ns - begin_ns) * (points - 1)
            robots["pose"] = ghosts.trajectories[:, round(place)]
            counts = count, 0, len(lamps), 0
            head = np.array((VERSION, KIND, 0, number, s_from_ns(time_ns), 0.0, 0.0, *counts), HEAD)
            self.frames.append(b"".join((head.tobytes(), robots.tobytes(), lamps.tobytes(), rays)))

    def pack(self) -> str:
        """Return all of it as text, in the form of `packed_text`.

        The parts are the frames in groups of equal size. Each group holds the differences of each frame's bytes from
        the frame before it, the first byte of all frames before the second one: most bytes change seldom, or by little.
        """
        groups = [(size, list(group)) for size, group in groupby(self.frames, len)]
        counts = [{"size": size, "count": len(frames)} for size, frames in groups]
        head = {"period_s": s_from_ns(self.period_ns), "groups": counts, **self.messages()}
        return packed_text(head, (_differences(size, frames) for size, frames in groups))


def _differences(size: int, frames: list[bytes]) -> bytes:
    """Return the differences of each frame's bytes from the frame before it, column by column."""
    table = np.frombuffer(b"".join(frames), np.uint8).reshape(len(frames), size)
    table = np.diff(table, axis=0, prepend=np.uint8(0))
    return np.ascontiguousarray(table.T).tobytes()


def _standing_apart(ghosts: Ghosts) -> Simulation:
    """Return a world with as many robots, for how they look: no world has room for those that overlap."""
    count, apart_mm = len(ghosts.trajectories), math.ceil(3.0 * ghosts.spec.body.radius_mm)
    side = math.ceil(math.sqrt(count))
    places = [((k % side + 1) * apart_mm, (k // side + 1) * apart_mm) for k in range(count)]
    room = Arena.box((side + 1) * apart_mm, (side + 1) * apart_mm)
    starts = tuple(Pose(*each, 0.0) for each in places)
    return Simulation(replace(room, starts=starts), robots=count, robot=ghosts.spec)


def draw_ghost_page(scenes: Sequence[Ghosts], path: str | Path) -> None:
    """Write a page with a player of generations, whose slider leads from one to the next."""
    frames = GhostFrames(scenes)
    begins_s = np.cumsum([0.0, *(each.seconds for each in scenes)])
    listed = "".join(
        f"<li>{escape(f'from {clock_text(begin_s)}: {each.title}')}</li>"
        for begin_s, each in zip(begins_s.tolist(), scenes, strict=False)
    )
    section = page_template("run_player.html").render(player_values(frames))
    style = Markup(player_style() + STYLE)
    page = page_template("run_frame.html").render(
        script=Markup(player_script()), style=style, engine=packed_engine(), controllers=[]
    )
    for name, text in (("The run", "Ghosts"), ("SECTION", f"{section}<ol>{listed}</ol>"), ("FRAMES", frames.pack())):
        page = page.replace(name, text, 1)
    replace_file(path, page.encode("utf-8", "replace"), "a page")

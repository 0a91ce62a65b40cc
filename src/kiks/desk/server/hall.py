"""A tournament in a hall: its games are shown on a desk one after the other, with the table between them.

Need: people watch each game and learn how it ends from the game alone. Method: games are played ahead by the runner, as
without a desk, and the desk plays their recordings in the order in which they were drawn. The table has the games that
were shown.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from kiks.desk.server.desk import Desk
from kiks.errors import KiksError
from kiks.trials.tournament import Played, Tournament

BREAK_S = 8.0
"""Time for which the table is shown between two games [s of real time]."""

ROWS_MAX = 12
"""Most rows of the table on the board."""


class Hall:
    """Shows the games of a tournament on a desk; `tend` is called about once a second.

    Args:
        title: The match's name.
        players: The players' names, as `Tournament` has them.
        folder: The folder of the recordings.
        clock: The wall clock [s].
    """

    def __init__(
        self, title: str, players: tuple[str, ...], folder: Path, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._made = Tournament(title, players, ())
        self._folder, self._clock = folder, clock
        self._lock = threading.Lock()
        self._known: dict[int, Played] = {}
        self._count, self._is_over = 0, False
        self._shown = 0
        self._game: Played | None = None  # the one that is shown
        self._break_end_s = -math.inf

    def note(self, played: Played, count: int) -> None:
        """Take a game that was played, and how many games are drawn so far; from any thread."""
        with self._lock:
            self._known[played.number], self._count = played, count

    def end(self) -> None:
        """Say that no more games come; from any thread."""
        self._is_over = True

    async def tend(self, desk: Desk) -> None:
        """Begin the next game, or the break after one, when it is time."""
        if self._game is not None:
            past = desk.past
            if past is None or past.sim.now_ns >= past.span.end_ns:
                self._finish(self._game)
            return
        if self._clock() < self._break_end_s:
            return
        with self._lock:
            following = self._known.get(self._shown + 1)
        if following is None or not desk.is_seen.is_set():
            return
        if not following.outcome.recording:
            self._finish(following)
            return
        self._game = following
        robots = zip(desk.project.robots, following.names, strict=True)
        desk.project = replace(desk.project, robots=tuple(replace(robot, name=name) for robot, name in robots))
        try:
            await desk.looking.show_run(self._folder / following.outcome.recording)
        except KiksError as error:
            desk.say(f"Game {following.number} cannot be shown: {error}")
            self._finish(following)
        desk.tell()

    def _finish(self, game: Played) -> None:
        self._shown += 1
        self._made = replace(self._made, played=(*self._made.played, game))
        self._game, self._break_end_s = None, self._clock() + BREAK_S

    def describe(self) -> dict[str, Any]:
        """Return what the board shows of it."""
        with self._lock:
            following, count = self._known.get(self._shown + 1), self._count
        is_between = self._game is None
        is_over = is_between and self._is_over and following is None
        number = self._shown + (not is_between)
        standings = self._made.standings[:ROWS_MAX]
        table = [(each["name"], str(each["played"]), f"{each['share']:.0%}") for each in standings]
        last = self._made.played[-1] if is_between and self._made.played else None
        return {
            "title": "The end" if is_over else f"Game {number} of {count}" if number else self._made.title,
            "last": None if last is None else f"{' – '.join(last.names)}   {last.text}",
            "next": " – ".join(following.names) if is_between and following is not None else None,
            "table": table if is_between and self._made.played else [],
        }

"""The board above the arena: the score of a run, and in the hall view the clock, large enough for a projector."""

from __future__ import annotations

from kiks.desk.panels.widgets import WEB, FeedElement


class ScoreBoard(FeedElement, component=WEB / "board.js", esm={"kiks-desk": str(WEB)}):
    """The score; its method `enter` in the browser begins the hall view."""

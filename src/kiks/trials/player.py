"""What the report needs to play a run: its player's part of the page, and the frames as compressed text."""

from __future__ import annotations

from pathlib import Path

from kiks.export.page import page_template, player_values
from kiks.export.run_frames import RunFrames
from kiks.recording.recording import Recording


def player_of(recording: Path) -> dict[str, str]:
    """Return what `web/grades.js` puts together to a page that plays a recording.

    Args:
        recording: The recording's file.
    """
    frames = RunFrames(Recording(recording).log)
    return {"section": page_template("run_player.html").render(player_values(frames)), "frames": frames.pack()}

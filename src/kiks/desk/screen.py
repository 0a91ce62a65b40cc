"""Whether there is a screen for a desk: in a file of its own, since a desk takes a second to import."""

from __future__ import annotations

import os
import sys


def has_screen() -> bool:
    """Return whether this computer has a screen for this process."""
    return sys.platform in ("win32", "darwin") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))

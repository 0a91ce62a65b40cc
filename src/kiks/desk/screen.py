"""Whether there is a screen on which a browser could be seen."""

from __future__ import annotations

import os
import sys


def has_screen() -> bool:
    """Say whether there is one."""
    return sys.platform in ("win32", "darwin") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))

"""Whether bubblewrap is here and can make namespaces, without which there is no sandbox."""

from __future__ import annotations

import shutil
import subprocess

import pytest


def has_namespaces() -> bool:
    """Return whether a sandbox can be made."""
    command = ["bwrap", "--unshare-all", "--ro-bind", "/", "/", "true"]
    return shutil.which("bwrap") is not None and not subprocess.run(command, capture_output=True).returncode


needs_sandbox = pytest.mark.skipif(
    not has_namespaces(), reason="no bubblewrap here that makes namespaces (package bubblewrap)"
)

"""Whether bubblewrap is here and can make namespaces, without which there is no sandbox."""

import functools
import shutil
import subprocess

import pytest


@functools.cache
def has_namespaces() -> bool:
    """Return whether a sandbox can be made."""
    command = ["bwrap", "--unshare-all", "--ro-bind", "/", "/", "true"]
    return shutil.which("bwrap") is not None and not subprocess.run(command, capture_output=True).returncode


# A text, so that it is looked at by the first test that needs it, and not when the tests are collected.
needs_sandbox = pytest.mark.skipif(
    "not __import__('tests.namespaces').namespaces.has_namespaces()",
    reason="no bubblewrap here that makes namespaces (package bubblewrap)",
)

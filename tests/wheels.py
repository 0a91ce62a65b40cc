"""Builds packages of KiKS and installs them in environments of their own."""

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

ROOT = Path(__file__).parents[1]


def build(folder: Path, *options: str, **environment: str) -> Path:
    """Build a wheel, and with other options of hatchling something else, into a folder; return it."""
    command = [sys.executable, "-m", "hatchling", "build", *(options or ("-t", "wheel")), "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, env=os.environ | environment, capture_output=True, check=True)
    (built,) = folder.iterdir()
    return built


def install(wheel: Path, folder: Path) -> Path:
    """Install a wheel in a new environment; return the folder of its commands.

    It finds the libraries of the environment of the tests, but not the KiKS that is there. `.ci/run` installs a wheel
    with what it says that it needs.
    """
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    command = [sys.executable, "-m", "pip", "--python", str(folder / "bin" / "python"), "install", "--quiet"]
    subprocess.run([*command, "--no-deps", "--no-index", str(wheel)], check=True, umask=0o022)
    (packages,) = folder.glob("lib/*/site-packages")
    (packages / "others.pth").write_text(sysconfig.get_path("purelib"))
    return folder / "bin"

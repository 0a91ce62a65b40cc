"""Puts compiled kernels into a wheel: a hook that hatchling calls.

Without the environment variable `KIKS_KERNELS`, the folder that `tools/compile_kernels.py` has filled, a wheel is pure
Python. With it, the wheel is for one version of Python on one system.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class KernelsInWheel(BuildHookInterface):  # type: ignore[type-arg]
    """Adds the files and the tag."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Change what is built.

        Args:
            version: Of the target: "standard" or "editable".
            build_data: What hatchling takes note of.
        """
        folder = os.environ.get("KIKS_KERNELS")
        if folder and version == "standard":
            build_data["force_include"][str(Path(folder, "kiks").absolute())] = "kiks/engine/compiled"
            build_data["pure_python"] = False
            build_data["infer_tag"] = True

"""Puts README.md into the metadata of a package: a hook that hatchling calls.

A package index shows README without the files beside it. There, its pictures and links lead to the repository, at the
tag of the version.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

RELATIVE = re.compile(r"(!?)(\[[^\]]*\])\((?!\w+:|#)([^)]+)\)")
"""A link or, with !, a picture, and its path in the repository."""


class ReadmeOfPackage(MetadataHookInterface):
    """Adds `readme`."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Change the metadata.

        Args:
            metadata: The table `project` of `pyproject.toml`, with the version.
        """
        source, tag = metadata["urls"]["Source"], f"v{metadata['version']}"

        def absolute(found: re.Match[str]) -> str:
            kind = "raw" if found[1] else "blob"
            return f"{found[1]}{found[2]}({source}/{kind}/{tag}/{found[3]})"

        text = Path(self.root, "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": RELATIVE.sub(absolute, text)}

"""The page docs/reference/protocol.md has all commands; .ci/run compares its texts with those of the firmware."""

from __future__ import annotations

import runpy
from pathlib import Path

from kiks.firmware.commands import COMMANDS, Command
from kiks.firmware.tools import TOOLS

DOCS = Path(__file__).parents[2] / "docs"


def test_everything_has_a_section() -> None:
    page = (DOCS / "reference" / "protocol.md").read_text(encoding="utf-8")
    for name in (*(f"{row.letter}: {row.name}" for row in COMMANDS), *TOOLS):
        assert f"### {name}\n" in page


def test_a_new_letter_has_an_example_without_an_entry_for_it() -> None:
    row = Command("X", "new", ("a", "b"), (), "", print)
    section = runpy.run_path(str(DOCS / "pages" / "protocol.py"))["command"](row)
    assert "-> X,1,1" in list(section)

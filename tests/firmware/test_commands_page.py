"""The command reference docs/commands.md says what the firmware does."""

import runpy
from pathlib import Path

from tests.at_length import at_length

from kiks.firmware.commands import COMMANDS
from kiks.firmware.tools import SUMMARY

DOCS = Path(__file__).parents[2] / "docs"


@at_length
def test_the_page_is_up_to_date() -> None:
    page = runpy.run_path(str(DOCS / "make_commands.py"))["page"]()
    written = (DOCS / "commands.md").read_text(encoding="utf-8")
    assert written == page, "docs/commands.md is out of date: run 'python docs/make_commands.py'"


def test_everything_has_a_section() -> None:
    page = (DOCS / "commands.md").read_text(encoding="utf-8")
    for name in (*(f"{row.letter}: {row.name}" for row in COMMANDS), *SUMMARY):
        assert f"### {name}\n" in page

"""The command reference docs/commands.md has all commands; .ci/run compares its texts with those of the firmware."""

from pathlib import Path

from kiks.firmware.commands import COMMANDS
from kiks.firmware.tools import SUMMARY

DOCS = Path(__file__).parents[2] / "docs"


def test_everything_has_a_section() -> None:
    page = (DOCS / "commands.md").read_text(encoding="utf-8")
    for name in (*(f"{row.letter}: {row.name}" for row in COMMANDS), *SUMMARY):
        assert f"### {name}\n" in page

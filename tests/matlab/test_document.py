"""docs/howto/matlab.md is correct: its functions exist, and its constants are preferences."""

import re

from tests.matlab.octave import ROOT, TOOLBOX

PAGE = (ROOT / "docs" / "howto" / "matlab.md").read_text(encoding="utf-8")


def test_every_function_and_demo_is_listed_and_every_listed_function_exists() -> None:
    listed = set(re.findall(r"`(k\w+)`", PAGE[PAGE.index("## Functions") : PAGE.index("`kiks('--version')`")]))
    assert listed == {path.stem for path in TOOLBOX.glob("*.m")}
    named = set(re.findall(r"`(\w+)`", PAGE[PAGE.index("**Demos**") : PAGE.index("**Real robots.**")]))
    assert {path.stem for path in (TOOLBOX / "demos").glob("*.m")} <= named


def test_every_constant_of_the_table_is_a_preference() -> None:
    preferences = (TOOLBOX / "kiks_preferences.m").read_text(encoding="utf-8")
    known = set(re.findall(r"^(KIKS_\w+) =", preferences, re.MULTILINE))
    named = set(re.findall(r"`(KIKS_\w+)`", PAGE[PAGE.index("| constant") : PAGE.index("The other constants")]))
    assert named <= known
    new = {"KIKS_SEED", "KIKS_THINKING", "KIKS_ROBOT", "KIKS_TURRETS", "KIKS_PROGRAMS", "KIKS_WINDOW"}
    assert new <= named

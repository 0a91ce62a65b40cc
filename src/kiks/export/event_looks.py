"""How the kinds of events of a run look, on the desk's time bar and on the page of a recording."""

from __future__ import annotations

from typing import NamedTuple

_STAR = "50% 0, 62% 36%, 100% 38%, 70% 60%, 80% 97%, 50% 76%, 20% 97%, 30% 60%, 0 38%, 38% 36%"
_RIBBON = "0 0, 100% 0, 100% 100%, 50% 68%, 0 100%"


class EventLook(NamedTuple):
    """How events of a kind look.

    Attributes:
        plural: What the page calls them.
        light: Their colour on light ground.
        dark: Their colour on dark ground.
        mark: The shape of a mark on the time bar, in CSS.
        line_px: Height of a line above the slider of the page [px]; those that come often are low.
    """

    plural: str
    light: str
    dark: str
    mark: str
    line_px: int = 12


EVENT_LOOKS = {
    "bookmark": EventLook(
        "Bookmarks",
        "#0b57c4",
        "#7cb8ff",
        f"width: 11px; height: 13px; margin-left: -5.5px; top: 2px; clip-path: polygon({_RIBBON});",
    ),
    "score": EventLook(
        "Scores",
        "#7b2fbf",
        "#d0a2ff",
        f"width: 14px; height: 13px; margin-left: -7px; top: 1px; clip-path: polygon({_STAR});",
    ),
    "output": EventLook("Output", "#1b7a34", "#5fd07f", "border-radius: 1px;", 6),
    "change": EventLook("Changes", "#b85c00", "#ffab57", "transform: rotate(45deg); border-radius: 1px;"),
    "contact": EventLook("Contacts", "#d3281d", "#ff6a5e", "border-radius: 50%;", 6),
}
"""The kinds of `kiks.recording.events.Event`, by priority: events that share a mark have the look of the first."""


def event_styles(dark_rule: str) -> str:
    """Return the style sheet of events: variables with their colours and heights, and classes of marks and lines.

    Args:
        dark_rule: A rule of CSS for dark ground, with {} in place of what it sets.
    """
    looks = EVENT_LOOKS.items()
    light = " ".join(f"--{kind}: {look.light}; --{kind}-px: {look.line_px};" for kind, look in looks)
    dark = " ".join(f"--{kind}: {look.dark};" for kind, look in looks)
    rules = [f":root {{ {light} }}", dark_rule.replace("{}", f"{{ {dark} }}")]
    for kind, look in looks:
        rules += [
            f".kiks-bar-{kind} {{ background: var(--{kind}); {look.mark} }}",
            f"#list .{kind} i, #kinds .{kind} {{ color: var(--{kind}); }}",
            f".without-{kind} .{kind} {{ display: none; }}",
        ]
    return "\n".join(rules) + "\n"

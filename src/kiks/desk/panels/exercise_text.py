"""The text of an exercise as HTML. It comes with a file from elsewhere, so nothing in it runs or reaches a network."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from markdown_it import MarkdownIt
from markdown_it.rules_core import StateCore
from markdown_it.token import Token

HINT = "hint"
"""A section whose heading begins with this word is folded."""

BRACKETS_MAX = 1000
"""Most brackets of a paragraph with links and pictures: the time to read them grows with the square of their number."""


class TextPart(NamedTuple):
    """A part of a text.

    Attributes:
        hint: The heading of a hint, which is folded; empty for all else.
        html: The part.
    """

    hint: str
    html: str


def parts_of(text: str) -> list[TextPart]:
    r"""Return the parts of a text in Markdown; a hint ends before the next heading of its level, or a higher one.

    Example:
        >>> [part.hint for part in parts_of("Drive.\n\n## Hint: how\n\n`D,5,5`\n\n## And then\n\nStop.")]
        ['', 'Hint: how', '']
    """
    markdown = MarkdownIt("js-default")
    markdown.add_render_rule("image", _picture)
    markdown.core.ruler.before("inline", "brackets", _leave_brackets)
    found: list[tuple[str, list[Token]]] = [("", [])]
    level = 0  # of the hint's heading; 0 outside of hints
    tokens = markdown.parse(text)
    index = 0
    while index < len(tokens):
        token = tokens[index]
        if token.type == "heading_open" and token.level == 0:
            own, title = int(token.tag[1:]), tokens[index + 1].content
            is_hint = title.lower().startswith(HINT)
            if is_hint or (level and own <= level):
                level = own if is_hint else 0
                found.append((title if is_hint else "", []))
            if is_hint:
                index += 3
                continue
        found[-1][1].append(token)
        index += 1
    return [
        TextPart(hint, markdown.renderer.render(part, markdown.options, {})) for hint, part in found if part or hint
    ]


def _leave_brackets(state: StateCore) -> None:
    """Show a paragraph with too many brackets as it is written."""
    for token in state.tokens:
        if token.type == "inline" and token.content.count("[") > BRACKETS_MAX:
            token.type = "text"


def _picture(self: Any, tokens: Sequence[Token], index: int, options: Any, env: Any) -> str:
    """Return a picture that is in the text itself; of one elsewhere, which a page must not load, what it is called."""
    token = tokens[index]
    if str(token.attrs.get("src", "")).startswith("data:"):
        return str(self.image(tokens, index, options, env))
    return f"<em>{self.renderInlineAsText(token.children, options, env)}</em>"

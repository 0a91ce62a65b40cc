"""Names from outside are text on the desk, whatever they look like: in a real browser, in every panel."""

import ast
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from tests.desk.visitor import INSIDE, Shown, Visitor, expect, make_project, open_desk

from kiks.ports.program_command import ProgramCommand

HOSTILE = '" nasty=1 href="javascript:window.ran=1" \' <img src=x onerror=window.ran=1>{{window.ran=1}}'
"""A name of a file that would be markup, if anything read it as such."""

FILE = "' nasty=1 {{window.ran=1}}"
"""The worst name of a file that the desk offers: it suits any computer."""

MARKUP = """() => [...document.querySelectorAll('*')].flatMap((each) => [...each.attributes]
    .filter(({ name, value }) => /^(nasty|on.*)$/.test(name) || /^javascript:/.test(value) || value === 'x')
    .map(({ name }) => `${each.tagName} ${name}`)).concat('ran' in window ? ['ran'] : [])"""
"""What of a hostile name has become an element or an attribute, or has run."""

READERS = {"props", "html", "markdown", "run_javascript", "add_head_html", "add_body_html"}
"""Functions of NiceGUI that read markup, a program or properties in a text."""


@pytest.fixture
def shown(tmp_path: Path) -> Iterator[Shown]:
    """A desk on which everything that has a name has a hostile one."""
    folder = tmp_path / HOSTILE
    folder.mkdir()
    program = folder / f"{HOSTILE}.py"
    program.write_text(f"print({HOSTILE!r})\n")
    plain = make_project()
    robots = tuple(replace(robot, name=HOSTILE) for robot in plain.robots)
    project = replace(plain, arena=replace(plain.arena, name=HOSTILE), robots=robots)
    project.save(folder / f"{FILE}.kiks")
    (folder / f"{FILE}.py").write_text("pass\n")
    shown = open_desk(folder, project, commands=[ProgramCommand(program)])
    yield shown
    shown.close()


@pytest.mark.slow
def test_a_hostile_name_is_a_text_in_every_panel(visitor: Visitor) -> None:
    desk, page = visitor.desk, visitor.page
    desk.say(HOSTILE)
    for tab in INSIDE:
        visitor.tab(tab)
        assert not visitor.answer(MARKUP), tab
    visitor.told(HOSTILE)
    visitor.tab("programs")
    expect(visitor.at("programs")).to_contain_text(f"{HOSTILE}.py on robot 1: ended")
    expect(visitor.at("start-again")).to_have_attribute("aria-label", f"Start again: {HOSTILE}.py")
    expect(visitor.at("output")).to_contain_text(HOSTILE)
    visitor.choose("script", f"{FILE}.py")
    visitor.tab("arena")
    visitor.choose("open-name", f"{FILE}.kiks")
    visitor.click("open", told=f"Opened {HOSTILE}")
    page.get_by_test_id("follow").click()
    expect(page.locator(".q-menu")).to_contain_text(HOSTILE)
    page.keyboard.press("Escape")
    visitor.answer("(name) => import('kiks-desk').then(({ pageFeed }) => pageFeed().send({ kind: name }))", HOSTILE)
    expect(visitor.at("arena-notice")).to_contain_text("nasty=1")
    assert not visitor.answer(MARKUP)


def test_no_text_is_read_that_may_come_from_outside() -> None:
    found = []
    for path in (Path(__file__).parents[2] / "src" / "kiks" / "desk").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in READERS:
                found.append(path.name)
                # A name stands for a text of the program itself.
                made = [each for each in node.args if not isinstance(each, ast.Constant | ast.Name)]
                assert not made, f"{path}, line {node.lineno}: {node.func.attr} reads a text that is put together"
    assert found

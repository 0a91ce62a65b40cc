"""Programs that the desk opens, saves and checks."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kiks.desk.server.scripts import (
    EXAMPLES,
    ProgramFolder,
    encode_script,
    find_mistake,
    offered,
    read_script,
    split_arguments,
)
from kiks.errors import ParameterError
from kiks.model.limits import PROGRAM_BYTES_MAX
from kiks.model.shipped import demonstrations


def test_own_programs_and_examples_are_offered(tmp_path: Path) -> None:
    for name in ("b.py", "a.py", ".hidden.py", "text.txt"):
        (tmp_path / name).write_text("")
    (tmp_path / "folder.py").mkdir()
    (tmp_path / "folder.py" / "below.py").write_text("")
    labels = [*offered(ProgramFolder(tmp_path)).values()]
    assert labels[:3] == ["a.py", "b.py", "example: avoid"]
    examples = sum(path.parent.name == "demos" for path in demonstrations().values())
    assert len(labels) == 2 + examples
    assert len(offered(ProgramFolder(tmp_path / "nowhere"))) == examples


def test_programs_are_saved_in_the_folder_alone_and_read_again(tmp_path: Path) -> None:
    folder = ProgramFolder(tmp_path)
    assert folder.save(encode_script("print('grün')\n"), " mine ", "a program") == "mine.py"
    assert read_script(tmp_path / "mine.py") == "print('grün')\n"
    assert folder.full_name("text.txt") == "text.txt.py"
    with pytest.raises(ParameterError, match="less deep"):
        folder.save(b"pass", "a/b.py", "a program")


def test_links_do_not_leave_the_folder(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    (tmp_path / "secret.py").write_text("secret")
    (folder / "link.py").symlink_to(tmp_path / "secret.py")
    with pytest.raises(ParameterError, match="leads elsewhere"):
        read_script(folder / "link.py")


def test_unreadable_programs_are_refused(tmp_path: Path) -> None:
    (tmp_path / "long.py").write_bytes(b"#" * (PROGRAM_BYTES_MAX + 1))
    (tmp_path / "odd.py").write_bytes(b"\xff\xfe")
    for name, message in (("long.py", "at most 200000 bytes"), ("odd.py", "readable"), ("none.py", "readable")):
        with pytest.raises(ParameterError, match=message):
            read_script(tmp_path / name)
    with pytest.raises(ParameterError, match=r"at most 200000 bytes"):
        encode_script("#" * (PROGRAM_BYTES_MAX + 1))


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("x = (1,\n", 1),
        ("pass\nif x\n    pass\n", 2),
        ("def f():\nreturn 1\n", 2),
        ("pass\n\nreturn 1\n", 3),
        ("x = '\n", 1),
        ("a = 1\n\tb = 2\n", 2),
        ("x = 1\0", 1),
        ("(" * 10000, 1),
    ],
)
def test_syntax_errors_have_their_line(text: str, line: int) -> None:
    mistake = find_mistake(text)
    assert mistake is not None
    assert mistake.line == line
    assert str(mistake).startswith(f"Line {line}: ")


def test_a_syntax_error_has_its_place_in_the_line() -> None:
    text = "# größer 🤖\nif größe = 2:\n    pass\n"
    mistake = find_mistake(text)
    assert mistake is not None
    assert text[mistake.begin : mistake.end] == "größe = 2"


@given(st.text(max_size=200))
def test_any_text_is_a_program_or_has_a_mistake(text: str) -> None:
    mistake = find_mistake(text)
    if mistake is not None:
        assert 0 <= mistake.begin <= mistake.end <= len(text)
        assert 1 <= mistake.line <= text.count("\n") + 1


def test_good_programs_have_no_mistake() -> None:
    for script in EXAMPLES.glob("[!_]*.py"):
        assert not find_mistake(read_script(script))


def test_arguments_are_words() -> None:
    assert split_arguments("""1 "two words" -x 'it'""") == ["1", "two words", "-x", "it"]
    with pytest.raises(ParameterError, match=r"no closing quotation. Close the quotes"):
        split_arguments("'it")

"""Programs that the desk opens, saves and checks."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kiks.desk.server.scripts import (
    Script,
    find_mistake,
    offered,
    path_of,
    read_script,
    save_script,
    split_arguments,
)
from kiks.errors import ParameterError
from kiks.model.limits import PROGRAM_BYTES_MAX
from kiks.model.shipped import demonstrations

EXAMPLE = Script("avoid.py", is_example=True)


def test_own_programs_and_examples_are_offered(tmp_path: Path) -> None:
    for name in ("b.py", "a.py", ".hidden.py", "text.txt"):
        (tmp_path / name).write_text("")
    (tmp_path / "folder.py").mkdir()
    labels = [script.label for script in offered(tmp_path)]
    assert labels[:3] == ["a.py", "b.py", "example: avoid"]
    examples = len(demonstrations()) - 1  # all but soccer, whose program lies elsewhere
    assert len(labels) == 2 + examples
    assert len(offered(tmp_path / "nowhere")) == examples


def test_saved_programs_are_read_again(tmp_path: Path) -> None:
    saved = save_script(tmp_path, " mine ", "print('grün')\n")
    assert saved == Script("mine.py", is_example=False)
    assert read_script(tmp_path, saved) == "print('grün')\n"
    assert save_script(tmp_path, "mine.py", "pass\n", may_replace=saved) == saved
    assert path_of(tmp_path, saved).read_text() == "pass\n"
    with pytest.raises(ParameterError, match=r"must have a name that is free, but there is a 'mine.py' already"):
        save_script(tmp_path, "mine.py", "1\n")
    with pytest.raises(ParameterError, match=r"must have a name that is free"):
        save_script(tmp_path, "mine.py", "1\n", may_replace=EXAMPLE)


def test_the_second_of_two_editors_is_told_that_a_program_has_changed(tmp_path: Path) -> None:
    mine = save_script(tmp_path, "mine.py", "1\n")
    save_script(tmp_path, "mine.py", "2\n", may_replace=mine, known="1\n")
    with pytest.raises(ParameterError, match=r"'mine.py' has changed meanwhile, in another editor"):
        save_script(tmp_path, "mine.py", "3\n", may_replace=mine, known="1\n")
    assert read_script(tmp_path, mine) == "2\n"
    path_of(tmp_path, mine).unlink()
    save_script(tmp_path, "mine.py", "3\n", may_replace=mine, known="1\n")


@pytest.mark.parametrize("name", ["../a.py", "/etc/a.py", "a/b.py", ".a.py", "", "a\\b.py", "con.py", "a\0.py"])
def test_names_do_not_leave_the_folder(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    with pytest.raises(ParameterError):
        save_script(folder, name, "pass\n")
    assert not list(folder.iterdir())
    assert list(tmp_path.iterdir()) == [folder]


def test_links_do_not_leave_the_folder(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    (tmp_path / "secret.py").write_text("secret")
    (folder / "link.py").symlink_to(tmp_path / "secret.py")
    link = Script("link.py", is_example=False)
    with pytest.raises(ParameterError, match="leads elsewhere"):
        read_script(folder, link)
    with pytest.raises(ParameterError, match="leads elsewhere"):
        save_script(folder, "link.py", "x", may_replace=link)
    assert (tmp_path / "secret.py").read_text() == "secret"


def test_unreadable_programs_are_refused(tmp_path: Path) -> None:
    (tmp_path / "long.py").write_bytes(b"#" * (PROGRAM_BYTES_MAX + 1))
    (tmp_path / "odd.py").write_bytes(b"\xff\xfe")
    for name, message in (("long.py", "at most 200000 bytes"), ("odd.py", "readable"), ("none.py", "readable")):
        with pytest.raises(ParameterError, match=message):
            read_script(tmp_path, Script(name, is_example=False))
    with pytest.raises(ParameterError, match=r"at most 200000 bytes"):
        save_script(tmp_path, "long2.py", "#" * (PROGRAM_BYTES_MAX + 1))


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


@given(st.text(max_size=200))
def test_any_text_is_a_program_or_has_a_mistake(text: str) -> None:
    find_mistake(text)


def test_good_programs_have_no_mistake() -> None:
    for script in offered(Path("/nowhere")):
        assert find_mistake(read_script(Path("/nowhere"), script)) is None


def test_arguments_are_words() -> None:
    assert split_arguments("""1 "two words" -x 'it'""") == ["1", "two words", "-x", "it"]
    with pytest.raises(ParameterError, match=r"no closing quotation. Close the quotes"):
        split_arguments("'it")

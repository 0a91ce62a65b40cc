"""What the pages on debugging say of editors, done by a client of the protocol."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from tests.debugging.dap_client import Editor, Stop, connect, free_port
from tests.documents import ROOT, blocks

pytestmark = pytest.mark.slow

TUTORIAL, GUIDE = (ROOT / "docs" / folder / "debugging.md" for folder in ("tutorials", "howto"))


def save_program(folder: Path) -> Path:
    """Save the program of the tutorial, and return its file."""
    program = folder / "drive.py"
    program.write_text(next(each.code for each in blocks(TUTORIAL) if each.language == "python"), encoding="utf-8")
    return program


def test_the_tutorial_finds_the_mistake_in_an_editor(tmp_path: Path) -> None:
    program, port = save_program(tmp_path), free_port()
    seen: list[tuple[str, int]] = []

    def act(stop: Stop) -> str:
        seen.append((stop.reason, stop.line))
        if len(seen) == 1:
            stop.evaluate("when contacts == 1", "repl")
            return ""
        if len(seen) == 2:
            assert stop.local["readings"] == "[1023, 1022, 8, 0, 8, 6, 7, 5]"
            assert (stop.local["left"], stop.local["right"]) == ("8", "8")
        return {2: "stepBack", 3: "stepBack", 4: "stepIn"}.get(len(seen), "continue")

    editor = Editor({program: [29]}, act)
    command = [sys.executable, "-m", "kiks", "run", "--debug", str(port), str(program)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as run:
        editor.attach_to(port)
        output = run.communicate(timeout=60)[0]
    assert seen == [("breakpoint", 29), ("goto", 28), ("goto", 27), ("goto", 26), ("step", 17), ("breakpoint", 29)]
    # The run is that without a debugger.
    shown = next(each.code for each in blocks(TUTORIAL) if each.language == "text")
    assert shown in output


def test_f5_starts_the_task_of_the_guide_and_attaches(tmp_path: Path) -> None:
    program, port = save_program(tmp_path), free_port()
    launch, tasks = (json.loads(each.code) for each in blocks(GUIDE) if each.language == "json")
    settings = launch["configurations"][0]
    task = next(each for each in tasks["tasks"] if each["label"] == settings["preLaunchTask"])
    given = {"${command:python.interpreterPath}": sys.executable, "${file}": str(program)}
    words = [given.get(word, word) for word in (task["command"], *task["args"])]
    assert words[-2:] == ["--debug", str(program)]
    settings["connect"]["port"] = port  # another test may have the port of the guide
    words.insert(-1, str(port))
    matcher = task["problemMatcher"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as run:
        assert run.stdout is not None
        while not re.search(matcher["background"]["endsPattern"], line := run.stdout.readline()):
            assert line
            assert not re.search(matcher["pattern"]["regexp"], line)
        editor = Editor({program: [29]})
        editor.begin(connect(**settings["connect"]), "attach", settings)
        editor.wait()
        run.communicate(timeout=60)
    assert [each.line for each in editor.stops] == [29]
    assert run.returncode == 0


def test_f5_launches_the_module_of_the_guide(tmp_path: Path) -> None:
    pytest.importorskip("debugpy")
    program = save_program(tmp_path)
    launch = next(json.loads(each.code) for each in blocks(GUIDE) if each.language == "json")
    settings = launch["configurations"][1]
    words = [str(program) if word == "${file}" else word for word in settings["args"]]
    editor = Editor({program: [29]})
    editor.launch(settings["module"], *words, cwd=tmp_path)
    assert [each.line for each in editor.stops] == [29]
    assert "6 contacts" in editor.output

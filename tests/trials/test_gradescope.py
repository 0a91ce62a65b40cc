"""The recipe for Gradescope (docs/howto/grading.md) in a tree like that of its container, with two users."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.documents import ROOT, blocks
from tests.guard import GUARD_S
from tests.namespaces import needs_sandbox

from kiks.model.arena import Arena
from kiks.model.exercise import Cases
from kiks.model.goal import Goal
from kiks.model.project import Project

CHEAT = """
import glob, os, subprocess, time

def look(shell):
    return subprocess.run(["sh", "-c", shell], capture_output=True, text=True).stdout

print("SOURCE", look("cat /autograder/source/*; ls /autograder/source /autograder/results"))
print("GRADES", look("cat /autograder/grades/*.jsonl; ls /autograder/grades; cat /proc/*/environ | tr '\\\\0' ' '"))
forge = "while true; do echo '{\\"score\\": 10}' > /autograder/results/results.json; sleep 0.1; done"
subprocess.Popen(["setsid", "sh", "-c", forge], start_new_session=True, stderr=subprocess.DEVNULL)
time.sleep(1)
"""

needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root can run programs as another user")


def recipe() -> str:
    """Return the script that the page shows."""
    (found,) = (each.code for each in blocks(ROOT / "docs/howto/grading.md") if "--user student" in each.code)
    return found


def in_container(tree: Path, script: str) -> subprocess.CompletedProcess[str]:
    """Run a script as root in a tree in which /autograder and the user `student` are."""
    passwd = tree.parent / "passwd"
    passwd.write_text("root:x:0:0::/root:/bin/sh\nstudent:x:4711:4711::/tmp:/bin/sh\n")
    home, commands = Path.home(), Path(sys.executable).parent
    words = ["bwrap", "--bind", "/", "/", "--tmpfs", "/tmp", "--tmpfs", str(home), "--tmpfs", "/mnt"]
    for path in (Path(sys.base_prefix), home / ".cache", ROOT):
        for each in [*reversed(path.parents)][1:]:
            words += ["--dir", str(each)]  # which others can pass
        words += ["--bind", str(path), str(path)] if path.exists() else []
    words += ["--bind", str(tree), "/mnt", "--ro-bind", str(passwd), "/etc/passwd", "--dev", "/dev", "--proc", "/proc"]
    words += ["--unshare-pid", "--cap-add", "ALL", "--chdir", "/"]
    words += ["--setenv", "PATH", f"{commands}:{os.environ['PATH']}"]
    # On the real computer there is no folder /autograder, and none is made.
    script = script.replace("/autograder", "/mnt")
    return subprocess.run([*words, "sh", "-c", script], capture_output=True, text=True, timeout=4 * GUARD_S)


@needs_root
@needs_sandbox
@pytest.mark.slow
@pytest.mark.parametrize("is_hidden", [True, False])
def test_a_program_finds_neither_the_exercise_nor_the_results(tmp_path: Path, is_hidden: bool) -> None:
    tree = tmp_path / "autograder"
    for name in ("source", "submission", "results"):
        (tree / name).mkdir(parents=True)
        (tree / name).chmod(0o755)
    tree.chmod(0o755)
    goal = Goal("Drive 10 cm", solved="path_mm > 100", points="7 if is_solved else 3")
    cases = (Cases("seen", seed=(1,)), Cases("secret", seed=(3,), is_hidden=is_hidden))
    Project(Arena.box(900, 900), seconds=4.0, goal=goal, cases=cases).save(tree / "source" / "lamp.kiks")
    (tree / "submission" / "ann.py").write_text(CHEAT.replace("/autograder", "/mnt"))

    readable = in_container(tree, recipe().replace("chmod", ": chmod"))
    assert "must be out of reach of the user student" in readable.stderr, readable.stderr
    done = in_container(tree, f"{recipe()}\nls -ln /proc | grep -c ' 4711 '")
    assert done.stdout.splitlines()[-1] == "0", done.stdout + done.stderr  # it has left no process
    results = json.loads((tree / "results" / "results.json").read_text())
    assert results["score"] == 3
    said = "\n".join(each["output"] for each in results["tests"] if each["visibility"] == "visible")
    assert ("SOURCE" in said) is not is_hidden
    assert "secret" not in said
    assert "[[case]]" not in said
    assert "is_solved" not in said

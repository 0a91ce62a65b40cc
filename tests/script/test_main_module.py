"""A program sees the same names and paths under `kiks run` as under Python."""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from tests import forked
from tests.served import called

PROGRAM = """
import dataclasses, inspect, multiprocessing, os, pickle, runpy, sys, typing
import __main__

@dataclasses.dataclass
class Pose:
    x: "int"
    after: "Pose | None" = None

def report():
    print(sys.argv, sys.path[0], os.getcwd())
    print(__name__, __package__, __file__, globals().get('__cached__'), __spec__ and (__spec__.name, __spec__.origin))
    print(type(__loader__), sorted(globals()), __builtins__ is sys.modules["builtins"])
    print(__main__ is sys.modules["__main__"], vars(__main__) is globals(), Pose.__module__)
    print(report.__code__.co_filename)
    print(pickle.dumps(Pose(1, Pose(2))), pickle.loads(pickle.dumps(Pose(3))))
    print(typing.get_type_hints(Pose), inspect.getsource(Pose), multiprocessing.current_process().name)
    if os.path.exists(__file__):
        print(len(open(__file__).read()))

if __name__ == "__main__":
    report()
"""

RELATIVE = "from .helper import fail\nfrom . import helper\nprint(__package__, helper.__name__)\nfail()\n"

WAYS = [
    ["show.py", "1", "--seed", "-m", "x"],
    ["link.py"],
    ["sub/../show.py"],
    ["folder", "--arena"],
    ["archive.zip", "1"],
    ["-m", "show", "-m", "other"],
    ["-m", "package", "--seed", "2"],
    ["-m", "space.inner.show"],
    ["-m", "space.inner"],
]


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    home = tmp_path_factory.mktemp("home")
    texts = {
        "show.py": PROGRAM,
        "sub/real.py": PROGRAM,
        "folder/__main__.py": PROGRAM,
        "package/__init__.py": "print('imported', __name__)\n",
        "package/__main__.py": PROGRAM,
        "package/relative.py": RELATIVE,
        "package/helper.py": "def fail():\n    raise ValueError('on purpose')\n",
        "package/slip.py": "x = (1\n",
        "space/inner/show.py": PROGRAM,  # a namespace package
        "space/inner/__main__.py": PROGRAM,
        "fails.py": "import package.helper as other\n\n\nclass A:\n    def b(self):\n        other.fail()\n\nA().b()\n",
        "slip.py": "print(1)\nx = (1\n",
    }
    for name, text in texts.items():
        (home / name).parent.mkdir(parents=True, exist_ok=True)
        (home / name).write_text(text)
    (home / "link.py").symlink_to("sub/real.py")
    with zipfile.ZipFile(home / "archive.zip", "w") as archive:
        archive.writestr("__main__.py", PROGRAM)
    return home


def run(home: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return called(sys.executable, *words, cwd=home, env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"})


def run_kiks(home: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return forked.run("run", "--seed", "3", *words, cwd=home)


@pytest.mark.slow
@pytest.mark.parametrize("words", WAYS, ids=" ".join)
def test_a_program_starts_as_under_python(home: Path, words: list[str]) -> None:
    python, kiks = run(home, *words), run_kiks(home, *words)
    assert python.returncode == kiks.returncode == 0, kiks.stderr
    assert kiks.stdout == python.stdout
    assert "seed 3" in kiks.stderr


@pytest.mark.slow
def test_programs_that_share_a_world_start_as_under_python(home: Path) -> None:
    kiks = run(home, "-m", "kiks", "run", "-m package 1", "show.py", "-m", "x", "-m space.inner 'a b'")
    assert kiks.returncode == 0, kiks.stderr
    alone = [["-m", "package", "1"], ["show.py", "-m", "x"], ["-m", "space.inner", "a b"]]
    labels = ["1 package     | ", "2 show.py     | ", "3 space.inner | "]
    for words, label in zip(alone, labels, strict=True):
        lines = [line.removeprefix(label) for line in kiks.stdout.splitlines() if line.startswith(label)]
        assert lines == run(home, *words).stdout.splitlines()


@pytest.mark.slow
def test_an_error_has_the_trace_that_python_prints(home: Path) -> None:
    for words in (["fails.py"], ["slip.py"], ["-m", "package.relative"], ["-m", "package.slip"]):
        python, kiks = run(home, *words), run_kiks(home, *words)
        assert python.returncode == kiks.returncode == 1
        assert kiks.stdout == python.stdout
        trace = re.sub('(?m)^  File "<frozen runpy>".*\n', "", python.stderr)
        assert re.sub("(?m)^kiks: .*\n", "", kiks.stderr) == trace


def test_a_module_that_does_not_start_is_one_line(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from kiks.cli.options import parse_words
    from kiks.errors import ParameterError

    monkeypatch.chdir(home)
    for module, message in (
        ("nothing", "there is no 'nothing'. Give its name without .py"),
        ("package.nothing", "there is no 'package.nothing'"),
        ("show.py", "there is no 'show.py'"),
        ("sub", "must have a file __main__.py, but 'sub' has none"),
    ):
        with pytest.raises(ParameterError, match=re.escape(message)):
            parse_words(["-m", module])
        assert "package" not in sys.modules


@pytest.mark.slow
def test_an_open_file_in_a_cycle_with_its_functions_loses_nothing(home: Path) -> None:
    """Python clears the globals before it looks for garbage, and so the file is flushed before it is closed."""
    (home / "open.py").write_text("import sys\nf = open(sys.argv[1], 'w')\nf.write('all')\ndef file(): return f\n")
    for words in (["open.py", "alone.txt"], ["open.py shared.txt", "open.py other.txt"]):
        kiks = run_kiks(home, *words)
        assert kiks.returncode == 0, kiks.stderr
    assert [(home / f"{name}.txt").read_text() for name in ("alone", "shared", "other")] == ["all"] * 3

"""What is wrong with the words of a command, and its help, are told before anything is compiled."""

import subprocess
import sys
from pathlib import Path

from kiks.cli import app

WALK = """
import sys
from pathlib import Path
from typer import BadParameter
from kiks.cli import app
from kiks.engine.code_cache import CodeCache
from kiks.errors import KiksError

class LoadedError(BaseException):
    pass

def load(cache, *given, ready=CodeCache.load_overload):
    # Tasks ask how far places are from walls, and that is compiled in a second.
    if cache._name.endswith(".fill_distances"):
        return ready(cache, *given)
    raise LoadedError

# Nothing was loaded so far, and whatever a command needs of the engine comes by here.
CodeCache.load_overload = load
Path("program.py").touch()
for line in sys.stdin.read().splitlines():
    try:
        app(line.split(), standalone_mode=False)
        if "--help" not in line:
            print("no error:", line)
    except (KiksError, BadParameter, BadParameter.__base__):
        pass
    except LoadedError:
        print("it was compiled:", line)
try:
    app(["demo", "follow", "--seconds", "1"], standalone_mode=False)
except LoadedError:
    print("the walk finds out")
"""

WORLDS = "--arena none.toml|--robot none|--thinking none:5"
WRONG = {
    "run": "none.py|none.kiks|-m none --arena none.toml|--nothing program.py|--robot none.toml program.py|"
    "--turret none program.py|--map a=9 program.py|--thinking replay:none program.py|--seconds -1 program.py|"
    f"--when-silent no program.py program.py|{WORLDS.replace('|', ' program.py|')} program.py",
    "demo": "none|follow --arena none.toml|follow --robot none",
    "desk": f"none.py|none.kiks|--folder none|{WORLDS}",
    "serve": f"--when-silent no --thinking none|{WORLDS}",
    "evolve": "none|none.py|avoid --algorithm none|avoid --controller none",
    "replay": "none.mcap|none.mcap --check",
    "export": "none.mcap out.csv|none.mcap out.none|. out.mp4|none out.png",
    "champion": "none.toml out",
    "compare": "none none2",
    "fit": "none.csv out.toml",
    **dict.fromkeys(("monitor", "calibrate"), "--port none"),
    **dict.fromkeys(("schema", "arena"), "none"),
}
"""Words that are wrong behind a command."""


def test_mistakes_are_told_before_anything_is_compiled(tmp_path: Path) -> None:
    names = [each.name or each.callback.__name__ for each in app.registered_commands if each.callback]
    assert {"run", "demo", "desk", "warmup"} <= set(names)
    lines = [f"{name} {words}" for name, each in WRONG.items() for words in each.split("|")]
    lines += [f"{name} {word}" for name in names for word in ("--nothing", "--help")]
    words = [sys.executable, "-c", WALK]
    done = subprocess.run(words, input="\n".join(lines), cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    told = [line for line in done.stdout.splitlines() if line.startswith(("no error:", "it was compiled:", "the walk"))]
    assert told == ["the walk finds out"]

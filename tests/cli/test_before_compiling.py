"""What is wrong with the words of a command, and its help, are told before anything is compiled."""

from __future__ import annotations

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

def load(*_):
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

WRONG = """
run none.py
run none.kiks
run -m none --arena none.toml
run --nothing program.py
run --arena none.toml program.py
run --robot none program.py
run --robot none.toml program.py
run --turret none program.py
run --thinking none:5 program.py
run --thinking replay:none program.py
run --when-silent no program.py program.py
run --map a=9 program.py
run --seconds -1 program.py
demo none
demo follow --arena none.toml
demo follow --robot none
desk none.py
desk none.kiks
desk --arena none.toml
desk --robot none
desk --thinking none:5
desk --folder none
serve --arena none.toml
serve --robot none
serve --thinking none:5
serve --when-silent no --thinking none
evolve none
evolve none.py
evolve avoid --algorithm none
evolve avoid --controller none
champion none.toml out
ghosts none out.png
compare none none2
replay none.mcap
replay none.mcap --check
export none.mcap out.csv
export none.mcap out.none
monitor --port none
calibrate --port none
fit none.csv out.toml
schema none
arena none
"""


def test_mistakes_are_told_before_anything_is_compiled(tmp_path: Path) -> None:
    names = [each.name or each.callback.__name__ for each in app.registered_commands if each.callback]
    assert {"run", "demo", "desk", "warmup"} <= set(names)
    lines = [*WRONG.strip().splitlines(), *(f"{name} {word}" for name in names for word in ("--nothing", "--help"))]
    done = subprocess.run(
        [sys.executable, "-c", WALK],
        input="\n".join(lines),
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    told = [line for line in done.stdout.splitlines() if line.startswith(("no error:", "it was compiled:", "the walk"))]
    assert told == ["the walk finds out"]

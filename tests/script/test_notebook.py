"""Notebooks as programs: their cells run in order, and what is wrong names the cell."""

import json
from pathlib import Path

import pytest
from tests import forked

from kiks.model.program_kinds import program_text

PORT = "import serial\nport = serial.Serial('/dev/ttyUSB0', 9600, timeout=1)"
FALL = "def fall():\n    return {}[1]"
ASK = "port.write(b'B\\n')\nport.readline()"

RUNS = [
    # cells, exit code, what is printed, the end of the errors
    ([PORT, "", ASK, "2 ** 5;", "display('x', None)\nNone"], 0, "b'b,5.02,5.01\\r\\n'\n'x'\n", ""),
    ([f"print('go')\n{FALL}", "x = 1\nfall()"], 1, "go\n", 'lab.ipynb, cell 1", line 3, in fall\n'),
    (["print(1)", "x = (1"], 1, "", "SyntaxError: '(' was never closed\n"),
    ([PORT, "port.write()\n"], 1, "", 'cell 2", line 1, in <module>\n'),
    ([f"from threading import Thread\n{FALL}", "Thread(target=fall).start()"], 0, "", 'cell 1", line 3, in fall\n'),
    (["print(1)", "%matplotlib inline\nx = 1"], 0, "1\n", "cell 2, line 1 is left out: '%matplotlib inline'"),
    (["%%time\nif True:\n  !pip install x\n  print(1)", "%run y.py"], 1, "", "cell 2, line 1 must be Python, but"),
    (["y = 2\nx = !ls 'unclosed"], 1, "", 'cell 1, line 2 must be Python, but it is "x = !ls \'unclosed"'),
    (["%%bash\nls"], 1, "", "kiks: lab.ipynb, cell 1, line 1 must be Python, but it is '%%bash'"),
    (["print?"], 1, "", "kiks: lab.ipynb, cell 1, line 1 must be Python, but it is 'print?'"),
    (["x = 7 \\\n%4\nx"], 0, "3\n", ""),
]

FILES = [
    ("{", "must be a notebook of Jupyter, but it cannot be read as one. Save it again in Jupyter."),
    ("[]", "must be a notebook of Jupyter"),
    ('{"nbformat": 4, "cells": [{"cell_type": "code"}]}', "must be a notebook of Jupyter"),
    ('{"nbformat": 3, "worksheets": []}', "must be a notebook of format 4 or newer, but it has format 3"),
    ('{"nbformat": 4, "metadata": {"language_info": {"name": "R"}}, "cells": []}', "but it is one of 'R'"),
]


def notebook(*cells: str) -> str:
    made = [{"cell_type": "code", "source": cell.splitlines(keepends=True), "outputs": []} for cell in cells]
    made.insert(0, {"cell_type": "markdown", "source": "# Lab 1\n%ls"})
    return json.dumps({"nbformat": 4, "nbformat_minor": 5, "metadata": {}, "cells": made})


@pytest.mark.parametrize(("cells", "code", "printed", "error"), RUNS)
def test_cells_run_in_order_and_errors_name_them(
    tmp_path: Path, cells: list[str], code: int, printed: str, error: str
) -> None:
    (tmp_path / "lab.ipynb").write_text(notebook(*cells))
    done = forked.run("run", "lab.ipynb", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (code, printed), done.stderr
    assert error in done.stderr
    assert "site-packages" not in done.stderr
    assert "ast.py" not in done.stderr


@pytest.mark.parametrize(("text", "message"), FILES)
def test_what_is_no_notebook_of_python_is_one_line(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "lab.ipynb").write_text(text)
    done = forked.run("run", "lab.ipynb", cwd=tmp_path)
    first, *_ = done.stderr.splitlines()
    assert first.startswith(f"kiks: lab.ipynb {message}") or (
        first.startswith("kiks: lab.ipynb must") and message in first
    )
    assert (done.returncode, done.stdout) == (1, "")


def test_a_notebook_runs_as_the_program_of_its_cells_does(tmp_path: Path) -> None:
    """The same bytes on the wire, beside another program and with a recording that shows its code."""
    cells = [PORT, "for speed in range(3):\n    port.write(b'D,%d,5\\n' % speed)\n    line = port.readline()"]
    (tmp_path / "lab.ipynb").write_text(notebook(*cells))
    (tmp_path / "lab.py").write_text("\n".join(cells))
    alone = [forked.run("run", name, cwd=tmp_path).stderr for name in ("lab.py", "lab.ipynb")]
    assert alone[0] == alone[1]
    both = [forked.run("run", "lab.py", name, cwd=tmp_path) for name in ("lab.py", "lab.ipynb")]
    assert [each.returncode for each in both] == [0, 0]
    states = [each.stderr.split("state ")[1].split()[0] for each in both]
    assert states[0] == states[1]
    text = program_text(tmp_path / "lab.ipynb", (tmp_path / "lab.ipynb").read_bytes())
    assert text == f"# cell 1\n{cells[0]}\n\n# cell 2\n{cells[1]}"

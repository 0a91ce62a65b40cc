"""The package for Octave that `make octave-package` builds is installed in a new home, and programs run from there."""

import re
import sys
from pathlib import Path

from tests.at_length import at_length
from tests.matlab.octave import DEMOS, TOOLBOX, needs_octave, run
from tools.octave_package import build, contents

from kiks.engine.code_cache import cache_folders

PROGRAM = """
rmpath('{toolbox}')
say('before', exist('kiks', 'file'))
pkg('prefix', '{home}/packages', '{home}/packages');
pkg('local_list', '{home}/list');
pkg('global_list', '{home}/global_list');
pkg('install', '-local', '{package}');
pkg('load', 'kiks');
say('where', fileparts(which('kiks')))
say('demo', which('follow'))
say('help', evalc('help kProximity'))
say('described', evalc('pkg describe -verbose kiks'))
kiks; follow(-1, 9600, 5); kiks_quit(1)
setenv('KIKS_COMMAND', '/nowhere/kiks');
say('why', caught(@kiks))
pkg('unload', 'kiks');
say('after', exist('kiks', 'file') + exist('follow', 'file'))
"""


@at_length
@needs_octave
def test_an_installed_package_runs_a_demo_from_any_folder(tmp_path: Path) -> None:
    home = tmp_path / "a home"
    home.mkdir()
    program = PROGRAM.format(toolbox=TOOLBOX, home=home, package=build(tmp_path / "dist"))
    # In the new home, KiKS would compile its engine again.
    compiled = str(next(cache_folders()).parents[1])
    environment = {"HOME": str(home), "NUMBA_CACHE_DIR": compiled, "KIKS_COMMAND": f"{sys.executable} -m kiks"}
    done = run(program, tmp_path, environment)
    said = done.said
    assert said["before"] == said["after"] == 0
    assert said["where"].startswith(str(home))
    assert said["demo"].startswith(said["where"])
    assert "eight readings" in said["help"]
    for path in (*TOOLBOX.glob("*.m"), *DEMOS.glob("*.m")):
        assert re.search(rf"^\s+{path.stem}$", said["described"], re.MULTILINE), path.stem
    assert any(line.startswith("follow: ") for line in done.lines)
    assert re.search(r"/nowhere/kiks did not\. Install KiKS .*, or tell where the command is: setenv", said["why"])


def test_the_package_holds_all_files_of_the_toolbox() -> None:
    inside = {name.removeprefix("inst/") for name in contents() if name.startswith("inst/")}
    assert inside == {path.relative_to(TOOLBOX).as_posix() for path in TOOLBOX.rglob("*.m")}

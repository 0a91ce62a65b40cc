"""Without what only POSIX systems have, all can be imported but what is for them alone, and worlds run."""

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

HIDE = """
import importlib, importlib.abc, os, signal, socket, sys
from pathlib import Path

# Libraries have versions of their own for other systems: here they find what they need.
import asyncio, concurrent.futures.process, multiprocessing, subprocess
import gymnasium, matplotlib.pyplot, nicegui, numba, pettingzoo, PIL.Image, rich.console, scipy, serial, typer, uvicorn

MODULES = {"fcntl", "grp", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty"}

class Hidden(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name in MODULES:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

for name in MODULES & sys.modules.keys():
    del sys.modules[name]
sys.meta_path.insert(0, Hidden())
WINDOWS = {"SIGABRT", "SIGBREAK", "SIGFPE", "SIGILL", "SIGINT", "SIGSEGV", "SIGTERM", "SIG_DFL", "SIG_IGN"}
for name in dir(signal):
    if name.startswith(("SIG", "ITIMER", "pthread", "setitimer", "sigwait", "alarm")) and name not in WINDOWS:
        delattr(signal, name)
for name in (
    "O_CLOEXEC O_DIRECTORY O_NOCTTY O_NOFOLLOW O_NONBLOCK WNOHANG chown fchmod fork forkpty geteuid getuid killpg "
    "mkfifo openpty register_at_fork sched_getaffinity setsid sysconf wait waitid"
).split():
    delattr(os, name)
for name in ("recv_fds", "send_fds"):
    delattr(socket, name)
import kiks
"""

IMPORT = """
root, own = Path(kiks.__file__).parent, ("kiks.script", "kiks.ports.pty", "kiks.toolbox.session_")
for path in sorted(root.rglob("*.py")):
    name = ".".join(("kiks", *path.relative_to(root).with_suffix("").parts)).removesuffix(".__init__")
    if name != "kiks.__main__" and not name.startswith(own):
        importlib.import_module(name)
"""

RUN = """
sim = kiks.Simulation(kiks.Arena.load("office"), seed=1)
with sim.record("run.mcap"):
    kiks.Khepera(sim.port(1)).set_speed(5, 5)
    sim.run(2.0)
with kiks.Recording("run.mcap") as recording:
    assert recording.world_at(sim.time_s).state_hash() == sim.state_hash()
    recording.export("run.csv")
    recording.export("run.png")
evolution = kiks.Evolution(kiks.tasks.avoid(seconds=2), "ga", seed=1, population=8, folder="avoid")
evolution.run(generations=1).save("champion.toml")
assert kiks.Champion.load("champion.toml").controller.parameter_count
view = sim.show(port=0, browser=False)
view.close()
try:
    import kiks.script
except SystemExit as refusal:
    print(refusal, sim.state_hash())
"""


def test_worlds_run_on_systems_without_posix(tmp_path: Path) -> None:
    command = [sys.executable, "-c", HIDE + IMPORT + RUN]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=400, check=False)
    assert done.returncode == 0, done.stderr
    told = "kiks: a program in simulated time must run on Linux, but this system has no pseudo-terminals."
    assert told in done.stdout

"""Debuggers that people bring along: a program that stops in one does what it does without."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tests.debugging.dap_client import Editor, Stop, free_port

pytest.importorskip("debugpy")
pytestmark = pytest.mark.slow

PORT = 'import serial\nport = serial.Serial("/dev/ttyUSB0", 9600, timeout=1)\n'
TURNS = PORT + (
    "import time\n"
    "start = time.time()\n"
    "for count in range(20):\n"
    '    port.write(b"N\\n")\n'
    "    reply = port.readline()\n"
    'print("took", time.time() - start)\n'
)
THREADS = PORT + (
    "import queue, threading, time\n"
    "lock, jobs = threading.Lock(), queue.Queue()\n"
    "def ask(name):\n"
    "    for number in range(10):\n"
    "        with lock:\n"
    '            port.write(b"N\\n")\n'
    "            reply = port.readline()\n"
    "        jobs.put((name, number))\n"
    "        time.sleep(0.01)\n"
    "def work():\n"
    "    while job := jobs.get():\n"
    "        print(*job, time.time())\n"
    'worker = threading.Thread(target=work, name="worker")\n'
    'asking = [threading.Thread(target=ask, args=(name,), name=name) for name in ("left", "right")]\n'
    "for each in (worker, *asking):\n"
    "    each.start()\n"
    "for each in asking:\n"
    "    each.join()\n"
    "jobs.put(None)\n"
    "worker.join()\n"
)
TASKS = PORT + (
    "import asyncio, time\n"
    "async def ask(name):\n"
    "    for number in range(10):\n"
    "        await asyncio.sleep(0.02)\n"
    '        port.write(b"N\\n")\n'
    "        reply = port.readline()\n"
    "async def main():\n"
    '    await asyncio.gather(ask("a"), ask("b"))\n'
    "    print(time.time())\n"
    "asyncio.run(main())\n"
)
LISTENS = (
    PORT + "import sys, debugpy\n"
    "debugpy.listen(int(sys.argv[1]))\n"
    "debugpy.wait_for_client()\n"
    "for count in range(3):\n"
    '    port.write(b"N\\n")\n'
    "    reply = port.readline()\n"
    "debugpy.breakpoint()\n"
    'print("end")\n'
)
PRINTED = "(?:state|left|right) .*"
"""What is printed that depends on the run."""

PROGRAMS = {"turns": (TURNS, 6), "threads": (THREADS, 8), "tasks": (TASKS, 7)}
"""Programs with a line at which each stops twenty times."""


def plain(folder: Path, *words: str, text: str = "") -> str:
    """Return what a run prints without an editor."""
    done = subprocess.run(
        [sys.executable, "-m", "kiks", "run", *words],
        cwd=folder,
        input=text,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=60,
        check=True,
    )
    return done.stdout


def stay(stop: Stop) -> str:
    """Look at the first stop for a while, and let the program go on."""
    until_s = time.monotonic() + (1.0 if stop.local.get("count") == "0" else 0.0)
    while time.monotonic() < until_s:
        assert stop.evaluate("count") == "0"
    return "continue"


def lines(output: str) -> list[str]:
    """Return the lines of an output in an order of their own, as programs print at once.

    Those of debugpy, and of a computer on which programs start slowly, are left out.
    """
    others = re.compile("ebugger|^0.00s|the world begins when|^$")
    return sorted(line for line in output.splitlines() if not others.search(line))


@pytest.mark.parametrize("sub_process", [True, False])
@pytest.mark.parametrize("way", ["launch", "attach"])
@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_that_stops_twenty_times_does_what_it_does_without_an_editor(
    tmp_path: Path, name: str, way: str, sub_process: bool
) -> None:
    text, line = PROGRAMS[name]
    program = tmp_path / "program.py"
    program.write_text(text)
    editor = Editor({program: [line]})
    words = "--seed", "3", "program.py"
    getattr(editor, way)("kiks", "run", *words, cwd=tmp_path, sub_process=sub_process)
    assert len(editor.stops) == 20
    assert lines(editor.output) == lines(plain(tmp_path, *words))


def test_a_stop_in_one_of_two_programs_lets_the_other_wait(tmp_path: Path) -> None:
    for name in ("one.py", "two.py"):
        (tmp_path / name).write_text(TURNS)
    editor = Editor({tmp_path / "one.py": [6]}, stay)
    # The first stop would be silence beside this patience.
    words = "--seed", "3", "--patience", "0.5", "one.py", "two.py"
    editor.launch("kiks", "run", *words, cwd=tmp_path)
    assert len(editor.stops) == 20
    output = plain(tmp_path, "--seed", "3", "one.py", "two.py")
    state = re.search("state .*", output)
    assert state is not None
    assert state[0] in editor.output
    assert "not repeatable" not in editor.output


def test_live_thinking_leaves_stops_out(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(TURNS)
    editor = Editor({program: [6]}, lambda stop: (stop.frames, "continue")[1])
    editor.launch("kiks", "run", "--thinking", "live", "program.py", cwd=tmp_path)
    took = re.search(r"took (\S+)", editor.output)
    # Twenty exchanges take 0.5 s, and twenty stops some seconds.
    assert took is not None
    assert float(took[1]) < 1


def test_steps_stay_in_their_thread(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(THREADS)

    def act(stop: Stop) -> str:
        return "next" if stop.reason == "breakpoint" else "continue"

    editor = Editor({program: [8]}, act)
    editor.launch("kiks", "run", "--seed", "3", "program.py", cwd=tmp_path, sub_process=False)
    stopped = [(each.thread, each.reason) for each in editor.stops]
    begun, stepped = stopped[::2], stopped[1::2]
    assert len(stopped) == 40
    assert [thread for thread, _ in begun] == [thread for thread, _ in stepped]
    assert {reason for _, reason in stepped} == {"step"}
    assert lines(editor.output) == lines(plain(tmp_path, "--seed", "3", "program.py"))


def test_an_expression_sees_simulated_time_for_free_and_one_that_waits_lets_others_go_on(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(THREADS)
    seen = []

    def act(stop: Stop) -> str:
        if len(seen) == 0:
            seen.extend(stop.evaluate("time.time()") for _ in range(5))
        elif len(seen) == 5:
            seen.append(stop.evaluate("(time.sleep(0.5), time.time())[1]", "repl"))
            seen.append(stop.evaluate("lock.acquire(timeout=0.5)", "repl"))
            seen.append(stop.evaluate('(port.write(b"B\\n"), port.readline())[1]', "repl"))
        return "continue"

    editor = Editor({program: [11]}, act)
    editor.launch("kiks", "run", "--seed", "3", "program.py", cwd=tmp_path, sub_process=False)
    assert len({*seen[:5]}) == 1
    assert float(seen[5]) > float(seen[0]) + 0.5
    assert seen[7].startswith("b'b,")


@pytest.mark.parametrize("is_shared", [False, True])
def test_a_person_sees_the_robot_at_a_stop_without_an_effect_on_the_run(tmp_path: Path, is_shared: bool) -> None:
    program = tmp_path / "program.py"
    program.write_text(TURNS.replace('b"N', 'b"E'))
    (tmp_path / "other.py").write_text(TURNS)
    seen = []

    def act(stop: Stop) -> str:
        if len(seen) < 4:
            seen.extend(stop.evaluate(text) for text in ("kiks.here.time_s", "kiks.here.heading_deg"))
            assert stop.scope("Globals")["kiks.here"].startswith("robot 1 at ")
        return "continue"

    words = "--seed", "3", "program.py", *(["other.py"] if is_shared else [])
    editor = Editor({program: [6]}, act)
    editor.launch("kiks", "run", *words, cwd=tmp_path)
    assert seen[::2] == ["0.0", "0.011312497"]
    assert seen[1::2] == ["90.0", "90.0"]
    state = re.search("state .*", plain(tmp_path, *words))
    assert state is not None
    assert state[0] in editor.output


def test_a_program_may_wait_for_an_editor_by_itself(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(LISTENS)
    port = free_port()
    words = [sys.executable, "-m", "kiks", "run", "--seed", "3", "program.py", str(port)]
    stopped = []
    editor = Editor({program: [7]}, lambda stop: (stopped.append(stop.line), "continue")[1])
    with subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as run:
        editor.attach_to(port)
        output = run.communicate(timeout=60)[0]
    assert stopped == [7, 7, 7, 10]
    assert run.returncode == 0
    assert "end" in output
    assert "state" in output


def test_debugpy_without_a_client_just_runs(tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(TURNS)
    words = ["debugpy", "--listen", f"127.0.0.1:{free_port()}", "-m", "kiks", "run", "--seed", "3", "program.py"]
    done = subprocess.run(
        [sys.executable, "-m", *words],
        cwd=tmp_path,
        env=os.environ | {"PYTHONHASHSEED": "2000"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=60,
        check=True,
    )
    assert lines(done.stdout) == lines(plain(tmp_path, "--seed", "3", "program.py"))


@pytest.mark.parametrize("thinking", ["none", "live"])
def test_pdb_lets_the_world_stand_though_other_threads_could_go_on(tmp_path: Path, thinking: str) -> None:
    (tmp_path / "plain.py").write_text(THREADS)
    (tmp_path / "program.py").write_text(THREADS.replace("        jobs.put", "        breakpoint()\n        jobs.put"))
    words = "--seed", "3", "--thinking", thinking
    output = plain(tmp_path, *words, "program.py", text="p time.time()\nc\n" + "c\n" * 19)
    expected = plain(tmp_path, *words, "plain.py")
    assert output.count("(Pdb)") == 21
    if thinking == "none":
        assert sorted(re.findall(PRINTED, output)) == sorted(re.findall(PRINTED, expected))


def test_faulthandler_tells_where_a_program_is(tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(
        "import faulthandler\n"
        'file = open("trace.txt", "w")\n'
        "faulthandler.dump_traceback_later(0.1, file=file)\n"
        'while "line 4" not in open("trace.txt").read() and "line 5" not in open("trace.txt").read():\n'
        "    sum(range(10_000))\n"
    )
    plain(tmp_path, "program.py")

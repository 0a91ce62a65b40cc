"""Several unchanged programs in one world: `kiks run A.py B.py`."""

import os
import select
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

import pytest
from tests.at_length import cases, share
from tests.busy import busy_computer
from tests.guard import wait_until
from tests.ports.helpers import warnings
from tests.served import GUARD_S, PROGRAMS, fresh

import kiks as package
from kiks.cli.options import parse_words
from kiks.errors import LinkError, ParameterError
from kiks.ports.port_names import PortNames
from kiks.ports.program_command import ProgramCommand
from kiks.ports.program_process import OwnChild
from kiks.ports.programs import Programs
from kiks.script.runner import run_here

# Each test starts processes.
pytestmark = pytest.mark.slow

DRIVE, SLEEPER, WATCHER, WANDER, ANY, INTO_FILE = (
    str(PROGRAMS / f"{name}.py") for name in ("drive", "sleeper", "watcher", "wander", "any_port", "into_file")
)

HANGS = """
import os, serial
port = serial.Serial('COM1', timeout=1)
port.write(b'L,0,1\\n')
os.write(2, port.readline())
while True: pass
"""

ENDS = """
import serial, sys
port = serial.Serial('COM1', timeout=1)
for _ in range(400):
    port.write(b'N\\n')
    assert port.readline().startswith(b'n,')
open(sys.argv[1], 'w').close()
"""


def run(commands: Sequence[Sequence[str]], **options: Any) -> tuple[str, int, int, list[str], str]:
    """Run programs; return state, time, exit code, reports of their ends, and why the run might not be repeatable."""
    sim = fresh(len(commands))
    ends: list[str] = []
    every = [ProgramCommand(Path(program), arguments) for program, *arguments in commands]
    programs = Programs(sim, every, **{"say": ends.append, "patience_s": GUARD_S, **options})
    code = programs.run()
    return sim.state_hash(), sim.now_ns, code, sorted(ends), programs.doubt


def write(folder: Path, name: str, text: str) -> str:
    path = folder / name
    path.write_text(text)
    return str(path)


@contextmanager
def started(*words: str) -> Iterator[tuple[subprocess.Popen[bytes], IO[bytes], IO[bytes]]]:
    """Start the command; yield its process and output, and kill its process group at the end."""
    command = [sys.executable, "-m", "kiks", "run", *words]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, start_new_session=True, **pipes) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        try:
            yield process, process.stdout, process.stderr
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)


# ---- repeatability ----


ALONE = (
    *((WANDER,), (ANY, "0"), (ANY, "1"), (SLEEPER, "8"), (WATCHER, "2"), (DRIVE, "COM1", "9", "3", "5")),
    *((ANY, str(seed)) for seed in range(2, 6)),
)


@pytest.mark.parametrize("thinking", ["none", "fixed:2.5"])
@pytest.mark.parametrize("words", cases([(words,) for words in ALONE], 3), ids=lambda words: Path(" ".join(words)).name)
def test_program_gives_the_same_run_in_its_own_process_and_in_this_one(words, thinking, capfd):
    state, now_ns, code, _, doubt = run([words], thinking=thinking)
    there = capfd.readouterr().out
    sim = fresh(thinking=thinking)
    assert run_here(sim, Path(words[0]), list(words[1:]), {}) == code == 0
    assert capfd.readouterr().out == there
    assert (sim.state_hash(), sim.now_ns) == (state, now_ns)
    assert not doubt


THREADS = """
import queue, serial, threading
one, two, replies = serial.Serial("COM1", timeout=1), serial.Serial("COM2", timeout=1), queue.Queue()
threading.Thread(target=lambda: [replies.put(one.readline()) for _ in range(20)]).start()
for number in range(20):
    one.write(b"D,%d,%d\\n" % (number % 7, -number % 5))
    two.write(b"D,%d,1\\n" % len(replies.get()))
    if number % 2:
        two.read(6)
"""

LOOP = """
import select, serial
port = serial.Serial("COM1", timeout=1)
for number in range(20):
    port.write(b"D,%d,%d\\n" % (number % 7, -number % 5))
    if number % 2:
        select.select([port], [], [])
    port.readline()
"""

UNTHINKING = (
    "import kiks.clock.program_clock as clock\nclock.ProgramClock.enter = lambda *_, **__: 0\n",
    "import kiks.ports.link as link\nlink.Link.think = lambda *_: None\n",
)


def test_world_charges_thinking_and_makes_no_command_wait_that_has_paid(tmp_path: Path) -> None:
    for text, cheats in ((THREADS, ()), (LOOP, UNTHINKING)):
        here = fresh(2, thinking="fixed:40")
        assert run_here(here, Path(write(tmp_path, "here.py", text)), [], {}) == 0
        for number, cheat in enumerate(("", *cheats)):
            there, command = fresh(2), ProgramCommand(Path(write(tmp_path, f"{number}.py", cheat + text)))
            assert Programs(there, [command, None], thinking="fixed:40").run() == 0
            assert (there.state_hash(), there.now_ns) == (here.state_hash(), here.now_ns), cheat
        assert here.now_ns > 20 * 40_000_000


FOUR = ([DRIVE, "COM1", "40", "3", "7"], [DRIVE, "COM1", "25", "-4", "7"], [SLEEPER, "12"], [WATCHER, "1.5"])


def run_and_read(commands: Sequence[Sequence[str]], folder: Path, **options: Any) -> tuple[object, ...]:
    """Run programs; return the end of the run, and the output of each."""
    files = [folder / str(number) for number in range(len(commands))]
    end = run([[INTO_FILE, str(file), *words] for file, words in zip(files, commands, strict=True)], **options)
    return end[:3], end[4], *(file.read_text() for file in files)


@pytest.mark.parametrize("thinking", cases(["none", "fixed:3.5"]))
def test_programs_repeat_on_a_busy_computer(thinking: str, tmp_path: Path) -> None:
    with busy_computer():
        assert len({run_and_read(FOUR, tmp_path, thinking=thinking) for _ in range(share(2, 4))}) == 1


def test_live_thinking_of_each_is_recorded_and_replayed(tmp_path: Path) -> None:
    times = tmp_path / "times"
    live = run(FOUR[:2], thinking="live", record=times)
    assert {path.name for path in tmp_path.iterdir()} == {"times.1", "times.2"}
    assert run(FOUR[:2], thinking=f"replay:{times}")[:2] == live[:2]


# ---- programs that end, crash, hang or flood ----


def program_warnings(caplog: pytest.LogCaptureFixture) -> list[str]:
    """Return the warnings, except those about late programs at the start: a busy computer is slow."""
    return [text for text in warnings(caplog) if not text.startswith("the world begins when")]


def test_end_of_a_program_does_not_affect_others(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for ending, code, how in (
        ("1 / 0", 1, "with exit code 1"),
        ("raise SystemExit(7)", 7, "with exit code 7"),
        ("import os; os._exit(3)", 3, "with exit code 3"),
        ("import os; os.kill(os.getpid(), 9)", 137, "by signal 9"),
    ):
        program = write(tmp_path, "ends.py", f"import serial\nserial.Serial('COM1').write(b'L,0,1\\nH')\n{ending}\n")
        states = set()
        for _ in range(2):
            state, _, found, ends, doubt = run([[program], [DRIVE, "COM1", "20", "3", "3"]])
            assert found == code
            assert ends == [f"program 1 (ends.py) has ended {how}.", "program 2 (drive.py) has ended with exit code 0."]
            assert not doubt
            states.add(state)
            out = capfd.readouterr().out
            assert out.count("\nn,") == 19
        assert len(states) == 1


def test_program_without_a_port_takes_part(tmp_path: Path) -> None:
    silent = write(tmp_path, "silent.py", "print('nothing to do')\n")
    assert run([[silent], [DRIVE, "COM1", "5", "3", "3"]])[2] == 0


def test_hanging_program_is_ignored_and_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    over = tmp_path / "over"
    hangs = write(tmp_path, "hangs.py", HANGS.replace("while True", f"while not os.path.exists({str(over)!r})"))

    def release() -> None:
        try:
            wait_until(lambda: "still runs" in caplog.text)
        finally:
            over.touch()

    releasing = threading.Thread(target=release)
    releasing.start()
    ends = write(tmp_path, "ends.py", ENDS)
    _, _, code, told, doubt = run([[hangs], [ends, str(tmp_path / "end")]], patience_s=0.2)
    releasing.join(GUARD_S)
    assert code == 0
    assert told == [f"program {number} has ended with exit code 0." for number in ("1 (hangs.py)", "2 (ends.py)")]
    assert doubt == "the world did not wait for every program"
    silent, still = program_warnings(caplog)
    assert silent.startswith("program 1 (hangs.py) must act while others wait, but it did nothing for 0.")
    assert still == "program 1 (hangs.py), which the world does not wait for, still runs. Ctrl-C ends it."


def test_hanging_program_is_dropped_and_is_not_called_running_if_it_ends_late(tmp_path, caplog, monkeypatch):
    send, has_ended = OwnChild.signal, threading.Event()

    def send_late(self: OwnChild, number: int) -> None:
        threading.Thread(target=lambda: has_ended.wait(GUARD_S) and send(self, number)).start()

    monkeypatch.setattr(OwnChild, "signal", send_late)
    ends: list[str] = []

    def say(text: str) -> None:
        ends.append(text)
        if "drive.py" in text:
            has_ended.set()

    hangs = write(tmp_path, "hangs.py", HANGS)
    options = {"patience_s": 1, "when_silent": "drop", "say": say}
    _, _, code, _, doubt = run([[hangs], [DRIVE, "COM1", "20", "3", "3"]], **options)
    assert code == 137
    assert ends == ["program 2 (drive.py) has ended with exit code 0.", "program 1 (hangs.py) has ended by signal 9."]
    assert doubt
    assert program_warnings(caplog) == [
        "program 1 (hangs.py) must act within 1 s while others wait, but it did not: it is disconnected. "
        "--patience gives it more time."
    ]


def test_flooding_program_does_not_delay_others(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    over = tmp_path / "over"
    floods = write(
        tmp_path,
        "floods.py",
        f"import os, serial\nport = serial.Serial('COM1')\n"
        f"while not os.path.exists({str(over)!r}): port.write(b'H\\n' * 500)\n",
    )
    _, _, code, ends, _ = run([[floods], [write(tmp_path, "ends.py", ENDS), str(over)]])
    assert code == 0
    assert len(ends) == 2
    assert program_warnings(caplog) == [
        "program 1 (floods.py) must wait for its replies, but it is more than 4096 characters ahead of robot 1; what "
        "it sends now has to wait. Read a line after each command."
    ]


def test_ctrl_c_ends_all_programs(tmp_path: Path) -> None:
    hangs = write(tmp_path, "hangs.py", HANGS)
    tidy = write(
        tmp_path,
        "tidy.py",
        "import serial\nport = serial.Serial('COM1', timeout=1)\ntry:\n    while True:\n        port.write(b'H\\n')\n"
        "        port.readline()\nexcept KeyboardInterrupt:\n    port.write(b'D,0,0\\n')\n"
        "    while port.readline() != b'd\\r\\n': pass\n    print('tidied')\n",
    )
    with started(hangs, tidy) as (process, _, errors):
        while errors.readline() != b"1 hangs.py | l\r\n":
            pass
        os.killpg(process.pid, signal.SIGINT)
        out, told = process.communicate(timeout=GUARD_S)
    assert process.returncode == 130
    assert out == b"2 tidy.py  | tidied\n"
    assert b"not repeatable: it was interrupted" in told
    assert b"Traceback" not in told


def test_ctrl_c_while_a_program_loads_ends_it_without_a_word(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sitecustomize.py").write_text(
        "import signal, sys\nif 'kiks.script.child_main' in sys.orig_argv:\n    signal.raise_signal(signal.SIGINT)\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    prints = write(tmp_path, "prints.py", "print('here')\n")
    with started(prints, prints) as (process, _, _):
        out, told = process.communicate(timeout=GUARD_S)
    assert (process.returncode, out) == (130, b"")
    assert b"has ended with exit code 130" in told
    assert b"Traceback" not in told


def test_no_program_outlives_a_killed_kiks(tmp_path: Path) -> None:
    hangs = write(tmp_path, "hangs.py", "import os\nos.write(1, f'{os.getpid()}\\n'.encode())\n" + HANGS)
    with started(hangs, hangs) as (process, output, _):
        watched = [os.pidfd_open(int(output.readline().partition(b"|")[2])) for _ in range(2)]
        process.kill()
        process.wait(GUARD_S)
        # They get no signal from KiKS: only its end can end them.
        for descriptor in watched:
            assert select.select([descriptor], [], [], GUARD_S)[0]
            os.close(descriptor)


# ---- port names and the command line ----


def test_each_program_has_the_robot_of_its_number() -> None:
    names = PortNames(fresh(4), {"/dev/ttyS9": 3}, 2)
    assert [names.robot("COM1", 2), names.robot("COM1", 1), names.robot("COM2", 2)] == [2, 1, 4]
    assert [names.robot("/dev/ttyS9", 1), names.robot("COM1", 2)] == [3, 2]
    assert PortNames(fresh(2), {"ttyUSB0": 1}).robot("/dev/ttyUSB0") == 1
    with pytest.raises(
        LinkError, match=r"'COM2' is one more than there are robots: '/dev/ttyS9' is robot 3, 'COM1' is robot 1\."
    ):
        names.robot("COM2", 1)
    with pytest.raises(LinkError, match=r"names robot 7 and the simulation has robots 1 to"):
        names.robot("kiks://7")
    with pytest.raises(LinkError, match=r"must be without options"):
        names.robot("kiks://1?seed=3")
    other, world = package.Simulation(), fresh()
    with pytest.raises(LinkError, match=r"must belong to the world that the programs share"):
        PortNames(world, {}).robot(other.url(1))


def test_kiks_urls_mean_the_shared_world(tmp_path: Path) -> None:
    program = write(
        tmp_path,
        "names.py",
        "import kiks, sys\nwith kiks.Khepera(f'kiks://{sys.argv[1]}') as robot:\n"
        "    robot.pause(1)\n    print(robot.time_s >= 1, robot.encoders())\n"
        "try: kiks.kopen([-7])\nexcept kiks.LinkError as error: print(error)\n",
    )
    _, _, *outs = run_and_read([[program, "2"], [program, "1"]], tmp_path)
    for out in outs:
        assert str(out).startswith("True (0, 0)\n")
        assert "names robot 7 and the simulation has robots 1 to 2" in str(out)


def test_command_line_is_split_into_programs(tmp_path: Path) -> None:
    one, two, odd = (write(tmp_path, name, "") for name in ("a.py", "b.py", "my program"))
    for words, programs in (
        ([one, "1", "-x"], {one: ["1", "-x"]}),
        ([one, "1", two, "c.py"], {one: ["1"], two: ["c.py"]}),
        ([f"{one} {two} 'a b'", two], {one: [two, "a b"], two: []}),
        ([odd, "it's", "two words"], {odd: ["it's", "two words"]}),
    ):
        assert parse_words(words) == [ProgramCommand(Path(each), rest) for each, rest in programs.items()]
    with pytest.raises(ParameterError, match=r"PROGRAM must be a file of .*, but there is no file 'c\.py'\. Give"):
        parse_words(["c.py", one])
    with pytest.raises(ParameterError, match=r"PROGRAM must be a file of .*, but '.*' is a folder without a __"):
        parse_words([str(tmp_path), one])

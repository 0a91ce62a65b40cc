"""Whole programs in simulated time: what `kiks run` does with their threads, clocks, signals and files."""

import os
import re
import select
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from tests import forked
from tests.script import seen
from tests.script.conftest import Run, programs_of

from kiks.script import devices, watchdog


@pytest.mark.slow
def test_thread_that_only_polls_yields(run: Run) -> None:
    for loop in (
        "while not done: time.time()",
        "while not done: datetime.datetime.now()",
        "while not done: time.sleep(0)",
        "while not done: port.in_waiting",
        "while not event.is_set(): pass",
        "while not lock.acquire(False): pass",
        "while thread.is_alive(): pass",
        "while lines.empty(): pass",
    ):
        ran = run(f"""
            import datetime, queue, serial, threading, time
            port = serial.Serial('COM1')
            done, event, lock, lines = False, threading.Event(), threading.Lock(), queue.Queue()
            lock.acquire()
            def work():
                global done
                time.sleep(0.5)
                done = True
                event.set()
                lock.release()
                lines.put(1)
            thread = threading.Thread(target=work)
            thread.start()
            {loop}
        """)
        assert ran.code == 0
        assert 0.5 <= ran.time_s < 0.51


def test_threads_that_wait_for_ever_end_with_one_line(run: Run) -> None:
    for text, waiting in (
        ("lock = threading.Lock()\nlock.acquire()\nlock.acquire()", "MainThread for a lock"),
        (
            "port = serial.Serial('COM1')\nthreading.Thread(target=port.readline).start()",
            "Thread-1 (readline) for a robot that was asked nothing",
        ),
        ("here, there = socket.socketpair()\nhere.recv(1)", "MainThread for files"),
        ("out, into = os.pipe()\nos.read(out, 1)", "MainThread for files"),
        ("here, there = socket.socketpair()\nselect.select([here], [], [])", "MainThread for files"),
    ):
        ran = run(f"import os, select, serial, socket, threading\n{text}")
        assert ran.code == 1
        assert ran.err.startswith("kiks: some thread of a program must be able to go on, but all wait for ever: ")
        assert waiting in ran.err
        assert ran.err.count("\n") == 1


def test_a_child_process_from_before_the_program_holds_none_of_its_pipes(run: Run) -> None:
    with subprocess.Popen(["cat"], stdin=subprocess.PIPE):
        ran = run("import os\nout, into = os.pipe()\nos.read(out, 1)\n")
    assert ran.code == 1
    assert "wait for ever: MainThread for files" in ran.err


def test_thinking_of_threads_is_charged(run: Run) -> None:
    counted = """
        import queue, serial, threading
        port, lines = serial.Serial('COM1', timeout=1), queue.Queue()
        def read():
            for _ in range(10): lines.put(port.readline())
        threading.Thread(target=read).start()
        for _ in range(10):
            port.write(b'N\\n')
            lines.get()
    """
    none, fixed = (run(counted, thinking=thinking).time_s for thinking in ("none", "fixed:10"))
    assert fixed == pytest.approx(none + 10 * 0.010)


def test_alarm_without_a_handler_ends_the_program(run: Run) -> None:
    ran = run("import signal, time\nsignal.signal(14, signal.SIG_DFL)\nsignal.alarm(2)\ntime.sleep(10)\n")
    assert (ran.code, ran.time_s) == (128 + signal.SIGALRM, 2.0)


def test_program_that_leaves_simulated_time_ends_with_one_line(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, text in (
        ("driver", f"#!{sys.executable}\n"),
        ("hidden", f'#!/bin/sh\n{sys.executable} -c \'open("wrong", "w")\' 2>/dev/null\n'),
    ):
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o700)
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin/driver").symlink_to("../driver")
    (tmp_path / "bin/python").symlink_to(sys.executable)
    for text, must in (
        ("import socket\nsocket.create_connection(('127.0.0.1', 9))", "talk to its robots alone, but it used the net"),
        ("import socket\nsocket.getaddrinfo('example.org', 80)", "talk to its robots alone"),
        ("import subprocess, sys\nsubprocess.run([sys.executable, '-c', ''])", "start no process of Python by itself"),
        ("import os\nos.system('python3 -c 1')", "start no process of Python by itself"),
        ("import subprocess\nsubprocess.run(['./driver'])", "start no process of Python by itself, but it did ("),
        ("import subprocess\nsubprocess.run('driver', cwd='bin', env={})", "start no process of Python by itself"),
        ("import subprocess\nsubprocess.run(['env', 'python3'])", "start no process of Python by itself"),
        ("import subprocess\nsubprocess.run(['bin/python'])", "start no process of Python by itself, but it did ("),
        ("import os\nos.system('./hidden')", "start no process of Python by itself, but it did, by another program"),
        ("import subprocess\nsubprocess.run(['./hidden'], env={})", "start no process of Python by itself"),
        ("import subprocess\nsubprocess.Popen('./hidden', close_fds=False).communicate()", "start no process of Py"),
        ("import os, time; os.posix_spawn('hidden', ['hidden'], {}); os.wait()\ntime.sleep(1)", "start no process of"),
        ("import os\nos.execvp('ls', ['ls'])", "stay in its process, but it replaced itself by ls"),
        ("import os\nos.system('stty -F /dev/ttyUSB0')", "open a serial port by pyserial, but it gave /dev/ttyUSB0"),
        ("import serial, subprocess\nsubprocess.run(['cat'], stdin=serial.Serial('COM1'))", "read a port by Python"),
        ("import multiprocessing as m\nm.Process(target=print).start()", "start no process of Python by itself"),
        ("import os\nos.fork()", "be one process, but it started one more by fork"),
        ("import os\nos.open('/dev/ttyUSB0', os.O_RDWR)", "open a serial port by pyserial, but it opened /dev/ttyUSB0"),
        ("import ctypes\nfor _ in range(100): ctypes.CDLL(None).usleep(20000)", "wait by time.sleep, a lock or a port"),
        ("\nimport uvloop", "wait by Python's own event loops, but it imported uvloop"),
        (
            # It has a plugin for pytest.
            "import sys; sys.modules.pop('time_machine', None)\nimport time_machine",
            "leave the insides of Python's clocks alone, but it imported time_machine",
        ),
    ):
        # Another test of this process may have loaded it; a program starts in a process that has not.
        monkeypatch.delitem(sys.modules, "uvloop", raising=False)
        ran = run(f"try:\n{textwrap.indent(text, '    ')}\nexcept Exception: pass\nprint('wrong')\n")
        assert (ran.code, ran.out) == (1, "")
        assert ran.err.startswith(f"kiks: a program in simulated time must {must}")
        assert "(program.py, line 3)" in ran.err
        assert ran.err.endswith("kiks serve, where time is real.\n")
        assert ran.err.count("\n") == 1
    assert not (tmp_path / "wrong").exists()


@pytest.mark.parametrize(
    "text",
    [
        "open('link', 'r+b', 0)",
        "os.open(os.path.abspath('link').encode(), os.O_RDWR)",
        "pathlib.Path('link').write_bytes(b'')",
        "io.FileIO('bin/../link', 'r+')",
        "io.open_code(os.path.realpath('link'))",
        "os.open('../link', os.O_RDWR, dir_fd=os.open('bin', os.O_RDONLY))",
        "os.chdir('bin'); open('/proc/self/cwd/../link', 'wb', 0)",
        "shutil.copyfile('program.py', 'link')",
        "subprocess.run(['tee', 'link'], input=b'D')",
        "os.system('echo D>link')",
        "ctypes.CDLL(None).open(b'link', 1)",
        "open(b'/dev/ttyUSB0', 'wb', 0)",
        "os.open('/dev/serial/by-id/usb-1', os.O_RDWR)",
        "os.open('gone', os.O_RDWR)",
    ],
)
def test_no_way_leads_to_a_real_device(text: str, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # A pseudo-terminal of this test stands for the device: its number is in the system's list of serial drivers.
    (tmp_path / "drivers").write_text("stand_in /dev/pts 136 0-1048575 serial\n")
    monkeypatch.setattr(devices, "DRIVERS", tmp_path / "drivers")
    robot, device = os.openpty()
    (tmp_path / "link").symlink_to(os.ttyname(device))
    (tmp_path / "gone").symlink_to("/dev/ttyUSB77")
    (tmp_path / "bin").mkdir()
    ran = run(f"import ctypes, io, os, pathlib, shutil, subprocess\n{text}\nprint('wrong')\n")
    assert (ran.code, ran.out) == (1, "")
    assert re.fullmatch(r"kiks: a program in simulated time must open .*\(program.py, line 2\).*\n", ran.err)
    assert not select.select([robot], [], [], 0)[0]
    for end in (robot, device):
        os.close(end)


def test_loop_that_asks_for_nothing_is_told(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watchdog, "SPINNING_S", 0.5)
    monkeypatch.setattr(watchdog, "tell", (told := []).append)
    monkeypatch.setattr(seen, "trace", told)
    asks = "import serial\nport = serial.Serial('COM1')\nport.write(b'D,4,4\\n')\nport.readline()\n"
    assert run(f"{asks}from tests.script import seen\nwhile not seen.trace:\n    pass\n").code == 0
    assert re.fullmatch(
        r"line [67] of program.py has computed for \d s without waiting for a time or a robot. If it computes, that is "
        r"right; if it waits for something, end it \(Ctrl-C, or Stop on the desk\) and put time.sleep\(0.01\) into the "
        r"loop.",
        *told,
    )


KEEPS = programs_of("""
=== others wait for a time
import threading, time
is_done = False
def work():
    global is_done
    time.sleep(1)
    is_done = True
threading.Thread(target=work).start()
while not is_done:
    pass
=== others have not had their turn
import threading, time
def spin():
    while True:
        pass
threading.Thread(target=spin, daemon=True).start()
time.sleep(1)
""")

COMPUTES = programs_of("""
=== others are ready
import threading
def count():
    number = 0
    while number < 5_000_000:
        number += 1
threading.Thread(target=count, daemon=True).start()
print("on")
=== others wait for it
import threading
numbers = []
thread = threading.Thread(target=lambda: numbers.append(sum(k * k for k in range(3_000_000))))
thread.start()
thread.join()
""")


@pytest.mark.parametrize("when", KEEPS)
def test_loop_that_keeps_others_from_going_on_ends_with_one_line(when, run, monkeypatch):
    monkeypatch.setattr(watchdog, "SPINNING_S", 0.5)
    ran = run(KEEPS[when][0])
    assert ran.code == 1
    told, end = ran.err.splitlines()
    assert "of program.py has computed for" in told
    assert "robot, while its other threads waited. If it computes" in told
    assert "asked for neither time nor bytes for" in end
    assert "put time.sleep(0.001) into the loop, or run it on kiks serve" in end


def test_what_kiks_computes_is_not_told(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watchdog, "SPINNING_S", 0.02)
    ran = run("""
        import threading, time
        threading.Thread(target=time.sleep, args=(3e5,), daemon=True).start()
        time.sleep(4e4)
    """)
    assert (ran.code, ran.err) == (0, "")


def test_a_wait_in_code_in_c_ends_the_process_that_it_never_leaves(tmp_path: Path) -> None:
    (tmp_path / "waits.py").write_text(
        # No signal is in the set, and the C library goes on waiting after others.
        "import ctypes\nsignals, found = ctypes.create_string_buffer(128), ctypes.c_int()\n"
        "ctypes.CDLL(None).sigwait(signals, ctypes.byref(found))\n"
    )
    code = (
        "import sys\nfrom pathlib import Path\nfrom kiks.script import watchdog\n"
        "from kiks.script.runner import run_here\nfrom kiks.sim.simulation import Simulation\n"
        "watchdog.GRACE_S = 0.1\nsys.exit(run_here(Simulation(), Path('waits.py'), [], {}))\n"
    )
    done = forked.run(code=code, cwd=tmp_path)
    assert done.returncode == 1
    assert re.fullmatch(r"kiks: .*it waited by itself \(waits.py, line 3\)\. Run it on kiks serve.*\n", done.stderr)


@pytest.mark.parametrize("when", COMPUTES)
def test_thread_may_compute_from_its_first_moment(when: str, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watchdog, "SPINNING_S", 0.05)
    assert run(COMPUTES[when][0]).code == 0


CHAIN = """
import serial, sys, threading
port = serial.Serial('COM1')
port.close()
def lose():
    try:
        port.write(b'H')
    except serial.SerialException as error:
        raise RuntimeError('lost') from error
thread = threading.Thread(target=lose, name='careless')
thread.start()
thread.join()
threading.Thread(target=sys.exit, args=(3,)).start()
lose()
"""


def test_errors_are_told_with_their_causes_and_without_kiks(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    # As the library of the command line does, which shows frames of its own.
    monkeypatch.setattr(sys, "excepthook", lambda *_: print("wrong"))
    code, _, _, _, told = run(CHAIN)
    assert code == 1
    assert told.startswith("Exception in thread careless:\nTraceback (most recent call last):\n")
    assert told.count("PortNotOpenError: ") == told.count("direct cause") == told.count("RuntimeError: lost\n") == 2
    assert "protocol_kiks" not in told
    assert "runner.py" not in told
    assert told.count("File") == 7


def test_hook_of_the_program_hears_its_error(run: Run) -> None:
    hook = "def hook(kind, error, trace): print('stopped:', error)\n"
    ran = run(f"import sys\n{hook}sys.excepthook = hook\nraise ValueError('too near')\n")
    assert (ran.code, ran.out, ran.err) == (1, "stopped: too near\n", "")


ENDS = "import atexit\natexit.register(print, 'first')\n@atexit.register\ndef last(): raise SystemExit(5)\n"


def test_any_end_is_told_as_python_does(run: Run) -> None:
    code, _, _, out, told = run(f"{ENDS}import asyncio\nraise asyncio.CancelledError('early')\n")
    assert (code, out) == (1, "first\n")
    assert told.startswith("Traceback (most recent call last):\n")
    assert "CancelledError: early\nException ignored in atexit callback" in told
    assert "thread_scheduler" not in told

"""What programs of the field have brought to light: each of these once ended in an error, or never."""

from __future__ import annotations

import sys

import pytest
from tests.script.conftest import Run

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


# Each program prints what it prints without KiKS; times are simulated.
SAME = {
    "waiting for what is left of a time comes to an end": (
        "import time\nfor _ in range(3): time.sleep(2e-16)\nprint(time.monotonic_ns())\n",
        "3\n",
    ),
    "locks of the library are there for modules that are imported later": (
        "import functools\nclass A:\n    @functools.cached_property\n    def b(self): return 3\nprint(A().b)\n",
        "3\n",
    ),
    "nothing is written as pyserial refuses it": (
        "import serial\ntry: serial.Serial('COM1').write(None)\nexcept TypeError as error: print(error)\n",
        "cannot convert 'NoneType' object to bytearray\n",
    ),
    "a thread that has ended does not count": (
        "import threading\nbefore = threading.active_count()\nthread = threading.Thread(target=print)\n"
        "thread.start()\nthread.join()\nprint(threading.active_count() == before)\n",
        "\nTrue\n",
    ),
    "other programs take no simulated time": (
        "import subprocess\nsleeper = subprocess.Popen(['sleep', '0.05'])\n"
        "print(sleeper.poll(), sleeper.wait(timeout=0.001))\n",
        "0 0\n",
    ),
    "threads that are started take no time": (
        "import threading, time\n"
        "threads = [threading.Thread(target=time.sleep, args=(1,)) for _ in range(300)]\n"
        "for each in threads: each.start()\n"
        "for each in threads: each.join()\n"
        "print(time.monotonic())\n",
        "1.0\n",
    ),
    "a look at what does not block is a poll": (
        "import os, socket, threading, time\n"
        "a, b = socket.socketpair()\na.setblocking(False)\nr, w = os.pipe()\nos.set_blocking(r, False)\n"
        "threading.Timer(1, b.send, (b'x',)).start()\nthreading.Timer(2, os.write, (w, b'y')).start()\n"
        "for look in (lambda: a.recv(9), lambda: os.read(r, 9)):\n"
        "    while True:\n"
        "        try: print(look()); break\n"
        "        except BlockingIOError: pass\n"
        "a.close(); b.close()\n",
        "b'x'\nb'y'\n",
    ),
    "much goes through a pipe and a socket": (
        "import os, socket, threading\n"
        "r, w = os.pipe()\na, b = socket.socketpair()\ndata = bytes(1 << 20)\n"
        "def write():\n"
        "    with os.fdopen(w, 'wb') as file: file.write(data)\n"
        "    a.send(data); a.close()\n"
        "threading.Thread(target=write).start()\n"
        "with os.fdopen(r, 'rb') as file: print(len(file.read()))\n"
        "print(sum(len(each) for each in iter(lambda: b.recv(1 << 16), b'')))\nb.close()\n",
        f"{1 << 20}\n{1 << 20}\n",
    ),
    "a socket of the program is known by its address, even unbound or closed": (
        "import socket\n"
        "server = socket.create_server(('127.0.0.1', 0))\n"
        "with socket.create_connection(server.getsockname()) as client: client.sendall(b'hello')\n"
        "peer = server.accept()[0]\nprint(peer.recv(9))\n"
        "a, b = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))\n"
        "a.bind(('127.0.0.1', 0))\nb.sendto(b'q', a.getsockname())\n"
        "data, sender = a.recvfrom(9)\na.sendto(data.upper(), sender)\nprint(b.recv(9))\n"
        "for each in (server, peer, a, b): each.close()\n",
        "b'hello'\nb'Q'\n",
    ),
    "what epoll tells only once is told": (
        "import os, select, threading\n"
        "r, w = os.pipe()\npoll = select.epoll()\npoll.register(r, select.EPOLLIN | select.EPOLLONESHOT)\n"
        "threading.Timer(1, os.write, (w, b'x')).start()\nprint(len(poll.poll()), poll.poll(0.5))\n",
        "1 []\n",
    ),
    "a signal that is blocked is waited for": (
        "import os, signal\n"
        "signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR1])\nos.kill(os.getpid(), signal.SIGUSR1)\n"
        "print(signal.sigpending() == {signal.SIGUSR1} == {signal.sigwait([signal.SIGUSR1])})\n"
        "signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGUSR1])\n"
        "print(signal.set_wakeup_fd(-1))\n"
        "try: signal.signal(signal.SIGKILL, signal.default_int_handler)\nexcept OSError as error: print(error)\n",
        "True\n-1\n[Errno 22] Invalid argument\n",
    ),
    "sleep and now check what they are given": (
        "import datetime, pickle, time\n"
        "for given in ((), ('a',), (float('nan'),), (1, 2), (-1,)):\n"
        "    try: time.sleep(*given)\n"
        "    except (TypeError, ValueError) as error: print(error)\n"
        "time.sleep(True)\n"
        "print(time.monotonic(), pickle.loads(pickle.dumps(datetime.datetime.now)).__name__)\n",
        "time.sleep() takes exactly one argument (0 given)\n"
        "'str' object cannot be interpreted as an integer\nInvalid value NaN (not a number)\n"
        "time.sleep() takes exactly one argument (2 given)\nsleep length must be non-negative\n1.0 now\n",
    ),
    "a folder is as old as it is": (
        "import os, tempfile, time\n"
        "name = os.path.join(tempfile.mkdtemp(), 'x')\nos.mkdir(name)\ntime.sleep(8)\n"
        "print(round(time.time() - os.path.getmtime(name)))\n",
        "8\n",
    ),
}


@pytest.mark.parametrize("name", SAME)
def test_program_prints_what_it_prints_without_kiks(name: str, run: Run) -> None:
    program, printed = SAME[name]
    ran = run(program)
    assert (ran.code, ran.out) == (0, printed)


ENDS = "import atexit\natexit.register(print, 'first')\n@atexit.register\ndef last(): raise SystemExit(5)\n"


def test_any_end_is_told_as_python_does(run: Run) -> None:
    code, _, _, out, told = run(f"{ENDS}import asyncio\nraise asyncio.CancelledError('early')\n")
    assert (code, out) == (1, "first\n")
    assert told.startswith("Traceback (most recent call last):\n")
    assert "CancelledError: early\nException ignored in atexit callback" in told
    assert "thread_scheduler" not in told

"""What Python refuses is refused in simulated time, in the same words; all threads are then one of the system's."""

import subprocess
import sys
from pathlib import Path

import pytest
from tests.guard import GUARD_S
from tests.script.conftest import Run, programs_of

pytestmark = pytest.mark.slow

TELL = """
import asyncio, gc, os, signal, socket, sqlite3, sys, threading, time, warnings
def tell(*acts):
    for act in acts:
        try: print(type(act()).__name__)
        except Exception as error: print(type(error).__name__, str(error).split(" and this is")[0].split(" id ")[0])
def in_thread(*acts):
    thread = threading.Thread(target=tell, args=acts)
    thread.start()
    thread.join()
def depth():
    count = 0
    def deeper():
        nonlocal count
        count += 1
        deeper()
    try: deeper()
    except RecursionError: return count
"""

TEXT = r"""
=== objects of SQLite belong to a thread
base = sqlite3.connect(":memory:")
rows = base.execute("select 1")
acts = (base.cursor, base.commit, rows.fetchall, lambda: base.execute("select 1"), base.close)
in_thread(*acts)
tell(*acts)
free = sqlite3.connect(":memory:", check_same_thread=False)
in_thread(lambda: free.execute("select 1"))
made = []
in_thread(lambda: made.append(sqlite3.connect(":memory:")))
tell(made[0].commit)
# From Python 3.13 on, one that is not closed is warned of; only its own thread could close this one.
warnings.simplefilter("ignore", ResourceWarning)
made.clear()
gc.collect()
free.close()
=== handlers of signals are set in the main thread
acts = (lambda: signal.signal(signal.SIGUSR1, print), lambda: signal.set_wakeup_fd(-1), lambda: signal.getsignal(2),
        lambda: signal.alarm(0), lambda: signal.pthread_sigmask(signal.SIG_BLOCK, ()))
in_thread(*acts)
tell(*acts)
async def handle():
    tell(lambda: asyncio.get_running_loop().add_signal_handler(signal.SIGUSR1, print))
in_thread(lambda: asyncio.run(handle()))
=== signals and times must be such
tell(lambda: signal.alarm(1.5), lambda: signal.alarm(-1), lambda: signal.sigwait([99]),
     lambda: signal.pthread_sigmask(signal.SIG_BLOCK, [99]), lambda: signal.signal(9, print),
     lambda: signal.setitimer(signal.ITIMER_REAL, -1), lambda: time.sleep(-1), lambda: time.clock_gettime(99),
     lambda: os.urandom(-1))
=== loops of asyncio belong to a thread
async def main():
    loop = asyncio.get_running_loop()
    loop.set_debug(True)
    await asyncio.to_thread(tell, lambda: loop.call_soon(print), lambda: loop.call_later(1, print), loop.close,
                            lambda: loop.call_soon_threadsafe(int), asyncio.get_running_loop)
asyncio.run(main())
=== hooks of a thread are its own
sys.set_asyncgen_hooks(firstiter=print)
sys.set_coroutine_origin_tracking_depth(2)
acts = (lambda: sys.get_asyncgen_hooks().firstiter, lambda: {0: None}.get(sys.get_coroutine_origin_tracking_depth(), 2))
in_thread(*acts)
tell(*acts)
=== threads have numbers of their own
numbers, done = [threading.get_native_id()], threading.Event()
def note():
    numbers.append(threading.get_native_id())
    done.wait()
threads = [threading.Thread(target=note) for _ in range(3)]
for each in threads: each.start()
time.sleep(0.1)
print(len(set(numbers)), numbers[0] == os.getpid(), [each.native_id for each in threads] == numbers[1:])
done.set()
=== what is closed, and what a thread does not hold
ours, theirs = socket.socketpair()
ours.close()
lock = threading.RLock()
lock.acquire()
file = open(__file__)
file.close()
tell(lambda: ours.send(b"x"), lambda: ours.recv(1), lambda: theirs.send(b"x"), file.read, lambda: os.read(999, 1),
     threading.current_thread().join, threading.Condition().wait)
in_thread(lock.release)
=== a thread recurses to the limit, wherever it is started
def below(count):
    return below(count - 1) if count else in_thread(lambda: print(950 < depth() < 1000))
below(800)
print(950 < depth() < 1000, sys.getrecursionlimit())
sys.setrecursionlimit(3000)
in_thread(lambda: print(2950 < depth() < 3000, sys.getrecursionlimit()))
tell(lambda: sys.setrecursionlimit(0), lambda: sys.setrecursionlimit("1"))
"""

PROGRAMS = {name: TELL + program for name, (program, _) in programs_of(TEXT).items()}

FILES = {
    "a comment in Latin-1": b"# Schr\xf6dinger\nprint(1)\n",
    "a text in Latin-1": b'x = "\xf6"\n',
    "declared Latin-1": b'# -*- coding: latin-1 -*-\nprint("\xf6")\n',
    "declared UTF-8": b"# coding: utf-8\n# \xf6\n",
    "no such encoding": b"# coding: utf-9\nprint(1)\n",
    "a mark of UTF-8": b"\xef\xbb\xbfprint(1)\n",
    "UTF-16": "print(1)\n".encode("utf-16"),
    "a zero": b"x = 1\n\0",
    "tabs and blanks": b"if 1:\n\tprint(2)\n        print(3)\n",
    "old ends of lines": b"print(1)\rprint(2)\r",
    "imports a module in Latin-1": b"import program_of_latin\n",
    "fails": b"def f():\n  1 / 0\nf()\n",
}
"""The bytes of programs."""


def by_python(program: Path) -> tuple[int, str, str]:
    done = subprocess.run([sys.executable, program.name], capture_output=True, timeout=GUARD_S, cwd=program.parent)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


@pytest.mark.parametrize("name", PROGRAMS)
def test_what_python_refuses_is_refused(name: str, run: Run, tmp_path: Path) -> None:
    ran = run(PROGRAMS[name])
    assert (ran.code, ran.out, ran.err) == by_python(tmp_path / "program.py")
    assert ran.code == 0


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_read_as_python_reads_it(
    name: str, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Path, "write_text", lambda path, _: path.write_bytes(FILES[name]))
    (tmp_path / "program_of_latin.py").write_bytes(b"x = '\xf6'\n")
    ran = run("")
    assert (ran.code, ran.out, ran.err) == by_python(tmp_path / "program.py")

"""Programs of strangers: whatever one does, it is stopped, its reason is named, and no other program notices it."""

import json
import os
import socket
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.at_length import cases, share
from tests.namespaces import needs_sandbox
from tests.ports.helpers import printed, write
from tests.served import PROGRAMS, fresh

from kiks.errors import KiksError
from kiks.ports.program_command import ProgramCommand
from kiks.ports.programs import Programs
from kiks.ports.sandbox import Sandbox, SandboxLimits

pytestmark = [pytest.mark.slow, needs_sandbox]

# A busy computer may let a program wait long for its turn.
LIMITS = SandboxLimits(memory_mb=150, processes=8, computing_s=0.5, waiting_s=60, output_mb=0.5, files_mb=8, files=300)

GOOD = """
import random, serial
port = serial.Serial("COM1", timeout=1)
for _ in range(40):
    port.write(b"D,%d,%d\\n" % (random.randint(-9, 9), random.randint(-9, 9)))
    port.readline()
    port.write(b"H\\n")
    print(port.readline())
"""

BEGIN = """
import ctypes, os, sys, serial
port = serial.Serial("COM1", timeout=1)
port.write(b"N\\n")
port.readline()
"""

SENDS = """
for each in os.listdir("/proc/self/fd"):
    if int(each) > 2:
        try: os.write(int(each), DATA)
        except OSError: pass
while True: pass
"""

PLAIN = """
import ctypes, os, sys
words = [os.fsencode(word) for word in [sys.executable, "-S", "-c", TEXT, *sys.argv[1:]]]
c = ctypes.CDLL(None)
words, environment = (ctypes.c_char_p * (len(words) + 1))(*words), ctypes.c_void_p.in_dll(c, "environ")
c.fexecve(os.open(words[0], os.O_RDONLY), words, environment)
"""


def plain(text: str) -> str:
    """Return a program that runs another one in a plain Python: what KiKS itself refuses is not what is tested here."""
    return f"TEXT = {text!r}" + PLAIN


UNCOUNTED = """
import os, signal, time
signal.signal(signal.SIGCHLD, signal.SIG_IGN)
while True:
    if not os.fork():
        end_s = time.time() + 0.02
        while time.time() < end_s: pass
        os._exit(0)
    try: os.wait()
    except ChildProcessError: pass
"""

UNREAD = """
import os, signal, socket
os.fork()
kept = []
for _ in range(110):
    for each in socket.socketpair():
        kept.append(each)
        each.setblocking(False)
        try:
            while True: each.send(bytes(1 << 16))
        except BlockingIOError: pass
signal.pause()
"""

FILES = """
import signal
kept = b"x" * 138_000_000
for folder in ("/tmp", "/dev/shm"):
    for number in range(70): open(f"{folder}/{number}", "wb").write(bytes(100_000))
signal.pause()
"""

LOCKS = """
import fcntl, signal
with open("/tmp/x", "w") as file:
    for number in range(2000): fcntl.lockf(file, fcntl.LOCK_EX, 1, 2 * number)
    signal.pause()
"""

LEADERLESS = """
import ctypes, threading, time
def keep():
    kept = [bytes(b"x") * 4_000_000 for _ in range(60) if not time.sleep(0.02)]
    time.sleep(60)
threading.Thread(target=keep).start()
time.sleep(0.1)
ctypes.CDLL(None).syscall({"x86_64": 60, "aarch64": 93}[__import__("os").uname().machine], 0)
"""

HOSTILE = {
    # What KiKS sees of forks it refuses, as a program in simulated time is one process. These are a thousand at most:
    # as the superuser, only a control group limits them.
    "started more than 8 processes": "c = ctypes.CDLL(None)\nfor _ in range(10): c.__fork()\nwhile True: pass",
    "used more than 150 MB of memory": "kept = []\nwhile True: kept.append(b'x' * (1 << 20))",
    "computed for 0.5 s without using its robot": "while True: pass",
    "waited for 1.5 s for what is not simulated": 'ctypes.CDLL(None).execl(b"/bin/sleep", b"sleep", b"100", None)',
    "printed more than 0.5 MB": "while True: os.write(1, b'x' * 4095 + b'\\n')",
    "sent a message of 4294967295 bytes to the world": SENDS.replace("DATA", r'b"\xff" * 1000'),
    "sent something to the world that is no message": SENDS.replace("DATA", r'b"\x02\0\0\0\x01\x02"'),
    "computed for 0.5 s without using its robot, in processes that nobody waits for": plain(UNCOUNTED),
    "waited for 1.5 s for what is not simulated, between commands": (
        "import subprocess\nwhile True: subprocess.run(['sleep', '0.4']), port.write(b'N\\n'), port.readline()"
    ),
    "made more than 300 files or locks of files": plain(
        "import signal\nfor n in range(999): open(f'/dev/shm/{n}', 'w').close()\nsignal.pause()"
    ),
    "made more than 300 files or locks of files, as locks": plain(LOCKS),
    "used more than 150 MB of memory, in sockets": plain(UNREAD),
    "used more than 150 MB of memory, in files": plain(FILES),
    "used more than 150 MB of memory, after its first thread": plain(LEADERLESS),
    "started more than 64 threads": plain(
        "from threading import *\nfor _ in range(99): Thread(target=Event().wait).start()"
    ),
}

End = tuple[str, int, list[str]]
"""State of the world, exit code and output of a program."""


def run(command: ProgramCommand, sandbox: Sandbox | None, robot: int = 1, **options: Any) -> End:
    """Run a program alone in a world, for its last robot; return state, exit code and output."""
    sim, commands = fresh(robot), [*[None] * (robot - 1), command]
    programs = Programs(sim, commands, keeps_output=True, when_silent="wait", sandbox=sandbox, **options)
    code = programs.run()
    return sim.state_hash(), code, printed(programs.handles[0])


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> ProgramCommand:
    return write(tmp_path_factory.mktemp("good") / "program.py", GOOD)


@pytest.fixture(scope="module")
def usual(good: ProgramCommand) -> End:
    """What comes of the good program outside of a sandbox."""
    return run(good, None)


@pytest.fixture(scope="module")
def usual_second(good: ProgramCommand) -> list[str]:
    """What the good program prints that drives robot 2."""
    return run(good, None, robot=2)[2]


@pytest.fixture(scope="module")
def beside(good: ProgramCommand) -> Iterator[Sandbox]:
    with Sandbox([good.program]) as sandbox:
        yield sandbox


@pytest.fixture(scope="module")
def around_hostile(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, Sandbox]]:
    """Where hostile programs are written, and the sandbox in which they run one after the other."""
    path = tmp_path_factory.mktemp("hostile") / "program.py"
    with Sandbox([path.parent], limits=LIMITS) as sandbox:
        yield path, sandbox


@pytest.mark.parametrize(("reason", "text"), cases(HOSTILE.items(), 10), ids=HOSTILE)
def test_hostile_program_is_stopped_and_named_and_no_other_one_notices(
    reason, text, good, usual, usual_second, beside, around_hostile
):
    path, sandbox = around_hostile
    with ExitStack() as stack:
        if "waited" in reason:
            impatient = Sandbox([path.parent], limits=replace(LIMITS, waiting_s=1.5))
            sandbox = stack.enter_context(impatient)
        sandboxes, options = {1: sandbox, 2: beside}, {"keeps_output": True, "when_silent": "wait", "are_apart": True}
        programs = Programs(fresh(2), [write(path, BEGIN + text), good], sandbox=sandboxes, **options)
        programs.run()
        first, second = programs.handles
        reason = reason.partition(", ")[0]
        assert (first.reason, first.how) == (reason, f"because it {reason}")
        assert (second.reason, second.code) == ("", 0)
        assert printed(second) == usual_second
        # The next program finds a sandbox as if nothing had been.
        assert run(write(path, GOOD), sandbox) == usual


PROWLER = """
import ctypes, fcntl, json, mmap, os, resource, socket, sys
own, secret, neighbour, tcp, udp, abstract, pid = json.loads(sys.argv[1])

def attempt(name, do):
    try:
        print(name, "DONE", do())
    except Exception as error:
        print(name, type(error).__name__)

def connected(family, address, kind=socket.SOCK_STREAM):
    with socket.socket(family, kind) as there:
        there.settimeout(5)
        there.connect(address)
        there.send(b"x")

def fill(folder):
    number = 0
    while True:
        number += 1
        with open(f"{folder}/{number}", "wb") as file:
            file.write(bytes(1 << 20))

libc = ctypes.CDLL(None, use_errno=True)

def made(result):
    if result < 0:
        raise OSError(ctypes.get_errno(), "refused")

attempt("reads the home folder", lambda: open(secret).read())
attempt("lists the home folder", lambda: os.listdir(os.path.dirname(secret)))
attempt("writes to its neighbour", lambda: open(neighbour, "w"))
attempt("writes to its own file", lambda: open(own, "a"))
attempt("writes to KiKS", lambda: open(os.path.join(sys.prefix, "x"), "w"))
attempt("TCP", lambda: connected(socket.AF_INET, tuple(tcp)))
attempt("UDP", lambda: connected(socket.AF_INET, tuple(udp), socket.SOCK_DGRAM))
attempt("abstract socket", lambda: connected(socket.AF_UNIX, "\\0" + abstract))
attempt("kills a process of others", lambda: os.kill(pid, 9))
attempt("kills its parent", lambda: os.kill(os.getppid(), 9))
attempt("kills all", lambda: os.kill(-1, 9))
attempt("traces its parent", lambda: made(libc.ptrace(16, os.getppid(), 0, 0)))
attempt("reads memory", lambda: open(f"/proc/{os.getppid()}/mem", "rb").read(1))
attempt("its parent's environment", lambda: open(f"/proc/{os.getppid()}/environ", "rb").read())
attempt("fills /tmp", lambda: fill("/tmp"))
attempt("fills /dev/shm", lambda: fill("/dev/shm"))
attempt("fills /", lambda: fill("/"))
attempt("fills /dev", lambda: fill("/dev"))
attempt("mounts", lambda: made(libc.mount(b"x", b"/tmp", b"tmpfs", 0, None)))
attempt("one large file", lambda: open("/dev/shm/large", "wb").truncate(1 << 30))
attempt("memory of no process", lambda: os.memfd_create("x"))
attempt("a namespace of its own", lambda: made(libc.unshare(0x10000000)))
attempt("another segment", lambda: made(libc.shmget(0, 1 << 20, 0o1600)))
attempt("semaphores", lambda: made(libc.semget(0, 32000, 0o1600)))
attempt("shared memory of no file", lambda: mmap.mmap(-1, 1 << 20))
attempt("shared zeros", lambda: mmap.mmap(os.open("/dev/zero", os.O_RDWR), 1 << 20))
attempt("large buffers", lambda: socket.socket(socket.AF_UNIX).setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 30))
attempt("locks of no process", lambda: fcntl.fcntl(0, 37, bytes(32)))
attempt("pages in a pipe", lambda: made(libc.vmsplice(os.pipe()[1], (ctypes.c_void_p * 2)(0, 0), 1, 0)))
attempt("the host of a virtual machine", lambda: socket.socket(40, socket.SOCK_STREAM))
attempt("lists of descriptors", lambda: __import__("select").epoll())
attempt("a terminal", lambda: os.openpty())
attempt("rules of no process", lambda: made(libc.syscall(444, None, 0, 1)))
attempt("a protocol that is seldom used", lambda: socket.socket(socket.AF_INET, socket.SOCK_STREAM, 262))
attempt("large pipes", lambda: fcntl.fcntl(os.pipe()[1], 1031, 1 << 20))
attempt("limits of its parent", lambda: resource.prlimit(os.getppid(), resource.RLIMIT_NOFILE, (1, 1)))
attempt("what the kernel tells the superuser", lambda: open("/proc/slabinfo").read())
attempt("the kernel's log", lambda: made(libc.klogctl(10, None, 0)))
attempt("stands back", lambda: os.nice(1))
attempt("settings of the kernel", lambda: open("/proc/sys/kernel/core_pattern", "r+"))
attempt("rights of a device", lambda: os.chmod("/dev/null", 0o666))
attempt("rights of its input", lambda: os.fchmod(0, 0o666))
attempt("10 GB", lambda: bytearray(10 << 30))
attempt("more memory", lambda: resource.setrlimit(resource.RLIMIT_AS, (1 << 40, 1 << 40)))
print("processes", sorted(map(int, filter(str.isdigit, os.listdir("/proc"))))[:1] == [1])
print("environment", sorted(os.environ))
"""


def test_program_reaches_no_file_network_or_neighbour(good: ProgramCommand, usual: End, tmp_path: Path) -> None:
    secret, neighbour = tmp_path / "home" / "secret", tmp_path / "neighbour" / "program.py"
    for each in (secret, neighbour):
        each.parent.mkdir()
        each.write_text("untouched")
    abstract = f"kiks-test-{os.getpid()}"
    with (
        closing(socket.create_server(("127.0.0.1", 0))) as tcp,
        closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as udp,
        closing(socket.socket(socket.AF_UNIX)) as local,
        subprocess.Popen(["sleep", "100"]) as victim,
    ):
        udp.bind(("127.0.0.1", 0))
        local.bind("\0" + abstract)
        local.listen()
        told = [
            str(path := tmp_path / "prowler" / "program.py"),
            str(secret),
            str(neighbour),
            tcp.getsockname(),
            udp.getsockname(),
            abstract,
            victim.pid,
        ]
        prowler = write(path, plain(PROWLER), json.dumps(told))
        with Sandbox([tmp_path / "prowler"], limits=SandboxLimits(files_mb=8)) as sandbox:
            _, code, lines = run(prowler, sandbox)
            before = sandbox._processes
            assert run(write(path, GOOD), sandbox) == usual
            assert sandbox._processes is before, "its warm process lives on"
        for each in (tcp, udp, local):
            each.setblocking(False)
            with pytest.raises(BlockingIOError):
                each.recv(1) if each is udp else each.accept()
        assert victim.poll() is None
        victim.kill()
    assert secret.read_text() == neighbour.read_text() == "untouched"
    assert code == 0, lines
    *outcomes, processes, environment = lines
    assert not [line for line in outcomes if "DONE" in line and not line.startswith(("UDP", "kills its parent"))]
    assert processes == "processes True"
    assert set(eval(environment.removeprefix("environment "))) <= {
        "HOME", "LANG", "LC_CTYPE", "PATH", "PWD", "PYTHONHASHSEED", "PYTHONIOENCODING", "PYTHONUNBUFFERED", "TMPDIR"
    }  # fmt: skip


LOOKS = """
import os, random, sys, time
import serial
print(sys.argv, sys.modules["__main__"].__name__, __file__, sys.path[0], hash("x"), {"a", "b", "c"})
print(time.time(), random.random(), os.urandom(4), sys.stdout, sys.stderr, sys.stdin.read())
port = serial.Serial("COM1", timeout=1)
port.write(b"D,4,%d\\n" % random.randint(0, 9))
print(port.readline())
sys.exit(int(sys.argv[1]))
"""


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[ProgramCommand, str, End]]:
    """Programs, how each thinks, and what comes of it in a process of its own."""
    folder = tmp_path_factory.mktemp("looks")
    (folder.parent / "times").write_text("7000000\n" * 40)
    looks = write(folder / "program.py", LOOKS, "7", "x")
    runs = [(looks, "none"), (looks, f"replay:{folder.parent / 'times'}")]
    runs.append((ProgramCommand(PROGRAMS / "any_port.py", ["3"]), "none"))
    runs.append((ProgramCommand(PROGRAMS / "any_way.py", ["pybluez", "4"]), "fixed:5"))
    runs += share([], [(ProgramCommand(PROGRAMS / "wander.py"), "none")])
    return [(command, thinking, run(command, None, thinking=thinking)) for command, thinking in runs]


@pytest.mark.parametrize("is_trusted", [False, True], ids=["sandbox", "trusted"])
def test_program_is_the_same_as_in_a_process_of_its_own(is_trusted, alone):
    with Sandbox([alone[0][0].program.parent, PROGRAMS], is_trusted=is_trusted) as sandbox:
        for command, thinking, end in (*alone, alone[0]):
            assert run(command, sandbox, thinking=thinking) == end
    assert alone[0][2][0] != alone[1][2][0]


def test_each_start_finds_an_empty_working_folder_with_the_files_of_the_program(tmp_path: Path) -> None:
    text = "import os\nprint(sorted(os.listdir()))\nopen('left', 'w')"
    text += "\nos.mkdir('/tmp/left')\nopen('/tmp/left/x', 'w')\nos.chmod('/tmp/left', 0)"
    command = write(tmp_path / "first" / "program.py", text)
    (tmp_path / "first" / "map.txt").write_text("here")
    with Sandbox([tmp_path / "first"]) as sandbox:
        for _ in range(2):
            assert run(command, sandbox)[2] == ["['map.txt', 'program.py']"]


@pytest.mark.parametrize(
    ("bwrap", "message"),
    [("", "is not installed"), ("#!/bin/sh\necho 'bwrap: No permissions' >&2\nexit 1\n", "'bwrap: No permissions'")],
    ids=["not installed", "without namespaces"],
)
def test_without_bubblewrap_one_line_says_what_to_do(bwrap, message, good, tmp_path, monkeypatch):
    if bwrap:
        (tmp_path / "bwrap").write_text(bwrap)
        (tmp_path / "bwrap").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    with Sandbox([good.program]) as sandbox, pytest.raises(KiksError, match=message) as caught:
        run(good, sandbox)
    assert "\n" not in str(caught.value)
    assert "--trusted" in str(caught.value)


def test_trusted_program_has_limits_as_well(usual: End, tmp_path: Path) -> None:
    hostile = write(tmp_path / "hostile" / "program.py", BEGIN + "while True: pass")
    with Sandbox(limits=LIMITS, is_trusted=True) as sandbox:
        assert run(hostile, sandbox)[1] == 137
        write(tmp_path / "hostile" / "program.py", GOOD)
        assert run(hostile, sandbox) == usual

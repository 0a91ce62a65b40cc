"""`kiks` and `python -c` as processes without their second or two of imports.

A process that has imported KiKS and loaded its compiled code forks for each call. Tests of the start itself, of signals
and of terminals begin a real process.
"""

import atexit
import contextlib
import gc
import json
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import types
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]
LIMIT_S = 470.0
"""Time limit of a call."""

ADDRESS = "KIKS_TESTS_FORKED"
"""The variable of the environment that names the socket, so that all workers of the tests share one process."""

_starting = threading.Lock()


def address() -> str:
    """Return the socket of the process that forks; start that process at the first call."""
    with _starting:
        if ADDRESS not in os.environ:
            folder = tempfile.TemporaryDirectory(prefix="kiks-forked-")
            os.environ[ADDRESS] = name = f"{folder.name}/socket"
            with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listener:
                listener.bind(name)
                listener.listen(100)
                command = [sys.executable, "-m", "tests.forked", str(listener.fileno())]
                # Standard output is no terminal, so that Python buffers it as it does for a pipe.
                pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.DEVNULL}
                process = subprocess.Popen(command, cwd=ROOT, pass_fds=[listener.fileno()], **pipes)
            atexit.register(folder.cleanup)
            atexit.register(process.communicate)  # its input ends, and so does the process
        return os.environ[ADDRESS]


def call(request: Mapping[str, object], descriptors: list[int]) -> int:
    """Run a request with these for standard input, output and error; return the exit code, -N for signal N."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as connection:
        connection.connect(address())
        socket.send_fds(connection, [json.dumps(request).encode()], descriptors)
        connection.settimeout(LIMIT_S)
        return int(connection.recv(100))


def kiks_command() -> list[str]:
    """Return a command that does what `kiks` does, in a fork; if it is killed, so is the fork."""
    return [sys.executable, "-I", "-S", str(ROOT / "tests" / "programs" / "forked_kiks.py"), address()]


def run(
    *words: str, code: str | None = None, cwd: Path | None = None, env: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run `kiks WORDS`, or `python -c CODE`.

    Args:
        *words: Arguments of the command.
        code: A program in place of the command.
        cwd: Its folder.
        env: What it finds in its environment beside what the test finds.

    Raises:
        TimeoutError: If it does not end in time.
    """
    surroundings = {**os.environ, **(env or {})}
    request = {"words": words, "code": code, "cwd": str(cwd or Path.cwd()), "env": surroundings}
    with open(os.devnull) as nothing, tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as errors:
        exit_code = call(request, [nothing.fileno(), out.fileno(), errors.fileno()])
        out.seek(0)
        errors.seek(0)
        return subprocess.CompletedProcess(["kiks", *words], exit_code, out.read(), errors.read())


# ---- in the process that forks ----


def serve(listener: socket.socket) -> None:
    """Fork for each connection until the tests are over; return in each fork, too, when its program has ended."""
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    while sys.stdin not in select.select([sys.stdin, listener], [], [])[0]:
        connection, _ = listener.accept()
        if os.fork() == 0:
            listener.close()
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            attend(connection)
            return
        connection.close()


def attend(connection: socket.socket) -> None:
    """Run a request in another fork; tell its exit code, or kill it when the other end closes the connection."""
    message, descriptors, _, _ = socket.recv_fds(connection, 1 << 20, 3)
    pid = os.fork()
    if pid == 0:
        connection.close()
        begin(json.loads(message), descriptors)
        return
    for descriptor in descriptors:
        os.close(descriptor)
    end = os.pidfd_open(pid)
    has_ended = end in select.select([end, connection], [], [])[0]
    if not has_ended:
        os.kill(pid, signal.SIGKILL)
    exit_code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    if has_ended:
        with contextlib.suppress(OSError):  # the other end may have gone at the same moment
            connection.send(b"%d" % exit_code)
    os._exit(0)


def begin(request: dict, descriptors: list[int]) -> None:
    """Run a request in this fork, as a process of its own would."""
    for descriptor, given in enumerate(descriptors):
        os.dup2(given, descriptor)
        os.close(given)
    sys.stdout.reconfigure(line_buffering=sys.stdout.isatty())  # as Python does at its start
    os.chdir(request["cwd"])
    os.environ.clear()
    os.environ.update(request["env"])
    main = sys.modules["__main__"] = types.ModuleType("__main__")
    sys.path[0] = ""
    if request["code"] is None:
        from kiks.__main__ import main as run_kiks

        sys.argv = ["kiks", *request["words"]]
        run_kiks()
    else:
        sys.argv = ["-c"]
        exec(compile(request["code"], "<string>", "exec"), vars(main))


if __name__ == "__main__":
    import kiks.cli
    import kiks.desk.server.show
    import kiks.toolbox.session_process  # noqa: F401
    from kiks.cli.engine_start import compile_batch, compile_everything

    compile_everything()
    compile_batch()
    # A fork need not look for garbage in what all of them share, which takes half a second at its end.
    gc.collect()
    gc.freeze()
    serve(socket.socket(fileno=int(sys.argv[1])))

"""`kiks` and `python -c` as processes without their second or two of imports.

A process that has imported KiKS and loaded its compiled code forks for each call. Tests of the start itself, of signals
and of terminals begin a real process.
"""

from __future__ import annotations

import atexit
import json
import os
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

_starting = threading.Lock()
_server: Server | None = None


class Server:
    """The process that forks, and the way to ask it. One thread at a time may ask."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            command = [sys.executable, "-m", "tests.forked", str(theirs.fileno())]
            # Standard output is no terminal, so that Python buffers it as it does for a pipe.
            nowhere = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL}
            self.process = subprocess.Popen(command, cwd=ROOT, pass_fds=[theirs.fileno()], **nowhere)

    def call(self, request: Mapping[str, object], outputs: list[int]) -> int:
        """Run a request with standard output and error in files; return the exit code, -N for signal N."""
        with self.lock:
            socket.send_fds(self.socket, [json.dumps(request).encode()], outputs)
            self.socket.settimeout(LIMIT_S)
            pid = int(self.socket.recv(100))
            try:
                return int(self.socket.recv(100))
            except TimeoutError:
                os.kill(pid, signal.SIGKILL)
                raise

    def close(self) -> None:
        """End the process."""
        self.socket.close()
        self.process.wait()


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
    global _server
    with _starting:
        if _server is None:
            _server = Server()
            atexit.register(_server.close)
    surroundings = {**os.environ, **(env or {})}
    request = {"words": words, "code": code, "cwd": str(cwd or Path.cwd()), "env": surroundings}
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as errors:
        exit_code = _server.call(request, [out.fileno(), errors.fileno()])
        out.seek(0)
        errors.seek(0)
        return subprocess.CompletedProcess(["kiks", *words], exit_code, out.read(), errors.read())


# ---- in the process that forks ----


def serve(requests: socket.socket) -> None:
    """Fork for each request until the tests are over; return in each fork, too, when its program has ended."""
    while True:
        message, outputs, _, _ = socket.recv_fds(requests, 1 << 20, 2)
        if not message:
            return
        pid = os.fork()
        if pid == 0:
            requests.close()
            begin(json.loads(message), outputs)
            return
        for descriptor in outputs:
            os.close(descriptor)
        requests.send(b"%d" % pid)
        requests.send(b"%d" % os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))


def begin(request: dict, outputs: list[int]) -> None:
    """Run a request in this fork, as a process of its own would."""
    for descriptor, output in zip((1, 2), outputs, strict=True):
        os.dup2(output, descriptor)
        os.close(output)
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
    from kiks.cli.engine_start import compile_batch, compile_everything

    compile_everything()
    compile_batch()
    serve(socket.socket(fileno=int(sys.argv[1])))

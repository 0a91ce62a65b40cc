"""A client of debuggers, as VS Code is one: it launches a program or attaches to one, and acts at each stop."""

from __future__ import annotations

import json
import os
import queue
import secrets
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

PATIENCE_S = 60.0
"""Longest wait for an answer or an event [s of real time]."""

_CAN = (
    *("supportsVariableType", "supportsVariablePaging", "supportsRunInTerminalRequest", "supportsMemoryReferences"),
    *("supportsProgressReporting", "supportsInvalidatedEvent", "supportsMemoryEvent", "supportsANSIStyling"),
    *("supportsArgsCanBeInterpretedByShell", "supportsStartDebuggingRequest"),
)
"""What VS Code says of itself, beside the numbering of lines and columns."""


def free_port() -> int:
    """Return the number of a port of this computer on which no program listens.

    It is none of those that the system gives to connections: one that waits for a server could get the server's own
    port, and would talk to itself.
    """
    while True:
        port = 20_000 + secrets.randbelow(12_000)
        with socket.socket() as free, suppress(OSError):
            free.bind(("127.0.0.1", port))
            return port


def connect(host: str, port: int) -> socket.socket:
    """Connect to a server that may still start."""
    until_s = time.monotonic() + PATIENCE_S
    while True:
        try:
            return socket.create_connection((host, port), timeout=PATIENCE_S)
        except OSError:
            if time.monotonic() > until_s:
                raise
            threading.Event().wait(0.02)


class Stop:
    """A stop of a program, at which a test may ask for more, and says how it goes on.

    A request takes debugpy 45 ms, so each stop asks for what is looked at alone, but the first one for all.

    Attributes:
        reason: Why it stopped, such as 'breakpoint' or 'step'.
        thread: Number of the thread.
    """

    def __init__(self, session: Session, reason: str, thread: int) -> None:
        self.session, self.reason, self.thread = session, reason, thread

    @cached_property
    def thread_name(self) -> str:
        """Name of the thread."""
        threads = self.session.ask("threads")["threads"]
        return next(str(each["name"]) for each in threads if each["id"] == self.thread)

    @cached_property
    def frames(self) -> list[dict[str, Any]]:
        """Its frames, the innermost first, each with `id`, `name`, `line` and `source`."""
        stack = self.session.ask("stackTrace", threadId=self.thread, startFrame=0, levels=20)
        return list(stack["stackFrames"])

    @cached_property
    def local(self) -> dict[str, str]:
        """Texts of the local variables of the innermost frame, by name."""
        return self.scope("Locals")

    @property
    def line(self) -> int:
        """The line at which it stopped."""
        return int(self.frames[0]["line"])

    def scope(self, name: str) -> dict[str, str]:
        """Return the texts of the variables of a scope of the innermost frame, by name."""
        return self.session.scope(self.frames[0]["id"], name)

    def evaluate(self, text: str, context: str = "watch") -> str:
        """Return what an expression shows; 'watch', 'repl' or 'hover' is the context."""
        body = self.session.ask("evaluate", expression=text, frameId=self.frames[0]["id"], context=context)
        return str(body["result"])


Act = Callable[[Stop], str]
"""What is done at a stop: returns the request by which the program goes on; empty if it does so already."""


def go_on(_: Stop) -> str:
    """Let the program go on."""
    return "continue"


class Session:
    """The connection for one process.

    Args:
        editor: Knows the breakpoints, and what is done at a stop.
        link: A socket to the adapter.
        command: 'launch' or 'attach'.
        settings: Its arguments.
    """

    def __init__(self, editor: Editor, link: socket.socket, command: str, settings: dict[str, Any]) -> None:
        self._editor, self._link, self._count = editor, link, 0
        self._answers: dict[int, Future[dict[str, Any]]] = {}
        self._events: queue.Queue[dict[str, Any] | None] = queue.Queue()
        self._begin = command, settings
        self._sending = threading.Lock()
        self._receiver = threading.Thread(target=self._receive, daemon=True)
        self._receiver.start()
        threading.Thread(target=self._live, daemon=True).start()

    def send(self, command: str, **given: Any) -> Future[dict[str, Any]]:
        """Send a request; return its answer that is to come."""
        answer: Future[dict[str, Any]] = Future()
        self._put(answer, type="request", command=command, arguments=given)
        return answer

    def ask(self, command: str, **given: Any) -> dict[str, Any]:
        """Send a request, and return the body of its answer."""
        return self.send(command, **given).result(PATIENCE_S)

    def scope(self, frame: int, name: str) -> dict[str, str]:
        """Return the texts of the variables of a frame's scope, by name."""
        scopes = {each["name"]: each["variablesReference"] for each in self.ask("scopes", frameId=frame)["scopes"]}
        variables = self.ask("variables", variablesReference=scopes[name])["variables"]
        return {each["name"]: each["value"] for each in variables}

    # ---- inside ----

    def _put(self, answer: Future[dict[str, Any]] | None = None, **message: Any) -> None:
        with self._sending:
            self._count += 1
            if answer is not None:
                self._answers[self._count] = answer
            body = json.dumps({"seq": self._count, **message}).encode()
            self._link.sendall(b"Content-Length: %d\r\n\r\n" % len(body) + body)

    def _messages(self) -> Iterator[dict[str, Any]]:
        with self._link, self._link.makefile("rb") as file:
            while head := file.readline():
                file.readline()
                yield json.loads(file.read(int(head.split(b":")[1])))

    def _receive(self) -> None:
        with suppress(OSError, ValueError):
            for message in self._messages():
                if message["type"] == "event":
                    self._events.put(message)
                elif message["type"] == "request":
                    self._put(type="response", request_seq=message["seq"], success=True, command=message["command"])
                    # It asks for a session of another process; without that capability, `debugpyAttach` tells of it.
                    self._events.put({"event": message["command"], "body": message["arguments"]["configuration"]})
                elif message["type"] == "response":
                    answer = self._answers.pop(message["request_seq"])
                    if message["success"]:
                        answer.set_result(message.get("body", {}))
                    else:
                        answer.set_exception(RuntimeError(f"{message['command']}: {message.get('message')}"))
        for answer in self._answers.values():
            answer.cancel()
        self._events.put(None)

    def _live(self) -> None:
        can = dict.fromkeys(_CAN, True)
        named = {"adapterID": "python", "clientID": "vscode", "clientName": "Visual Studio Code", "locale": "en"}
        begins = {"pathFormat": "path", "linesStartAt1": True, "columnsStartAt1": True}
        self._capabilities = self.ask("initialize", **named, **begins, **can)
        command, settings = self._begin
        self.send(command, **settings)
        while (event := self._events.get()) is not None:
            try:
                self._take(event["event"], event.get("body", {}))
            except BaseException as error:
                self._editor.errors.append(error)
                break
            if event["event"] == "terminated":
                with suppress(OSError, CancelledError):
                    self.ask("disconnect", restart=False, terminateDebuggee=False)
                break
        with suppress(OSError):
            self._link.shutdown(socket.SHUT_RDWR)
        self._receiver.join()
        self._editor.note_end(self)

    def _take(self, event: str, body: dict[str, Any]) -> None:
        editor = self._editor
        if event == "initialized":
            for path, lines in editor.breakpoints.items():
                points = [each if isinstance(each, dict) else {"line": each} for each in lines]
                source = {"name": path.name, "path": str(path)}
                self.ask("setBreakpoints", source=source, breakpoints=points, sourceModified=False)
            if self._capabilities.get("supportsFunctionBreakpoints"):
                self.ask("setFunctionBreakpoints", breakpoints=[])
            self.ask("setExceptionBreakpoints", filters=["uncaught"], filterOptions=[])
            self.ask("configurationDone")
            self.ask("threads")
        elif event == "stopped":
            if command := editor.act(self._stop(body)):
                self.ask(command, threadId=body["threadId"])
        elif event == "output" and body.get("category") in ("stdout", "stderr"):
            editor.note_output(body["category"], body["output"])
        elif event in ("debugpyAttach", "startDebugging"):
            where = body["connect"]
            editor.begin(connect(where["host"], where["port"]), "attach", body)

    def _stop(self, body: dict[str, Any]) -> Stop:
        stop, stops = Stop(self, body["reason"], body["threadId"]), self._editor.stops
        if not any(each.session is self for each in stops):
            _ = stop.thread_name, stop.frames, stop.local
        stops.append(stop)
        return stop


@dataclass
class Editor:
    """A person's editor.

    Attributes:
        breakpoints: Lines by file, or what DAP has for a breakpoint.
        act: What is done at a stop.
        stops: The stops so far.
        output: What the programs have printed, as far as the editor gets it.
    """

    breakpoints: dict[Path, list[Any]]
    act: Act = go_on
    stops: list[Stop] = field(default_factory=list)
    output: str = ""
    errors: list[BaseException] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._sessions: list[Session] = []
        self._printed: dict[str, str] = {}
        self._ended: queue.Queue[Session] = queue.Queue()

    def launch(self, *words: str, cwd: Path, sub_process: bool = True, python: str = sys.executable) -> None:
        """Do what F5 does with a module and its arguments, to the end of all processes."""
        port = free_port()
        # What it prints is the program's, too.
        adapter = subprocess.Popen(
            [python, "-m", "debugpy.adapter", "--host", "127.0.0.1", "--port", str(port)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            settings = {
                "name": "kiks",
                "type": "debugpy",
                "request": "launch",
                "module": words[0],
                "args": [*words[1:]],
                "console": "internalConsole",
                "python": [python],
                "cwd": str(cwd),
                "subProcess": sub_process,
                "redirectOutput": True,
                "justMyCode": True,
                "env": {"PYTHONHASHSEED": "2000"},
            }
            self.begin(connect("127.0.0.1", port), "launch", settings)
            self.wait()
        finally:
            adapter.kill()
            adapter.wait()

    def attach(self, *words: str, cwd: Path, sub_process: bool = True, python: str = sys.executable) -> None:
        """Start `python -m debugpy --listen ... --wait-for-client -m WORDS`, attach, and stay to the end."""
        port = free_port()
        config = ["--configure-subProcess", str(sub_process)]
        environment = os.environ | {"PYTHONHASHSEED": "2000"}
        with subprocess.Popen(
            [python, "-m", "debugpy", "--listen", f"127.0.0.1:{port}", "--wait-for-client", *config, "-m", *words],
            cwd=cwd,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as program:
            self.attach_to(port, sub_process=sub_process)
            self.output = program.communicate(timeout=PATIENCE_S)[0]

    def attach_to(self, port: int, *, sub_process: bool = True) -> None:
        """Attach to a program that listens, and stay to the end of all its processes."""
        settings = {"name": "kiks", "type": "debugpy", "request": "attach", "justMyCode": True}
        settings |= {"connect": {"host": "127.0.0.1", "port": port}, "subProcess": sub_process}
        self.begin(connect("127.0.0.1", port), "attach", settings)
        self.wait()

    def begin(self, link: socket.socket, command: str, settings: dict[str, Any]) -> None:
        """Begin a session."""
        self._sessions.append(Session(self, link, command, settings))

    def note_output(self, category: str, text: str) -> None:
        """Note what a program has printed: pieces of a line on one stream may come between those on the other."""
        self._printed[category] = self._printed.get(category, "") + text
        self.output = "\n".join(self._printed.values())

    def note_end(self, session: Session) -> None:
        """Note that a session has ended."""
        self._ended.put(session)

    def wait(self) -> None:
        """Wait until all sessions have ended."""
        while self._sessions:
            self._sessions.remove(self._ended.get(timeout=PATIENCE_S))
        if self.errors:
            raise self.errors[0]

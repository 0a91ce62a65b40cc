"""A debug adapter: what editors such as VS Code connect to, over TCP, by the Debug Adapter Protocol.

The protocol is Microsoft's: https://microsoft.github.io/debug-adapter-protocol/specification
"""

from __future__ import annotations

import json
import os
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path
from typing import Any

from kiks.debug.code_lines import code_lines
from kiks.debug.session import COMMANDS, DebugSession, back_of
from kiks.errors import KiksError, LinkError
from kiks.ports.connection_user import connection_user

MESSAGE_BYTES_MAX = 4 << 20
"""Longest message of an editor."""

HEAD_BYTES_MAX = 200
"""Longest head of a message."""

ROBOT_STEP = 1000
"""Threads and frames of the program of robot 2 have numbers from twice this on, and so forth."""

CAPABILITIES = dict.fromkeys(
    (
        "supportsConfigurationDoneRequest",
        "supportsConditionalBreakpoints",
        "supportsHitConditionalBreakpoints",
        "supportsLogPoints",
        "supportsEvaluateForHovers",
        "supportsSetVariable",
        "supportsCompletionsRequest",
        "supportsExceptionInfoRequest",
        "supportsStepBack",
        "supportsTerminateRequest",
        "supportTerminateDebuggee",
        "supportsDelayedStackTraceLoading",
    ),
    True,
) | {
    "exceptionBreakpointFilters": [
        {"filter": "raised", "label": "Raised Exceptions", "default": False},
        {"filter": "uncaught", "label": "Uncaught Exceptions", "default": True},
    ]
}

Body = dict[str, Any]


class Adapter:
    """Listens for an editor, and does for it what a session can do.

    Args:
        port: The port on this computer; 0 takes a free one.
        session: The session.
        end: Ends the run, as the editor wants.

    Attributes:
        port: The port.
        is_configured: Set when an editor has come and has set its breakpoints.
    """

    def __init__(self, port: int, session: DebugSession, end: Callable[[], object]) -> None:
        self._session, self._end = session, end
        self._listener = socket.socket()
        try:
            self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._listener.bind(("127.0.0.1", port))
        except OSError as error:
            self._listener.close()
            raise LinkError(
                f"port {port} must be free for an editor, but it is not ({error.strerror}). Take another: --debug 5679."
            ) from None
        self._listener.listen(1)
        self.port = int(self._listener.getsockname()[1])
        self.is_configured = threading.Event()
        self._connection: socket.socket | None = None
        self._sending = threading.Lock()
        self._number = 0
        self._attached: Body | None = None
        threading.Thread(target=self._listen, name="kiks: debugger", daemon=True).start()

    def tell(self, event: str, body: Body) -> None:
        """Tell the editor of an event of the session."""
        if event == "stopped":
            body = {
                "reason": body["reason"],
                "threadId": body["robot"] * ROBOT_STEP + body["thread"],
                "allThreadsStopped": True,
                **({"text": body["text"], "description": body["text"]} if body["text"] else {}),
            }
        self._send({"type": "event", "event": event, "body": body})

    def close(self, code: int | None = None) -> None:
        """Tell the editor that the run has ended, and leave it."""
        if code is not None:
            self._send({"type": "event", "event": "exited", "body": {"exitCode": code}})
        self._send({"type": "event", "event": "terminated"})
        self._listener.close()
        if (connection := self._connection) is not None:
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    # ---- the connection ----

    def _listen(self) -> None:
        while True:
            try:
                connection, peer = self._listener.accept()
            except OSError:
                return
            with connection:
                # A client can do all that the owner of this process can.
                user = connection_user(peer, connection.getsockname())
                if sys.platform == "linux" and user not in (os.getuid(), 0):
                    continue
                self._connection = connection
                with suppress(OSError, ValueError):
                    for message in _messages(connection):
                        self._take(message)
                self._connection = None
            # A program must not wait for an editor that has left.
            self._leave()

    def _leave(self) -> None:
        self._attached = None
        self._session.leave()

    def _send(self, message: Body) -> None:
        with self._sending:
            self._number += 1
            data = json.dumps({"seq": self._number, **message}).encode()
            if (connection := self._connection) is not None:
                with suppress(OSError):
                    connection.sendall(b"Content-Length: %d\r\n\r\n%b" % (len(data), data))

    def _reply(self, request: Body, outcome: Body | KiksError) -> None:
        reply: Body = {"type": "response", "request_seq": request["seq"], "command": request["command"]}
        if isinstance(outcome, KiksError):
            reply |= {"success": False, "message": str(outcome)}
        else:
            reply |= {"success": True, "body": outcome}
        self._send(reply)

    def _take(self, request: Body) -> None:
        command, given = str(request["command"]), request.get("arguments") or {}
        outcome: Body | Future[Body] | KiksError | None
        try:
            outcome = self._do(request, command, given)
        except KiksError as error:
            outcome = error
        except (KeyError, TypeError, AttributeError) as error:
            outcome = KiksError(f"a request must have its arguments, but {command!r} has not: {error!r}.")
        if isinstance(outcome, Future):
            outcome.add_done_callback(lambda done: self._reply(request, _outcome_of(done)))
        elif outcome is not None:
            self._reply(request, outcome)
        if command == "disconnect":
            raise ConnectionError

    # ---- requests ----

    def _do(self, request: Body, command: str, given: Body) -> Body | Future[Body] | None:
        """Do what an editor asks; return None if the reply is sent already, or comes later."""
        session = self._session
        if command == "initialize":
            return CAPABILITIES
        if command in ("attach", "launch"):
            # As its editor expects, the reply comes when the editor has set its breakpoints.
            self._attached = request
            session.has_editor, session.stops_at_entry = True, bool(given.get("stopOnEntry"))
            self._send({"type": "event", "event": "initialized"})
            return None
        if command == "configurationDone":
            self._reply(request, {})
            if self._attached is not None:
                self._reply(self._attached, {})
            self.is_configured.set()
            return None
        if command == "setBreakpoints":
            return self._set_breakpoints(given)
        if command == "setFunctionBreakpoints":
            none = {"verified": False, "message": "Set it at a line of the function."}
            return {"breakpoints": [none for _ in given.get("breakpoints") or []]}
        if command == "setExceptionBreakpoints":
            session.set_filters([str(each) for each in given.get("filters") or []])
            return {}
        if command == "threads":
            return self._threads()
        if command in ("continue", "next", "stepIn", "stepOut", "stepBack", "reverseContinue"):
            self._reply(request, {"allThreadsContinued": True} if command == "continue" else {})
            if command == "stepBack":
                self._tell_failure(session.back())
            elif command == "reverseContinue":
                self._tell_failure(session.back(is_to_breakpoint=True))
            else:
                session.go_on(command)
            return None
        if command == "pause":
            session.ask("pause", {}, int(given.get("threadId") or 0) // ROBOT_STEP)
            return {}
        if command == "evaluate" and given.get("context") == "repl":
            text = str(given["expression"])
            if (how := back_of(text)) is not None:
                self._tell_failure(session.back(**how))
            if how is not None or text.strip() == "help":
                return {"result": "" if how else COMMANDS, "variablesReference": 0}
        if command in ("disconnect", "terminate"):
            if command == "terminate" or given.get("terminateDebuggee"):
                self._end()
            return {}
        if command in ("modules", "loadedSources"):
            return {command if command == "modules" else "sources": []}
        if command in _OF_PROGRAM:
            thread = int(given.get("threadId") or 0)
            if thread and session.stop is not None and thread // ROBOT_STEP != session.stop.robot:
                raise KiksError("a thread must stand still to be looked at, but it waits for the world. Go on first.")
            return session.ask(command, given | {"threadId": thread % ROBOT_STEP})
        raise KiksError(f"a request must be one that this debugger knows, but {command!r} is none.")

    def _threads(self) -> Body | Future[Body]:
        """Return the threads of the program that stands, and one for each other program."""
        stop, names = self._session.stop, dict(self._session.threads())
        if stop is None:
            return {"threads": [{"id": robot * ROBOT_STEP + 1, "name": name} for robot, name in names.items()]}
        others = [{"id": robot * ROBOT_STEP + 1, "name": name} for robot, name in names.items() if robot != stop.robot]
        named: Future[Body] = Future()

        def name(asked: Future[Body]) -> None:
            title = f"{names.get(stop.robot, '')}: " if others else ""
            found = _outcome_of(asked)
            own = [] if isinstance(found, KiksError) else found["threads"]
            own = [{"id": stop.robot * ROBOT_STEP + each["id"], "name": title + each["name"]} for each in own]
            named.set_result({"threads": own + others})

        self._session.ask("threads", {}, stop.robot).add_done_callback(name)
        return named

    def _set_breakpoints(self, given: Body) -> Body:
        source, wanted = given.get("source") or {}, given.get("breakpoints") or []
        file = str(source.get("path") or source.get("name") or "")
        lines = code_lines(Path(file))
        found, answers = [], []
        for each in wanted:
            line = next((line for line in lines if line >= each["line"]), None)
            if line is None:
                answers.append({"verified": False, "line": each["line"], "message": "No code stands here."})
            else:
                found.append(each | {"line": line})
                answers.append({"verified": True, "line": line})
        self._session.set_breakpoints(file, found)
        return {"breakpoints": answers}

    def _tell_failure(self, going: Future[Body]) -> None:
        """Tell the editor in its console why one cannot go back, and that the program still stands."""

        def tell(done: Future[Body]) -> None:
            if (error := done.exception()) is not None:
                self.tell("output", {"category": "stderr", "output": f"{error}\n"})
                if (stop := self._session.stop) is not None:
                    self.tell("stopped", vars(stop))

        going.add_done_callback(tell)


_OF_PROGRAM = frozenset(
    ("stackTrace", "scopes", "variables", "evaluate", "setVariable", "completions", "exceptionInfo", "source")
)


def _outcome_of(done: Future[Body]) -> Body | KiksError:
    try:
        return done.result()
    except KiksError as error:
        return error


def _messages(connection: socket.socket) -> Iterator[Body]:
    """Yield the messages of an editor.

    Raises:
        ValueError: If something else comes, such as the request of a browser.
    """
    with connection.makefile("rb") as stream:
        while head := stream.readline(HEAD_BYTES_MAX):
            name, _, size = head.partition(b":")
            if name.lower() != b"content-length" or not 0 < int(size) <= MESSAGE_BYTES_MAX:
                raise ValueError
            while stream.readline(HEAD_BYTES_MAX).strip():
                pass
            message = json.loads(stream.read(int(size)))
            if not (isinstance(message, dict) and {"seq", "command"} <= message.keys()):
                raise ValueError
            yield message

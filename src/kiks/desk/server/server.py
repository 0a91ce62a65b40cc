"""The web server of this process's desks; it runs in its own thread, which the first desk starts."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Coroutine
from contextlib import suppress
from typing import Any, TypeVar

import uvicorn
from fastapi import FastAPI, Response, WebSocket
from nicegui import app as nicegui_app
from nicegui import core, ui
from starlette.requests import Request
from starlette.responses import RedirectResponse

from kiks.desk.panels.page import Page
from kiks.desk.server.access import HEADERS, KEY, LOOPBACK, AccessControl, LimitedConnection, Visitors
from kiks.desk.server.desk import Desk
from kiks.desk.server.fair_share import FairShare
from kiks.desk.server.gateway import Gateway
from kiks.desk.server.page_guard import PageGuard, guard_messages
from kiks.desk.server.players import Players
from kiks.desk.server.public_address import PublicAddress
from kiks.desk.server.server_log import log_plainly
from kiks.desk.server.token import Token
from kiks.errors import LinkError, ParameterError
from kiks.model.limits import MESSAGE_BYTES_MAX
from kiks.ports.joining import PATH
from kiks.ports.resources import check_files, opening

PORT = 8123
"""Default TCP port."""

START_S = 30.0
"""Timeout of the server's start [s]; a busy computer needs seconds."""

FILES = 32
"""Open files that it needs with a page and a program."""

BACKLOG = 128
"""Maximum number of connections that wait to be accepted."""

EVERY_ADDRESS = ("0.0.0.0", "::")
"""Wildcard addresses; a URL for a browser must not contain them."""

CLOSED = "KiKS: this desk is closed. Open it again where it was opened."

Done = TypeVar("Done")


class DeskServer:
    """Serves desks to browsers.

    NiceGUI has one application per process, so there is one server per process: `SERVER`.

    Attributes:
        desks: The gateways of the open desks by number.
        key: The token that browsers of the owner must know.
        visitors: The tokens that open it beside the owner's.
        players: Lets programs elsewhere take robots; None: none may.
    """

    players: Players | None = None

    def __init__(self) -> None:
        self.desks: dict[int, Gateway] = {}
        self.key = Token()
        self.visitors = Visitors()
        self._is_local = True
        self._count = 0
        self._socket: socket.socket | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._lock = threading.Lock()

    def start(self, *, host: str = "127.0.0.1", port: int | None = None, public: PublicAddress | None = None) -> None:
        """Start the server unless it runs already.

        Args:
            host: Address to listen at.
            port: TCP port, 0 for a free one; if left out, `PORT`, or a free one if that is taken.
            public: The address that people open, if a proxy stands before it; that of before if left out.

        Raises:
            LinkError: If it cannot listen there.
        """
        with self._lock:
            if self._socket is not None:
                if port not in (None, 0, self.port):
                    raise ParameterError(
                        f"port must be that of the desk that is open, {self.url()}, but it was {port}."
                    )
                self.visitors.public = public.at(self.port) if public else self.visitors.public
                return
            check_files("the desk", FILES)
            self._is_local = host in LOOPBACK
            self._socket = _listen(host, PORT, or_free=True) if port is None else _listen(host, port)
            self.visitors.public = public.at(self.port) if public else None
            begun = threading.Event()
            threading.Thread(target=self._serve, args=(begun,), name="kiks desk", daemon=True).start()
            if not begun.wait(START_S) or self._loop is None:
                self._socket.close()
                self._socket = None
                raise LinkError(
                    f"the desk must begin to serve within {START_S:g} s, but it did not. Look above for the reason."
                )

    def open(self, desk: Desk, number: int | None = None) -> Gateway:
        """Make a desk available to browsers; `start` must have been called.

        Args:
            desk: The desk.
            number: Its number in its address, which no other has had; the next one if left out.
        """
        with self._lock:
            number = self._count + 1 if number is None else number
            self._count = max(self._count, number)
            gateway = self.desks[number] = Gateway(desk, number)
            assert self._loop is not None
            asyncio.run_coroutine_threadsafe(gateway.run(), self._loop)
        return gateway

    def close(self, gateway: Gateway) -> None:
        """Remove a desk from the server and close it."""
        self.desks.pop(gateway.number, None)
        assert self._loop is not None
        self._loop.call_soon_threadsafe(gateway.close)
        gateway.desk.close()

    def url(self, number: int | None = None) -> str:
        """Return the URL of a desk, or of the newest one, with the token."""
        return f"{self.address()}{_page(number)}?token={self.key.token}"

    def url_for_once(self, number: int) -> str:
        """Return a URL of a desk that works once, for a browser of this user: other users may see it.

        It leads past a proxy, whose connections are not this user's.
        """
        return f"http://{self.place()}{self.visitors.path}/{_page(number)}?ticket={self.key.new_ticket()}"

    def address(self) -> str:
        """Return the address under which people reach this server, with a slash at its end."""
        return f"http://{self.place()}/" if self.visitors.public is None else self.visitors.public.url

    @property
    def port(self) -> int:
        """The TCP port."""
        assert self._socket is not None
        return int(self._socket.getsockname()[1])

    def place(self) -> str:
        """Return the host and the port under which other computers reach this server without a proxy."""
        assert self._socket is not None
        host, port = self._socket.getsockname()[:2]
        host = _own_address(self._socket.family) if host in EVERY_ADDRESS else host
        host = f"[{host}]" if ":" in host else host
        return f"{host}:{port}"

    def let_in(self, players: Players) -> None:
        """Let programs elsewhere take the robots of a desk from now on."""
        self.players = players
        self.visitors.bearers[PATH] = list(players.robots)

    @property
    def is_running(self) -> bool:
        """Whether it listens."""
        return self._loop is not None

    def run(self, work: Coroutine[Any, Any, Done]) -> Done:
        """Run a coroutine in the server's thread, and return its result; from any other thread."""
        assert self._loop is not None
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    # ---- inside ----

    def _serve(self, begun: threading.Event) -> None:
        """Run the web server in its own thread."""
        plain = log_plainly()
        app = FastAPI(openapi_url=None)
        self._add_routes(app)
        # Quasar's bar has no name, and shows a request on the colour of the bar above the arena.
        nicegui_app.config.quasar_config["loadingBar"] = {"skipHijack": True}
        ui.run_with(app, title="KiKS", dark=None, language="en-US", show_welcome_message=False, reconnect_timeout=10.0)
        guard_messages(core.sio)

        def begin() -> None:
            self._loop = asyncio.get_running_loop()
            self._loop.set_exception_handler(lambda _, fault: plain.note(fault["message"], fault.get("exception")))
            begun.set()

        nicegui_app.on_startup(begin)
        config = uvicorn.Config(
            AccessControl(FairShare(PageGuard(app)), self.key, is_local=self._is_local, visitors=self.visitors),
            http=LimitedConnection,
            headers=HEADERS,
            # uvloop ends the process when there is no file descriptor for its loop.
            loop="asyncio",
            backlog=BACKLOG,
            # Who came is asked of the connection, never of what a client says of itself.
            proxy_headers=False,
            log_config=None,
            access_log=False,
            lifespan="on",
            ws="websockets-sansio",
            ws_max_size=MESSAGE_BYTES_MAX,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=1,
        )
        assert self._socket is not None
        try:
            uvicorn.Server(config).run(sockets=[self._socket])
        finally:
            begun.set()

    def _add_routes(self, app: FastAPI) -> None:
        @app.get("/")
        def newest(request: Request) -> Response:
            own = request.scope[KEY].desk
            number = max(self.desks, default=None) if own is None else own
            if number is None:
                return Response(CLOSED, media_type="text/plain")
            return RedirectResponse(f"desk/{number}")

        @app.get("/desk/{number}/arena/{scene}.png")
        def picture(number: int, scene: int) -> Response:
            gateway = self.desks.get(number)
            if gateway is None:
                return Response(status_code=404)
            return Response(gateway.picture(), media_type="image/png", headers={"cache-control": "no-store"})

        @app.get("/desk/{number}/engine.wasm")
        def engine(number: int) -> Response:
            from kiks.export.browser_engine import ENGINE

            return Response(ENGINE.read_bytes(), media_type="application/wasm", headers={"cache-control": "no-store"})

        @app.websocket(PATH)
        async def robot(socket: WebSocket) -> None:
            assert self.players is not None
            await self.players.serve(socket, socket.scope[KEY])

        @app.websocket("/desk/{number}/feed")
        async def feed(socket: WebSocket, number: int) -> None:
            gateway = self.desks.get(number)
            if gateway is None:
                await socket.close()
            else:
                await gateway.serve(socket)

        @ui.page("/desk/{number}")
        def page(number: int) -> None:
            gateway = self.desks.get(number)
            if gateway is None:
                ui.label(CLOSED)
            else:
                Page(gateway.desk, gateway.editing, number)


def _page(number: int | None) -> str:
    return "" if number is None else f"desk/{number}"


def _own_address(family: socket.AddressFamily) -> str:
    """Return the address under which other computers reach this one; its name if it has none."""
    # An address reserved for documentation: connecting sends nothing, but picks the local address.
    far = "2001:db8::1" if family == socket.AF_INET6 else "192.0.2.1"
    with suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as asking:
        asking.connect((far, 9))
        return str(asking.getsockname()[0])
    return socket.gethostname()


def _listen(host: str, port: int, *, or_free: bool = False) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with opening("the desk's port"):
        listening = socket.socket(family)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((host, port))
        listening.listen(BACKLOG)
    except (OSError, OverflowError) as error:
        listening.close()
        if or_free:
            return _listen(host, 0)
        raise LinkError(
            f"the desk must be able to listen at {host}:{port}, but it cannot ({error}). Give another --port or --host."
        ) from None
    return listening


SERVER = DeskServer()
"""The process's server."""

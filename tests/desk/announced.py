"""A server that prints its address when it listens, for pages that run as programs."""

from __future__ import annotations

from typing import Any

import uvicorn
from fastapi import FastAPI


class _Announced(uvicorn.Server):
    async def startup(self, sockets: Any = None) -> None:
        await super().startup(sockets)
        host, port = self.servers[0].sockets[0].getsockname()
        print(f"http://{host}:{port}", flush=True)


def serve(app: FastAPI) -> None:
    """Serve an application at a free port until the process is ended."""
    _Announced(uvicorn.Config(app, "127.0.0.1", 0, log_level="warning")).run()

"""Firefox for Playwright: starts it, and stands between the two, as Playwright tells more than Firefox understands.

Playwright speaks WebDriver BiDi with a Firefox that is not its own build. It asks for a colour scheme at the start of
each context, and takes no for a failure; Firefox has no such command yet. Run as a program, in place of Firefox.
"""

import asyncio
import json
import re
import shlex
import shutil
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from websockets.asyncio.client import connect
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")

UNKNOWN = ("emulation.setMediaFeaturesOverride",)
"""Commands that Firefox does not know; what they ask for may be left undone."""


def firefox(playwright: Any, folder: Path) -> Any:
    """Start Firefox with the relay, whose command is written into a folder; return the browser."""
    command = folder / "firefox"
    command.write_text(f'#!/bin/sh\nexec {shlex.join([sys.executable, __file__])} "$@"\n')
    command.chmod(0o755)
    return playwright.firefox.launch(channel="moz-firefox", executable_path=command)


async def run(words: list[str]) -> int:
    """Run Firefox, with a relay at the address of its own that is printed in place of Firefox's."""
    # Firefox ends with this program, whose process group Playwright ends.
    firefox = await asyncio.create_subprocess_exec(str(FIREFOX), *words, stderr=asyncio.subprocess.PIPE)
    assert firefox.stderr is not None
    async for line in firefox.stderr:
        if found := re.search(rb"WebDriver BiDi listening on (ws://\S+)", line):
            break
    else:
        return await firefox.wait()
    address = found[1].decode()

    async def relay(playwright: ServerConnection) -> None:
        assert playwright.request is not None
        async with connect(address + playwright.request.path, max_size=None, compression=None) as browser:

            async def pass_on() -> None:
                async for text in browser:
                    await playwright.send(text)

            back = asyncio.create_task(pass_on())
            with suppress(ConnectionClosed):
                async for text in playwright:
                    command = json.loads(text)
                    if command["method"] in UNKNOWN:
                        await playwright.send(json.dumps({"type": "success", "id": command["id"], "result": {}}))
                    else:
                        await browser.send(text)
            back.cancel()

    async with serve(relay, "127.0.0.1", 0, max_size=None, compression=None) as server:
        port = server.sockets[0].getsockname()[1]
        print(f"WebDriver BiDi listening on ws://127.0.0.1:{port}", file=sys.stderr, flush=True)
        async for _ in firefox.stderr:
            pass
        return await firefox.wait()


if __name__ == "__main__":
    sys.exit(asyncio.run(run(sys.argv[1:])))

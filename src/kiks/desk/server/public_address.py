"""The address under which people reach a server that stands behind a proxy, such as https://school.example/robots/."""

from __future__ import annotations

import importlib.util
import os
import re
from collections.abc import Mapping
from typing import NamedTuple
from urllib.parse import urlsplit

from kiks.errors import ParameterError, shown

VARIABLE = "KIKS_ADDRESS"
"""The variable of the environment with the address for notebooks."""

HUB = "JUPYTERHUB_SERVICE_PREFIX"
"""The variable with the path of a person's server on a JupyterHub (JupyterHub's reference, "services")."""

ELSEWHERE = {
    HUB: "a JupyterHub",
    "COLAB_RELEASE_TAG": "Colab",
    "CODESPACES": "Codespaces",
    "KAGGLE_KERNEL_RUN_TYPE": "Kaggle",
}
"""Variables that say that a kernel is on another computer than the browser, and what that is called."""

_PATH = re.compile(r"(/([\w.~@-]|{port})+)*/?", re.ASCII)


class PublicAddress(NamedTuple):
    """What a proxy offers; `{port}` stands for the server's TCP port.

    Attributes:
        url: The address, with a slash at its end; without a host if a page leads there that knows its own.
        name: Name of the computer in it; None if it is not known.
        path: Its path, without a slash at its end: the proxy may leave it away or hand it on.
        is_secure: Whether the proxy speaks TLS.
    """

    url: str
    name: str | None
    path: str
    is_secure: bool

    def admits(self, name: str) -> bool:
        """Return whether a request for a computer of this name may have come by the proxy."""
        return self.name is None or name == self.name

    def at(self, port: int) -> PublicAddress:
        """Return the address of the server at a TCP port."""
        url, name, path = (text and text.replace("{port}", str(port)) for text in self[:3])
        return PublicAddress(url or "", name, path or "", self.is_secure)


def public_address(address: str, name: str = "--address") -> PublicAddress:
    """Check and read an address that a person has given.

    Args:
        address: The address: whole, or only its path for a frame in a page of the same host.
        name: How a message calls it.

    Example:
        >>> public_address("https://school.example/robots")
        PublicAddress(url='https://school.example/robots/', name='school.example', path='/robots', is_secure=True)
    """
    try:
        url = urlsplit(address)
        url.port  # noqa: B018 # raises if it is none
        is_whole = url.scheme in ("http", "https") and bool(url.hostname) and url.username is None
        is_right = (is_whole or (address.startswith("/") and not url.netloc)) and _PATH.fullmatch(url.path)
    except ValueError:
        is_right = None
    if not is_right or url.query or url.fragment:
        raise ParameterError(
            f"{name} must be the address that people open, as https://school.example/robots/, but it was "
            f"{shown(address)}. Give it as the proxy has it, without ? and #."
        )
    path = url.path.rstrip("/")
    start = f"{url.scheme}://{url.netloc}" if is_whole else ""
    return PublicAddress(f"{start}{path}/", url.hostname, path, url.scheme == "https")


def address_for_notebooks(
    given: str | None = None, environment: Mapping[str, str] = os.environ
) -> PublicAddress | None:
    """Return the address of a desk for the browser of a notebook; None if that is the computer of the kernel.

    Args:
        given: The address that a person has given.
        environment: The environment of the kernel.
    """
    if given is not None:
        return public_address(given, "address")
    if text := environment.get(VARIABLE):
        return public_address(text, VARIABLE)
    if HUB in environment and importlib.util.find_spec("jupyter_server_proxy"):
        return public_address(f"{environment[HUB].rstrip('/')}/proxy/{{port}}/", HUB)
    return None


def why_unreachable(environment: Mapping[str, str] = os.environ) -> str:
    """Return why the browser of a notebook does not reach a desk of its kernel; empty if it may."""
    place = next((place for name, place in ELSEWHERE.items() if name in environment), "")
    return place and (
        f"This is a picture: the kernel is on {place}, where your browser does not reach the desk. Install "
        f"jupyter-server-proxy there, or give the address that leads to it, as sim.show(address=...) or in {VARIABLE}."
    )

"""Proxies that offer a desk below a path, and notebooks whose kernel is on another computer than the browser."""

import re
import shutil
import socket
import ssl
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from tests.at_length import at_length
from tests.desk.visitor import NewPage, Visitor, open_desk, open_page
from tests.guard import GUARD_S

from kiks.desk.server.public_address import address_for_notebooks, public_address, why_unreachable
from kiks.desk.server.server import SERVER
from kiks.errors import ParameterError

HUB = {"JUPYTERHUB_SERVICE_PREFIX": "/user/ada/"}

NGINX = """
daemon off; pid {folder}/pid; error_log stderr; worker_processes 1;
events {{ }}
http {{
  access_log off; client_body_temp_path {folder}/body; proxy_temp_path {folder}/proxy;
  fastcgi_temp_path {folder}/f; uwsgi_temp_path {folder}/u; scgi_temp_path {folder}/s;
  map $http_upgrade $connection_upgrade {{ default upgrade; '' close; }}
  server {{
    listen 127.0.0.1:{port} ssl; ssl_certificate {folder}/cert.pem; ssl_certificate_key {folder}/key.pem;
    location /robots/ {{
      proxy_pass http://127.0.0.1:{to}/; proxy_http_version 1.1; proxy_set_header Host $http_host;
      proxy_set_header X-Forwarded-Prefix /robots; proxy_set_header X-Forwarded-For $remote_addr;
      proxy_set_header Upgrade $http_upgrade; proxy_set_header Connection $connection_upgrade;
    }}
  }}
}}
"""


@pytest.mark.parametrize(
    ("given", "url", "name", "path"),
    [
        ("https://school.example", "https://school.example/", "school.example", ""),
        ("https://school.example:8443/robots/", "https://school.example:8443/robots/", "school.example", "/robots"),
        ("http://[::1]:80/a/b-c", "http://[::1]:80/a/b-c/", "::1", "/a/b-c"),
        ("https://ada-{port}.example/", "https://ada-8123.example/", "ada-8123.example", ""),
        ("/user/ada@school.example/proxy/{port}/", "/user/ada@school.example/proxy/8123/", None, None),
    ],
)
def test_addresses_are_read(given: str, url: str, name: str | None, path: str | None) -> None:
    read = public_address(given).at(8123)
    assert (read.url, read.name, read.path) == (url, name, url.rstrip("/") if path is None else path)
    assert read.is_secure == given.startswith("https:")
    assert read.admits("school.example") == (name in (None, "school.example"))


@pytest.mark.parametrize(
    "given",
    [
        *("", "school.example", "ftp://a.example/", "https://", "https://a.example/?x=1", "https://a.example/#x"),
        *("https://a.example:99999/", "https://me@a.example/", "https://a.example/<b>", "https://a.example//x"),
        *("//b/c/", "/a/\n/"),
    ],
)
def test_other_addresses_are_refused(given: str) -> None:
    with pytest.raises(ParameterError, match="--address must be the address that people open, as https://school"):
        public_address(given)


def test_notebooks_find_their_way(monkeypatch: pytest.MonkeyPatch) -> None:
    def way(given: str | None = None, *, has_proxy: bool = False, **environment: str) -> str | None:
        monkeypatch.setattr("importlib.util.find_spec", lambda name: name if has_proxy else None)
        found = address_for_notebooks(given, environment)
        return None if found is None else found.at(8123).url

    assert way() is None
    assert way(**HUB) is None
    assert way(has_proxy=True) is None
    assert way(has_proxy=True, **HUB) == "/user/ada/proxy/8123/"
    assert way(has_proxy=True, KIKS_ADDRESS="https://a.example/{port}", **HUB) == "https://a.example/8123/"
    assert way("https://b.example", KIKS_ADDRESS="https://a.example/") == "https://b.example/"
    with pytest.raises(ParameterError, match="KIKS_ADDRESS must be the address that people open"):
        way(KIKS_ADDRESS="a.example")
    assert why_unreachable({}) == ""
    assert "the kernel is on a JupyterHub, where" in why_unreachable(HUB)


def test_a_notebook_that_does_not_reach_its_desk_shows_a_picture(shown: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    assert shown._repr_html_().startswith('<iframe src="http://127.0.0.1')
    monkeypatch.setenv("COLAB_RELEASE_TAG", "release")
    assert re.match(
        "<p>This is a picture: the kernel is on Colab.*<img.*base64,[A-Za-z0-9+/]{1000}", shown._repr_html_()
    )


# ---- through proxies ----


class PathProxy:
    """A proxy that offers the server of this process below /robots, a request for each connection.

    Args:
        strips: Whether the server gets paths without /robots.
    """

    def __init__(self, *, strips: bool = True) -> None:
        self._strips = strips
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self.address = public_address(f"http://localhost:{self.port}/robots/")
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        with suppress(OSError):
            while True:
                threading.Thread(target=self._pass_on, args=self._listener.accept()[:1], daemon=True).start()

    def _pass_on(self, browser: socket.socket) -> None:
        with suppress(OSError), browser, socket.create_connection(("127.0.0.1", SERVER.port)) as server:
            head = b""
            while b"\r\n\r\n" not in head and (data := browser.recv(65536)):
                head += data
            path = b"/" if self._strips else b"/robots/"
            head = head.replace(b" /robots/", b" " + path, 1)
            if b"upgrade: websocket" not in head.lower():
                head = re.sub(b"(?i)\r\nconnection: [^\r]*", b"\r\nConnection: close", head)
            server.sendall(head.replace(b"\r\n", b"\r\nX-Forwarded-Prefix: /robots\r\n", 1))
            back = threading.Thread(target=pump, args=(server, browser), daemon=True)
            back.start()
            pump(browser, server)
            back.join()

    def close(self) -> None:
        self._listener.close()


def pump(one: socket.socket, other: socket.socket) -> None:
    """Send on what comes, and the end of it."""
    with suppress(OSError):
        while data := one.recv(65536):
            other.sendall(data)
        other.shutdown(socket.SHUT_WR)


@contextmanager
def nginx(folder: Path) -> Iterator[int]:
    """Start nginx with TLS before the server; return its port."""
    words = ["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=localhost"]
    subprocess.run(["openssl", *words, "-keyout", folder / "key.pem", "-out", folder / "cert.pem"], check=True)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    (folder / "conf").write_text(NGINX.format(folder=folder, port=port, to=SERVER.port))
    with subprocess.Popen(["nginx", "-c", folder / "conf"]) as process:
        try:
            while True:
                with suppress(ConnectionRefusedError), socket.create_connection(("127.0.0.1", port)) as raw:
                    insecure = ssl._create_unverified_context()
                    insecure.wrap_socket(raw).close()
                    break
            yield port
        finally:
            process.terminate()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["strips", *(pytest.param(each, marks=at_length) for each in ("hands on", "nginx"))])
def test_a_desk_behind_a_proxy_at_a_path_draws_and_is_dragged(kind: str, tmp_path: Path, new_page: NewPage) -> None:
    if kind == "nginx" and not (shutil.which("nginx") and shutil.which("openssl")):
        pytest.skip("nginx is not here: apt-get install nginx-light openssl")
    with ExitStack() as stack:
        shown = open_desk(tmp_path)
        stack.callback(shown.close)
        if kind == "nginx":
            port, scheme = stack.enter_context(nginx(tmp_path)), "https"
        else:
            port, scheme = stack.enter_context(closing(PathProxy(strips=kind == "strips"))).port, "http"
        stack.callback(setattr, SERVER.visitors, "public", None)
        SERVER.start(public=public_address(f"{scheme}://localhost:{port}/robots/"))
        shown.url = SERVER.url(shown.gateway.number)
        assert shown.url.startswith(f"{scheme}://localhost:{port}/robots/desk/")
        visitor = Visitor(new_page(ignore_https_errors=True), shown)
        visitor.drag((150, 200), (250, 250))
        assert visitor.sim.pose(1)[:2] == pytest.approx((250, 250), abs=1)
        visitor.tab("wire")  # a part of the page that NiceGUI's own connection brings
        # A browser of this computer needs no proxy.
        open_page(new_page(), SERVER.url_for_once(shown.gateway.number))


@at_length
def test_a_desk_in_a_notebook_of_a_jupyterhub_draws_and_is_dragged(tmp_path: Path, new_page: NewPage) -> None:
    pytest.importorskip("jupyterhub", reason="pip install jupyterhub notebook jupyter-server-proxy")
    if (proxy := shutil.which("configurable-http-proxy")) is None:
        pytest.skip("JupyterHub's proxy is not here: npm install -g configurable-http-proxy")
    run_hub(tmp_path, proxy, lambda url: drag_in_notebook(new_page(), url))


def run_hub(folder: Path, proxy: str, visit: Callable[[str], None]) -> None:
    """Start a JupyterHub with a notebook that shows a desk, and visit it."""
    with ExitStack() as stack:
        ports = [stack.enter_context(socket.create_server(("127.0.0.1", 0))).getsockname()[1] for _ in range(3)]
    bins = Path(sys.executable).parent
    (folder / "config.py").write_text(f"""
c = get_config()
c.JupyterHub.bind_url = "http://127.0.0.1:{ports[0]}/"
c.JupyterHub.hub_port = {ports[1]}
c.ConfigurableHTTPProxy.api_url = "http://127.0.0.1:{ports[2]}"
c.ConfigurableHTTPProxy.command = {proxy!r}
c.JupyterHub.authenticator_class = "dummy"
c.Authenticator.allow_all = True
c.JupyterHub.spawner_class = "simple"
c.Spawner.args = ["--allow-root"]
c.Spawner.notebook_dir = {str(folder)!r}
c.Spawner.cmd = ["{bins}/jupyterhub-singleuser"]
""")
    code = "import kiks\nshown = kiks.Simulation(kiks.Arena.box(400, 400)).show(is_alive=True)"
    import nbformat

    cells = [nbformat.v4.new_code_cell(code)]
    nbformat.write(nbformat.v4.new_notebook(cells=cells), folder / "n.ipynb")
    command = [bins / "jupyterhub", "-f", folder / "config.py"]
    with subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stderr is not None
            next(line for line in process.stderr if "is now running" in line)
            threading.Thread(target=process.stderr.read, daemon=True).start()
            visit(f"http://127.0.0.1:{ports[0]}")
        finally:
            process.terminate()


def drag_in_notebook(page: Any, url: str) -> None:
    page.goto(f"{url}/hub/login")
    page.fill("#username_input", "ada")
    page.fill("#password_input", "any")
    page.click("#login_submit")
    page.wait_for_url("**/user/ada/**")
    page.goto(f"{url}/user/ada/notebooks/n.ipynb")
    page.locator(".jp-CodeCell .cm-content").click()
    page.get_by_text("Python 3 (ipykernel)").wait_for()
    page.keyboard.press("Shift+Enter")
    element = page.wait_for_selector(".jp-OutputArea iframe", timeout=1000 * GUARD_S)
    frame = element.content_frame()
    frame.wait_for_function("() => window.kiksDesk?.stats().frames_drawn > 1 && kiksDesk.pose(0)")
    element.scroll_into_view_if_needed()
    box, (x, y) = (
        element.bounding_box(),
        frame.evaluate("kiksDesk.toClient(kiksDesk.pose(0).x_mm, kiksDesk.pose(0).y_mm)"),
    )
    before = frame.evaluate("kiksDesk.pose(0).x_mm")
    page.mouse.move(box["x"] + x, box["y"] + y)
    page.mouse.down()
    page.mouse.move(box["x"] + x + 60, box["y"] + y, steps=8)
    page.mouse.up()
    frame.wait_for_function(f"() => kiksDesk.pose(0).x_mm > {before} + 20")

"""The token in a real browser: it leaves the address, lasts for the page, and works within a notebook's page."""

import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import urlsplit

import pytest
from tests.at_length import at_length
from tests.desk.visitor import FIRST_PICTURE, Browser, NewPage, Shown, Visitor, expect, leave_picture, open_page

pytestmark = pytest.mark.slow


def test_the_token_moves_from_the_address_to_a_cookie(visitor: Visitor, shown: Shown) -> None:
    from kiks.desk.server.server import SERVER

    assert "token" not in visitor.page.url
    assert SERVER.key.token not in visitor.page.content()
    assert "token" not in visitor.answer("document.cookie")
    assert visitor.page.url.startswith(shown.url.split("/desk/")[0] + SERVER.key.place)
    visitor.page.reload()
    visitor.page.wait_for_function(FIRST_PICTURE)
    visitor.picture("with_the_token")


def test_other_servers_of_this_computer_never_get_the_token(visitor: Visitor, notebook: tuple[int, list[str]]) -> None:
    port, cookies = notebook
    # A page of the same browser, which may ask for an icon when that server has gone.
    page = visitor.page.context.new_page()
    for path in ("/desk/1", "/desk/1/feed", "/_nicegui_ws/socket.io/", ""):
        page.goto(f"http://127.0.0.1:{port}{path}")
    page.close()
    assert len(cookies) >= 4
    assert "token" not in "".join(cookies)


def test_a_ticket_opens_the_desk_once(new_page: NewPage, browser: Browser, shown: Shown) -> None:
    from kiks.desk.server.server import SERVER

    url = SERVER.url_for_once(shown.gateway.number)
    page = new_page()
    open_page(page, url)
    assert "ticket" not in page.url
    other = browser.new_page()
    assert other.goto(url).status == 403
    other.close()


@pytest.fixture
def notebook(shown: Shown) -> Iterator[tuple[int, list[str]]]:
    """The port of a server whose pages show the desk within theirs, and the cookies that come with each request."""
    cookies: list[str] = []

    class Answer(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            cookies.append(self.headers.get("cookie", ""))
            body = shown._repr_html_().encode() if self.path == "/" else b""
            self.send_response(200)
            self.send_header("content-type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!doctype html><title>Notebook</title>" + body)

        def log_message(self, *_words: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Answer) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server.server_port, cookies
        server.shutdown()


@at_length
@pytest.mark.parametrize("host", ["localhost", "127.0.0.1"])
def test_a_notebook_shows_the_desk(browser: Browser, new_page: NewPage, shown: Shown, notebook: Any, host: str) -> None:
    page = new_page(by=browser)
    page.goto(f"http://{host}:{notebook[0]}/")
    frame = next(each for each in page.frames if each.parent_frame is not None)
    frame.wait_for_function(FIRST_PICTURE)
    assert urlsplit(frame.url).query == ""
    # Its buttons work, too: at localhost the frame is another site's, and Chromium denies it all memory of its own.
    frame.get_by_test_id("run").click()
    expect(frame.get_by_test_id("run")).to_have_text("play_arrow")
    assert shown.desk.gate.is_paused
    leave_picture(page, f"notebook_{host}")

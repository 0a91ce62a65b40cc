"""The site of the documentation in the browser: it builds without a warning, fits a phone and shows its pictures."""

import functools
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from tests.at_length import at_length
from tests.desk.visitor import NewPage, check_access

pytestmark = [pytest.mark.slow, at_length]

ROOT = Path(__file__).parents[2]
PAGES = (
    *("index", "start", "tutorials/desk", "howto/demos", "reference/simulation", "reference/files", "coming_from"),
    *("gallery/index", "gallery/scripts/film", "notebooks/first_steps"),
)


class QuietHandler(SimpleHTTPRequestHandler):
    """Serves files without a log."""

    def log_message(self, *_: object) -> None:
        pass


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """Serve the files of a folder; return the address."""
    with ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(QuietHandler, directory=folder)) as server:
        threading.Thread(target=server.serve_forever).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Build the site and serve it: search reads pages by requests, which a browser allows for files only in part."""
    folder = tmp_path_factory.mktemp("site")
    command = (sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-d", folder / "state")
    result = subprocess.run([*command, ROOT / "docs", folder / "html"], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    with served(folder / "html") as site:
        yield site


@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("colours", ["light", "dark"])
def test_pages_fit_and_show_their_pictures(site: str, new_page: NewPage, width: int, colours: str) -> None:
    page = new_page(width, 844, color_scheme=colours)
    for name in PAGES:
        page.goto(f"{site}/{name}.html")
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), name
        assert page.evaluate("[...document.images].every(image => image.complete && image.naturalWidth > 0)"), name


def test_axe_finds_nothing_serious(site: str, new_page: NewPage) -> None:
    page = new_page()
    others = "howto/evolution", "explanation/security"
    for name in ("index", "gallery/index", "gallery/scripts/film", "howto/demos", "coming_from", *others):
        page.goto(f"{site}/{name}.html")
        for colours in ("light", "dark"):
            page.emulate_media(color_scheme=colours)
            check_access(page, f"{name}, {colours}")


def test_search_finds_a_name(site: str, new_page: NewPage) -> None:
    page = new_page()
    page.goto(f"{site}/search.html?q=travelled_mm")
    page.locator(".pagefind-ui__result-link").first.wait_for()
    assert "simulation.html" in (page.locator(".pagefind-ui__result-link").first.get_attribute("href") or "")

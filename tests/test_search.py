"""The search of the site, as a visitor uses it: what is typed leads to the right page. `make docs` makes the site."""

from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest
from tests.desk.conftest import browser, context, new_page, playwright
from tests.desk.visitor import NewPage

__all__ = ["browser", "context", "new_page", "playwright"]

ROOT = Path(__file__).parents[1]
SITE, QUESTIONS = ROOT / "build" / "docs", ROOT / "tests" / "search_questions.txt"

RESULTS = "#search a.pagefind-ui__result-link"


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None: ...


@pytest.fixture(scope="module")
def site() -> Iterator[str]:
    index = SITE / "pagefind" / "pagefind-entry.json"
    made_s = index.stat().st_mtime if index.exists() else 0.0
    if made_s < max(path.stat().st_mtime for path in (ROOT / "docs").rglob("*.md")):
        pytest.skip("the site is not as new as its pages: make docs")
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(SITE))) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


def test_what_visitors_type_leads_to_the_right_page(site: str, new_page: NewPage) -> None:
    lines = [line for line in QUESTIONS.read_text().splitlines() if not line.startswith("#")]
    asked = [tuple(map(str.strip, line.rsplit(maxsplit=1))) for line in lines]
    assert len(asked) == 30
    page, missed = new_page(), {}
    page.goto(f"{site}/start.html")
    for question, answer in asked:
        page.locator("input.sidebar-search").fill(question)
        page.locator("input.sidebar-search").press("Enter")
        page.locator(RESULTS).first.wait_for()
        found = page.locator(".pagefind-ui__result-title > a").evaluate_all("links => links.map(link => link.pathname)")
        if f"/{answer}.html" not in found[:3]:
            missed[question] = found[:3]
    assert not missed

"""The search of the site, as a visitor uses it: what is typed leads to the right page. `make docs` makes the site."""

from pathlib import Path

import pytest
from tests.desk.conftest import browser, context, new_page, playwright
from tests.desk.visitor import NewPage

__all__ = ["browser", "context", "new_page", "playwright"]

ROOT = Path(__file__).parents[1]
SITE = ROOT / "build" / "docs"


@pytest.mark.slow
def test_what_visitors_type_leads_to_the_right_page(new_page: NewPage) -> None:
    newest_s, index = max(path.stat().st_mtime for path in (ROOT / "docs").rglob("*.md")), SITE / "pagefind/pagefind.js"
    if not index.exists() or index.stat().st_mtime < newest_s:
        pytest.skip("the site is not as new as its pages: make docs")
    page, missed = new_page(), {}
    page.route("http://site/**", lambda route: route.fulfill(path=SITE / route.request.url.partition("?")[0][12:]))
    page.goto("http://site/start.html")
    for line in (ROOT / "tests" / "search_questions.txt").read_text().splitlines()[1:]:
        question, answer = line.rsplit(maxsplit=1)
        page.locator("input.sidebar-search").fill(question.strip())
        page.locator("input.sidebar-search").press("Enter")
        page.locator(".pagefind-ui__result-link").first.wait_for()
        found = page.locator(".pagefind-ui__result-inner > .pagefind-ui__result-title > a").evaluate_all(
            "all => all.slice(0, 3).map(a => a.pathname)"
        )
        if f"/{answer}.html" not in found:
            missed[question.strip()] = found
    assert not missed

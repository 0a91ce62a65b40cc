"""Chromium for the tests of the page."""

from tests.desk.conftest import browser, context, new_page, playwright

__all__ = ["browser", "context", "new_page", "playwright"]

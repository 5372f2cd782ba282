"""A real Chromium, rendering without a graphics card."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from playwright.sync_api import Browser, Page, sync_playwright

from tests.ensure_programs import FLAGS, find_chromium

STARTED = "document.documentElement.dataset.sgStarted !== undefined"
"""Whether a page has drawn its first picture."""

_PATIENCE = 300_000  # [ms]


@contextmanager
def open_browser() -> Iterator[Browser]:
    """A context with a browser."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=list(FLAGS))
        try:
            yield browser
        finally:
            browser.close()


def new_page(browser: Browser, **settings: Any) -> Page:
    """An empty page without a cache, of 1440 x 900 pixels."""
    page = browser.new_context(viewport={"width": 1440, "height": 900}, **settings).new_page()
    page.set_default_timeout(_PATIENCE)
    return page


def open_dashboard(page: Page, url: str) -> None:
    """Opens a dashboard, and pauses its playback."""
    page.goto(url)
    page.get_by_text("Saved as").wait_for()
    page.get_by_role("button", name="Pause", exact=True).click()
    page.get_by_role("button", name="Play", exact=True).wait_for()

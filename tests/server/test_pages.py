"""The viewer and the documentation in a real Chromium."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import numpy as np
import pytest
from playwright.sync_api import Page
from viser import uplot

from tests.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.browser


class Watched:
    """A page, what went wrong on it, and whom it talked to."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.errors: list[str] = []
        self.addresses: set[str] = set()
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("console", self._note)
        page.on("request", lambda request: self.addresses.add(request.url))
        page.on("websocket", lambda socket: self.addresses.add(socket.url))

    def _note(self, message) -> None:
        if message.type == "error":
            self.errors.append(message.text)

    def foreign_addresses(self, port: int) -> set[str]:
        own = tuple(
            f"{scheme}{name}:{port}"
            for scheme in ("http://", "ws://", "blob:http://")
            for name in ("127.0.0.1", "localhost")
        )
        return {a for a in self.addresses if not a.startswith((*own, "data:"))}


@pytest.fixture
def watched(browser) -> Iterator[Watched]:
    page = browser.new_page(viewport={"width": 900, "height": 600})
    page.set_default_timeout(1000 * PATIENCE)
    yield Watched(page)
    page.close()


def test_the_viewer_works_on_the_one_port_in_both_directions(viewing, watched) -> None:
    """By the name of this machine; the tests of the dashboard use its address."""
    gui, page = viewing.viewer.gui, watched.page
    slider = gui.add_slider("mass", 0.0, 2.0, 0.1, 1.0)
    text = gui.add_markdown("**before**")
    x = np.linspace(0.0, 1.0, 20)
    series = (uplot.Series(label="t"), uplot.Series(label="y", stroke="red"))
    gui.add_uplot((x, x), series, height=100)
    port = viewing.server.port
    page.goto(f"http://localhost:{port}/")
    page.get_by_text("mass").wait_for()
    page.locator("canvas").first.wait_for()
    page.get_by_role("slider").last.focus()
    page.keyboard.press("ArrowRight")
    wait_until(lambda: slider.value == pytest.approx(1.1))
    text.content = "**after** all"
    page.get_by_text("after").wait_for()
    page.wait_for_timeout(1000)
    assert watched.errors == []
    assert watched.foreign_addresses(port) == set()
    assert f"ws://localhost:{port}/" in watched.addresses
    gui.reset()


def test_a_page_cannot_be_made_to_talk_to_another_server(viewing, watched) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        other.settimeout(1.0)
        address = f"ws://127.0.0.1:{other.getsockname()[1]}"
        with watched.page.expect_console_message(lambda m: f"Connecting to: {address}" in m.text):
            watched.page.goto(f"{viewing.server.url}/?websocket={address}")
        watched.page.wait_for_timeout(1000)
        with pytest.raises(TimeoutError):
            other.accept()


def test_the_documentation_sends_real_requests_and_needs_nothing_from_outside(
    viewing, watched
) -> None:
    page, port = watched.page, viewing.server.port
    page.goto(f"{viewing.server.url}/api/v1/docs")
    page.get_by_text("/api/v1/health").click()
    page.locator("details[open]").get_by_role("button", name="Send").click()
    page.get_by_text('"status": "ok"').wait_for()
    posting = page.locator("details").filter(has_text="Simulate a scenario")
    posting.locator("summary").click()
    posting.locator("textarea").fill(
        '{"scenario": "paper-case-1", "set": {"simulation.duration": 0.1}}'
    )
    posting.get_by_role("button", name="Send").click()
    posting.get_by_text("201 Created").wait_for()
    assert watched.errors == []
    assert watched.foreign_addresses(port) == set()

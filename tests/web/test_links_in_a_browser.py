"""A link with a token in a real Chromium, and a page of somebody else beside it."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Response

from slipgrasp.server.tokens import Tokens
from slipgrasp.web.app import create_dashboard_app
from tests.server.serving import RunningServer, patient_settings, serve
from tests.web.conftest import PATIENCE

pytestmark = [pytest.mark.browser, pytest.mark.slow]

TOKENS = Tokens("the-token-of-these-tests")

ASK_FOR_EVERYTHING = """async (url) => {
  const failed = (promise) => promise.then(() => "done", () => "failed");
  const outcomes = [];
  for (const path of ["", "api/v1/runs", "api/v1/health", "dashboard/sessions/x"]) {
    outcomes.push(await failed(fetch(url + path, { credentials: "include" })));
    await failed(fetch(url + path, { credentials: "include", mode: "no-cors" }));
  }
  await failed(fetch(url + "api/v1/runs", {
    method: "POST", mode: "no-cors", credentials: "include",
    body: JSON.stringify({ scenario: "paper-case-1" }),
  }));
  outcomes.push(await new Promise((resolve) => {
    const socket = new WebSocket(url.replace("http", "ws"));
    socket.onopen = () => resolve("done");
    socket.onerror = () => resolve("failed");
  }));
  outcomes.push(await new Promise((resolve) => {
    const image = document.createElement("img");
    image.onload = () => resolve("done");
    image.onerror = () => resolve("failed");
    image.src = url + "api/v1/health";
  }));
  const frame = document.createElement("iframe");
  await new Promise((resolve) => {
    frame.onload = resolve;
    frame.src = url;
    document.body.append(frame);
  });
  return outcomes;
}"""


class ForeignPage(BaseHTTPRequestHandler):
    """A page with a link that somebody was sent."""

    link = ""

    def do_GET(self) -> None:
        body = f'<!doctype html><a href="{self.link}">look</a>'.encode()
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *arguments: object) -> None:
        """Says nothing."""


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    folder = tmp_path_factory.mktemp("linked")
    settings = patient_settings(folder, token=TOKENS.full, public_urls=("http://lab7:8020",))
    with serve(settings, create_dashboard_app(settings)) as running:
        yield running


@pytest.fixture(scope="module")
def foreign_port(server: RunningServer) -> Iterator[int]:
    ForeignPage.link = f"{server.url}/?token={TOKENS.full}"
    with ThreadingHTTPServer(("127.0.0.1", 0), ForeignPage) as foreign:
        thread = threading.Thread(target=foreign.serve_forever)
        thread.start()
        yield foreign.server_address[1]
        foreign.shutdown()
        thread.join()


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    context = browser.new_context(viewport={"width": 1000, "height": 700})
    context.set_default_timeout(PATIENCE)
    yield context
    context.close()


def wait_for_dashboard(page: Page) -> None:
    page.locator(".sg-transport").wait_for()
    assert "token" not in page.url


def check_foreign_page(server: RunningServer, foreign_port: int, page: Page) -> None:
    """Gets nothing, but may link to the dashboard."""
    statuses: list[int] = []

    def note(response: Response) -> None:
        if response.url.startswith(server.url):
            statuses.append(response.status)

    for name in ("127.0.0.1", "localhost"):
        page.goto(f"http://{name}:{foreign_port}/")
        page.on("response", note)
        assert set(page.evaluate(ASK_FOR_EVERYTHING, f"{server.url}/")) == {"failed"}
        assert statuses and set(statuses) <= {401, 403}
        page.remove_listener("response", note)
    with server.client() as client:
        shown = {"Authorization": f"Bearer {TOKENS.full}"}
        # That which the dashboard opens on; it is kept once.
        assert client.get("/runs", headers=shown).json()["count"] == 1
    page.get_by_text("look").click()
    wait_for_dashboard(page)


def test_a_link_opens_the_dashboard_which_reloads_and_a_foreign_page_may_only_link_to_it(
    server, foreign_port, context
) -> None:
    page = context.new_page()
    refused = page.goto(f"{server.url}/")
    assert refused is not None and refused.status == 401
    page.goto(f"{server.url}/?token={TOKENS.full}&fixedDpr=0.3")
    wait_for_dashboard(page)
    assert "fixedDpr=0.3" in page.url
    page.get_by_text("Saved as").wait_for()
    assert page.evaluate("document.cookie") == ""
    assert page.reload(wait_until="commit").status == 200
    assert "token" not in page.url
    page.goto("about:blank")
    check_foreign_page(server, foreign_port, page)


def test_a_read_only_link_shows_the_dashboard(server, context) -> None:
    page = context.new_page()
    page.goto(f"{server.url}/?token={TOKENS.read_only}&fixedDpr=0.3")
    wait_for_dashboard(page)
    post = "(path) => fetch(path, { method: 'POST' }).then((answer) => answer.status)"
    assert page.evaluate(post, "/api/v1/runs") == 403

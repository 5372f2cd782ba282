"""The dashboard at a path of a reverse proxy, in a real Chromium."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page

from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.server.tokens import Tokens
from slipgrasp.web.app import create_dashboard_app
from tests.server.proxy import PathProxy, proxy_at
from tests.server.serving import patient_settings, serve
from tests.web.conftest import PATIENCE

pytestmark = [pytest.mark.browser, pytest.mark.slow]

TOKENS = Tokens("the-token-of-these-tests")
ROOT = "/slipgrasp"


@pytest.fixture(scope="module")
def proxy(tmp_path_factory: pytest.TempPathFactory) -> Iterator[PathProxy]:
    folder = tmp_path_factory.mktemp("proxied")
    with proxy_at(ROOT, strips=True) as proxy:
        settings = patient_settings(
            folder, token=TOKENS.full, public_urls=(proxy.origin,), root_path=ROOT
        )
        with serve(settings, create_dashboard_app(settings)) as running:
            proxy.upstream_port = running.port
            yield proxy


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    context = browser.new_context(viewport={"width": 1000, "height": 700})
    context.set_default_timeout(PATIENCE)
    page = context.new_page()
    complaints: list[str] = []
    page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    yield page
    context.close()
    assert complaints == []


def test_the_dashboard_and_the_page_of_the_interface_work_at_the_path_of_a_proxy(
    proxy, page, case_1, tmp_path
) -> None:
    page.goto(f"{proxy.url}?token={TOKENS.full}&fixedDpr=0.3")
    page.locator(".sg-transport").wait_for()
    page.get_by_text("Saved as").wait_for()
    assert page.url.startswith(proxy.url) and "token" not in page.url
    page.keyboard.press("End")
    page.wait_for_url(lambda url: "run=" in url and "websocket=" not in url)

    write_recording(case_1, tmp_path / "sent.mcap")
    page.get_by_role("tab", name="Recordings").click()
    page.locator("[data-sg-upload] input").set_input_files(tmp_path / "sent.mcap")
    page.get_by_text("sent.mcap is kept as").wait_for()
    page.locator("a[download]").first.wait_for()
    links = page.evaluate("[...document.querySelectorAll('a[download]')].map((a) => a.href)")
    fetched = "(url) => fetch(url).then((answer) => answer.status)"
    assert links and all(link.startswith(proxy.url) for link in links)
    assert [page.evaluate(fetched, link) for link in links] == [200] * len(links)

    page.goto(f"{proxy.url}api/v1/docs")
    operation = page.locator("details", has_text="/api/v1/health").first
    operation.locator("summary").click()
    operation.get_by_role("button", name="Send").click()
    operation.get_by_text('"status": "ok"').wait_for()
    with page.expect_navigation(wait_until="commit") as navigation:
        page.get_by_role("link", name="Dashboard").click()
    assert navigation.value.status == 200 and page.url.startswith(proxy.url)

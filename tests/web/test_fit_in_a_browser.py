"""Measured data over a run, and a fit of them, in a real Chromium."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from tests.server.serving import RunningServer
from tests.server.test_fits import measure

pytestmark = [
    pytest.mark.browser,
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]


@pytest.fixture(scope="module")
def run_id(dashboard: RunningServer) -> str:
    """Measured data in the folder of the dashboard."""
    return measure(dashboard.data_directory)


def test_measured_data_are_drawn_over_the_run_with_their_distances(
    seen_page: Page, run_id: str
) -> None:
    page = seen_page
    page.get_by_role("tab", name="Recordings").click()
    page.get_by_text("measured x, y").first.click()
    page.get_by_role("button", name="Draw over the run").click()
    page.get_by_role("tab", name="Compare").click()
    table = page.locator(".sg-compare table")
    expect(table).to_contain_text("Run minus measured")
    expect(table).to_contain_text("slip_0")
    page.get_by_role("tab", name="Run", exact=True).click()


def test_a_fit_shows_its_profiles_and_its_report(seen_page: Page, run_id: str) -> None:
    page = seen_page
    page.get_by_role("tab", name="Fit", exact=True).click()
    # The measured data on the screen are chosen already.
    data = page.get_by_role("combobox", name="data", exact=True)
    expect(data).to_have_value(re.compile(run_id))
    page.get_by_role("button", name="Fit", exact=True).click()
    page.get_by_text(re.compile("Complete. [0-9]+ runs.")).wait_for()
    expect(page.get_by_text("95 % interval")).to_be_visible()
    with page.expect_popup() as popup:
        page.get_by_role("link", name="Report").click()
    expect(popup.value.get_by_role("heading", name="Parameters and their profiles")).to_be_visible()
    popup.value.close()

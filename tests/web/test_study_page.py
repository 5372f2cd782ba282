"""A study from the page, in a real Chromium."""

from __future__ import annotations

import json
import re

import pytest
from playwright.sync_api import Locator, Page

from tests.server.serving import RunningServer
from tests.web.conftest import Visitors
from tests.web.driving import overwrite, pause

pytestmark = [
    pytest.mark.browser,
    # A viewer may leave in the middle of a frame.
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]


def choose(page: Page, label: str, option: str) -> None:
    """Chooses an option of the list with a label."""
    page.get_by_role("combobox", name=label, exact=True).click()
    page.locator("[role=option]:visible").get_by_text(option, exact=True).click()


def run_of(mark: Locator) -> int:
    return int(json.loads(mark.get_attribute("data-sg-intent") or "{}")["index"])


def wait_for_run(page: Page, index: int) -> None:
    """Waits until a run of the study is on the screen."""
    title = re.compile(rf"and gravity, run {index}$")
    page.locator("b:visible", has_text=title).first.wait_for()


def test_two_parameters_are_chosen_the_map_fills_and_a_click_opens_a_run(
    visitors: Visitors, dashboard: RunningServer
) -> None:
    page = visitors.open()  # A study leaves its panel wide.
    choose(page, "scenario", "composite-case-2")
    page.locator(".sg-origin", has_text="composite-case-2").wait_for()
    pause(page)  # A picture that plays takes the time of everything else.
    page.get_by_role("button", name="Vary the friction").click()  # shows the tab
    choose(page, "upwards", "Gravity [m/s²]")
    for count in page.locator("xpath=//label[normalize-space(.)='values']/../../..").all():
        overwrite(count.locator("input:visible").last, "3")
    page.locator("b", has_text=re.compile(r"^9 runs$")).wait_for()
    page.get_by_text("of computing").wait_for()
    page.get_by_role("button", name="Run the study").click()
    page.get_by_text("Completed: 9 runs.").wait_for()
    marks = page.locator(".sg-map rect[data-sg-intent]")
    page.wait_for_function("document.querySelectorAll('.sg-map rect[data-sg-intent]').length === 9")
    index = run_of(marks.nth(4))
    marks.nth(4).click()
    page.locator(".sg-map-ring").wait_for()
    wait_for_run(page, index)

    choose(page, "object mass [kg]", "0.2")
    page.get_by_role("button", name="Open this run").click()
    wait_for_run(page, index % 3)
    page.locator(".sg-map-ring").wait_for()  # The map comes after the title.

    with dashboard.client() as client:
        study = client.get("/studies").json()["data"][0]
        runs = client.get("/runs", params={"tag": f"study {study['id']}"}).json()["count"]
        rows = client.get(f"/studies/{study['id']}/results.csv").text.splitlines()
    assert (study["state"], runs, len(rows)) == ("completed", 2, 10)

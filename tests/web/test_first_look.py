"""What the page remembers of who looks at it, in a real Chromium."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from tests.web.driving import pause_at, set_number


@pytest.mark.browser
@pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")
def test_words_for_the_first_visit_go_for_good_and_what_is_unfolded_stays_so(
    page: Page,
) -> None:
    welcome = page.get_by_text("A hand holds an object by friction alone.")
    expect(welcome).to_be_visible()
    page.get_by_role("button", name="Got it").click()
    expect(welcome).to_be_hidden()

    pause_at(page, 0.0)
    squeeze = page.get_by_text(re.compile("At the end the (left|right) fingertip presses with"))
    expect(squeeze).to_be_hidden()
    page.get_by_text("Squeeze, forces, margins, tracking").click()
    expect(squeeze).to_contain_text("23.7 N")
    set_number(page, "mass [kg]", "1.5")
    expect(squeeze).not_to_contain_text("23.7 N")
    expect(squeeze).to_be_visible()

    page.reload()
    # The run itself, or its recording where the address has been told of that already.
    expect(page.locator(".sg-verdict")).to_contain_text("Held")
    expect(welcome).to_be_hidden()

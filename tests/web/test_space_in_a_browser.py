"""A spatial hand on the page, in a real Chromium."""

from __future__ import annotations

import io
import re

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page, expect

from tests.web.driving import pause_at, set_number


def coloured(page: Page) -> tuple[int, int]:
    """Orange and blue pixels in the middle of the page, above the strip."""
    shot = np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"), dtype=int)
    height, width = shot.shape[:2]
    red, green, blue = np.moveaxis(
        shot[: int(0.6 * height), int(0.3 * width) : int(0.7 * width)], 2, 0
    )
    orange = (red - green > 60) & (green - blue > 20)
    return int(orange.sum()), int(((blue - red > 60) & (green > red)).sum())


@pytest.mark.browser
@pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")
def test_a_prism_in_space_slips_in_the_picture_and_follows_a_control(page: Page) -> None:
    page.get_by_role("combobox", name="scenario", exact=True).click()
    page.locator("[role=option]:visible").filter(has_text="spatial-prism").first.click()
    verdict = page.locator(".sg-outcome")
    expect(verdict).to_contain_text("All fingertips slipped")
    expect(page.locator(".sg-names")).to_contain_text("side 2")
    legend = page.locator(".sg-legend")
    expect(legend).to_contain_text(re.compile(r"slips(?! forward)"))
    expect(legend).not_to_contain_text("slips backward")
    pause_at(page, 0.06)
    expect(page.locator(".sg-clock")).to_contain_text("60.0 ms")
    page.wait_for_timeout(1000)
    slipping = coloured(page)
    pause_at(page, 0.12)
    page.wait_for_timeout(1000)
    sticking = coloured(page)
    # Rims and fingertips change from orange to blue, whatever else is on the page.
    assert slipping[0] > sticking[0] + 1000
    assert sticking[1] > slipping[1] + 800
    before = verdict.inner_text()
    set_number(page, "mass [kg]", "1.2")
    expect(verdict).not_to_have_text(before)
    page.get_by_role("button", name="push", exact=True).click()
    page.locator(".sg-editor-note", has_text="push (0, 0, -5) N").wait_for()

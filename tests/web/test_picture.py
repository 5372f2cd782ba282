"""The picture in a real Chromium: what its switches change, and what they leave as it is."""

from __future__ import annotations

import numpy as np
import pytest
from playwright.sync_api import Locator, Page

from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import PHASES
from tests.waiting import wait_until
from tests.web.driving import pause_at, picture, set_number

pytestmark = [
    pytest.mark.browser,
    # A viewer may leave in the middle of a frame.
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]


def pixels_of(seen: np.ndarray, phase: ContactPhase) -> int:
    return int((np.abs(seen - PHASES[phase]).max(axis=2) < 30).sum())


def differing(seen: np.ndarray, before: np.ndarray) -> float:
    """Which share of two pictures is not the same."""
    return float((np.abs(seen - before).max(axis=2) > 40).mean())


def checkbox(page: Page, label: str) -> Locator:
    row = page.locator(f"xpath=//label[normalize-space(.)='{label}']/../../..")
    return row.locator("input[type=checkbox]").last


def test_switches_of_the_picture_and_the_way_back_to_the_front(seen_page: Page) -> None:
    page = seen_page
    pause_at(page, 0.08)
    usual = picture(page)
    page.get_by_text("Picture", exact=True).click()
    set_number(page, "force scale", "2")
    wait_until(lambda: differing(picture(page), usual) > 5e-4, "no arrow became longer")
    front = picture(page)

    page.mouse.move(640, 300)
    page.mouse.down()
    page.mouse.move(740, 340, steps=5)
    page.mouse.up()
    wait_until(lambda: differing(picture(page), front) > 0.02, "the camera was not moved")
    page.keyboard.press("f")
    wait_until(lambda: differing(picture(page), front) < 2e-3, "it is not back at the front")

    checkbox(page, "dark").check()
    wait_until(lambda: picture(page)[4, 4].max() < 50, "the scene is not dark")
    dark = picture(page)
    for phase in (ContactPhase.SLIP_FORWARD, ContactPhase.SLIP_BACKWARD):
        assert pixels_of(dark, phase) > 0.9 * pixels_of(front, phase)

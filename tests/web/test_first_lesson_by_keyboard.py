"""The first lesson without a mouse: see the slip, ask why, change it, take it back."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Locator, Page, expect

from slipgrasp.web.model.intents.tour import VisitStop
from slipgrasp.web.model.tour import TOUR
from tests.server.serving import RunningServer
from tests.waiting import wait_until
from tests.web.conftest import Visitors
from tests.web.driving import control, pause, told

MOST_STOPS = 120
PRESSES = re.compile("At the end the (left|right) fingertip presses with")


def tab_to(page: Page, wanted: Locator) -> None:
    """Presses Tab until an element has the focus, as somebody without a mouse does."""
    for _ in range(MOST_STOPS):
        if wanted.evaluate("element => element === document.activeElement"):
            return
        page.keyboard.press("Tab")
    pytest.fail(f"{wanted} is not reached by {MOST_STOPS} tabs")


def unfold_the_card(page: Page) -> None:
    """Closes the welcome and unfolds the forces of the card."""
    squeeze = page.get_by_text(PRESSES)
    welcome = page.get_by_role("button", name="Got it")
    tab_to(page, welcome)
    page.keyboard.press("Enter")
    expect(welcome).to_be_hidden()
    expect(squeeze).to_be_hidden()
    tab_to(page, page.locator("summary", has_text="Knowledge, forces, margins, tracking"))
    page.keyboard.press("Enter")
    expect(squeeze).to_contain_text("23.7 N")


def follow_the_tour(page: Page) -> None:
    """The second stop of the tour, in which the slip is long."""
    card = page.locator(".sg-outcome")
    squeeze = page.get_by_text(PRESSES)
    page.keyboard.press("t")
    tab_to(page, page.get_by_role("region", name="Tour").get_by_role("button", name="Next"))
    page.keyboard.press("Enter")
    expect(card).to_contain_text("slipped by 47.2 mm")
    pause(page)  # A picture that plays takes the time of everything else.
    page.keyboard.press("t")
    expect(squeeze).not_to_contain_text("23.7 N")
    expect(squeeze).to_be_visible()  # What is unfolded stays so.


def find_the_slip(page: Page) -> None:
    """Which fingertip slips, and until when: the events, one after the other."""
    card = page.locator(".sg-outcome")
    page.keyboard.press("Home")
    page.keyboard.press("]")
    wait_until(lambda: told(page)["time"] == pytest.approx(0.1129, abs=2e-3), "no event")
    expect(card).to_contain_text("Both fingertips slipped")
    expect(card).to_contain_text("friction as 1.2; it is 0.25")


def try_and_take_back(page: Page) -> None:
    """What would stop it: the first suggestion, which was tried and says so, and back again."""
    card = page.locator(".sg-outcome")
    page.keyboard.press("Home")
    suggestions = page.get_by_role("group", name="What to try")
    expect(suggestions).to_contain_text("slip 3.62 mm instead of 47.2 mm")
    tab_to(page, suggestions.get_by_role("button").first)
    page.keyboard.press("Enter")
    expect(card).to_contain_text("slipped by 3.62 mm")
    pause(page)
    page.keyboard.press("Control+z")
    expect(card).to_contain_text("slipped by 47.2 mm")


def make_it_heavier(page: Page) -> None:
    """How much heavier it may get: by asking, and by a control."""
    card = page.locator(".sg-outcome")
    tab_to(page, page.get_by_role("button", name="How much heavier may it get?"))
    page.keyboard.press("Enter")
    expect(card).to_contain_text("Held up to 18.57 kg, 18.57 times its mass")
    mass = control(page, "mass [kg]")
    tab_to(page, mass)
    before = float(mass.get_attribute("aria-valuenow") or "nan")
    page.keyboard.press("ArrowRight")
    wait_until(lambda: float(mass.get_attribute("aria-valuenow") or "nan") > before, "no change")
    expect(card).not_to_contain_text("47.2 mm")
    pause(page)
    tab_to(page, page.locator(".sg-listed > summary"))
    page.keyboard.press("Enter")
    ghost = page.get_by_role("button", name="dismiss ghost")
    expect(ghost).to_be_visible()
    page.keyboard.press("x")
    expect(ghost).to_be_hidden()


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")
def test_the_first_lesson_by_keyboard(visitors: Visitors) -> None:
    page = visitors.open()
    unfold_the_card(page)
    follow_the_tour(page)
    find_the_slip(page)
    try_and_take_back(page)
    make_it_heavier(page)

    page.reload()
    expect(page.locator(".sg-verdict")).to_be_visible()
    expect(page.get_by_role("button", name="Got it")).to_be_hidden()


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")
def test_the_tour_by_keyboard(page: Page, dashboard: RunningServer) -> None:
    tour = page.get_by_role("region", name="Tour")
    send = dashboard.app.state.dashboard.directory.find(told(page)["session"])
    names = [stop.preset for stop in TOUR]
    page.keyboard.press("t")
    # The key leaves the tour if it arrives after the first stop.
    expect(tour).to_be_visible()
    # From one kind of hand or body to another.
    kinds = ("paper-case-1", "parallel-gripper", "spinning-slide", "push-slider", names[-1])
    for place in sorted({names.index(name) + 1 for name in kinds}):
        send(VisitStop(place - 1))
        expect(tour).to_contain_text(f"Tour, {place} of {len(TOUR)}: ")
        page.locator(".sg-origin", has_text=names[place - 1]).wait_for()
        pause(page)
        onward = tour.get_by_role("button", name="Next" if place < len(TOUR) else "Leave")
        tab_to(page, onward)
        assert onward.evaluate("button => getComputedStyle(button).outlineStyle") != "none"
        page.keyboard.press("Enter")
        if place < len(TOUR):
            expect(tour).to_contain_text(f"Tour, {place + 1} of {len(TOUR)}: ")
    expect(tour).to_be_hidden()

"""What tests do with a page of the dashboard in a real Chromium."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from PIL import Image
from playwright.sync_api import Locator, Page, TimeoutError, expect

from slipgrasp.core.scenario.laws import law_alias
from slipgrasp.web.panels.strip import clock_words
from tests.waiting import PATIENCE, wait_until

# Chromium redraws what has changed; edges within a pixel then depend on what was drawn before.
REPAINT = """async () => {
    const overlay = document.querySelector(".sg-overlay");
    if (!overlay) return;
    overlay.style.visibility = "hidden";
    for (let i = 0; i < 2; i += 1) await new Promise(requestAnimationFrame);
    overlay.style.visibility = "";
    for (let i = 0; i < 2; i += 1) await new Promise(requestAnimationFrame);
}"""
# A quarter of a second, and longer where a machine draws few pictures in that time.
FRAMES = """async () => {
    await new Promise(passed => setTimeout(passed, 250));
    for (let i = 0; i < 3; i += 1) await new Promise(requestAnimationFrame);
}"""
MAX_PAUSES, PAUSES_WITHIN = 5, 10_000  # [ms]
# The first of the page; charts are registered in the order in which they were drawn last.
SLIP_CHART = """Object.values(window.__viserTestpoints.uplots).map((each) => each.chart).reduce(
    (first, each) => first.root.compareDocumentPosition(each.root) & 2 ? each : first)"""


def number_field(page: Page, label: str) -> Locator:
    """The number beside the slider with a label."""
    row = page.locator(f"xpath=//label[normalize-space(.)='{label}']/../../..")
    return row.locator("input:visible").last


def control(page: Page, label: str) -> Locator:
    """The slider of a parameter."""
    row = page.locator(f"xpath=//label[normalize-space(.)='{label}']/../../..")
    return row.get_by_role("slider")


def select_part(page: Page, name: str) -> None:
    """Shows the controls of a part of the scenario."""
    parts = page.get_by_role("group", name="Part of the scenario")
    part = parts.get_by_role("button", name=name, exact=True)
    part.click()
    expect(part).to_have_attribute("aria-pressed", "true", timeout=1000 * PATIENCE)


def choose_law(page: Page, name: str) -> None:
    """Chooses a control law for the whole run."""
    laws = page.get_by_role("group", name="Control law", exact=True)
    laws.get_by_role("button", name=law_alias(name), exact=True).click()


def unfold_changes(page: Page) -> None:
    """Shows the list of changes during the run."""
    fold = page.locator("details.sg-listed")
    fold.wait_for()
    if fold.get_attribute("open") is None:
        fold.locator("summary").click()


def set_number(page: Page, label: str, value: str) -> None:
    """Pastes a number over the one in the field with a label."""
    overwrite(number_field(page, label), value)


def overwrite(field: Locator, value: str) -> None:
    """Pastes a value over the one in a field, as a user does, and presses Enter."""
    # What is filled in without the focus is lost on viser's page, if the program set the field.
    field.click()
    field.press("Control+a")
    field.page.keyboard.insert_text(value)
    field.press("Enter")
    wait_until_sent(field.page)


def fill(field: Locator, text: str) -> None:
    """Writes a text over the one in a field, and leaves it to the caller what comes of it."""
    field.fill(text)
    wait_until_sent(field.page)


def wait_until_sent(page: Page) -> None:
    """Waits as long as no user can help to: viser's page sends what changes every 50 ms.

    Of two changes in less than that it sends the last one alone, though they be of two fields,
    and a form that is sent overtakes it.
    """
    page.evaluate("new Promise(sent => setTimeout(sent, 100))")


def told(page: Page) -> dict[str, Any]:
    """What the session has told the page of itself last."""
    text = page.locator("#sg-session-state").get_attribute("data-sg-state")
    return json.loads(text or "{}")


def choose_scenario(page: Page, preset: str) -> None:
    page.get_by_role("combobox", name="scenario", exact=True).click()
    page.locator("[role=option]:visible").filter(has_text=preset).first.click()


def choose_case_2(page: Page) -> None:
    """Chooses the paper's case II, in which the slip is long, and waits for its run."""
    choose_scenario(page, "paper-case-2")
    page.get_by_text("slipped by 47.2 mm").wait_for()


def pause(page: Page) -> None:
    """Pauses the run, again if it starts to play at the same time, as a new run does."""
    pauses, plays = (
        page.get_by_role("button", name=name, exact=True) for name in ("Pause", "Play")
    )
    for _ in range(MAX_PAUSES):
        if pauses.count():
            # Not by the mouse, which waits until a page that draws all the time rests.
            pauses.dispatch_event("click")
        with suppress(TimeoutError):
            plays.wait_for(timeout=PAUSES_WITHIN)
            return
    plays.wait_for()


def pause_at(page: Page, seconds: float) -> None:
    """Puts the play head somewhere, at rest."""
    pause(page)
    field = page.get_by_label("time [s]", exact=True)
    field.fill(f"{seconds:g}")
    field.press("Enter")
    wait_for_time(page, seconds)
    field.blur()


def wait_for_time(page: Page, seconds: float) -> None:
    """Waits until the play head rests at a time, in the session and on the page."""

    def rests_there() -> bool:
        state = told(page)
        return not state["playing"] and abs(state["time"] - seconds) < 1e-9

    # The page shows what is typed at once; the scene follows the session.
    wait_until(rests_there, f"the play head is not at {seconds} s")
    exact = f"{seconds:.6f}".rstrip("0").rstrip(".")
    expect(page.get_by_label("time [s]", exact=True)).to_have_value(exact)
    page.locator(".sg-clock", has_text=clock_words(seconds)).wait_for()


def picture(page: Page, height: int = 520) -> np.ndarray:
    """The scene between the panels, once it no longer changes."""
    picture_at_rest(page, lambda: shoot(page, height))
    page.evaluate(REPAINT)
    return picture_at_rest(page, lambda: shoot(page, height))


def picture_at_rest(page: Page, shoot: Callable[[], np.ndarray]) -> np.ndarray:
    """A picture of a page, once it no longer changes."""
    seen = [shoot()]

    def rests() -> bool:
        page.evaluate(FRAMES)
        seen.append(shoot())
        # Three, for a machine so busy that it draws nothing in the time of two.
        return len(seen) > 2 and all(np.array_equal(each, seen[-1]) for each in seen[-3:])

    wait_until(rests, "the picture does not come to rest")
    return seen[-1]


def shoot(page: Page, height: int) -> np.ndarray:
    clip = {"x": 380, "y": 20, "width": 560, "height": height}
    return np.asarray(Image.open(io.BytesIO(page.screenshot(clip=clip))).convert("RGB"), int)


def slip_at_end(page: Page) -> float:
    """Last value of the left finger's line in the slip chart [mm]."""
    return float(page.evaluate(f"{SLIP_CHART}.data[2].at(-1)"))

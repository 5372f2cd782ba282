"""Keys and names of the controls in a real Chromium, on one page: each test leaves it as it was."""

from __future__ import annotations

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.waiting import wait_until
from tests.web.driving import (
    choose_case_2,
    control,
    number_field,
    pause_at,
    picture,
    select_part,
    told,
    unfold_changes,
)

pytestmark = [
    pytest.mark.browser,
    # A viewer may leave in the middle of a frame.
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

NARROW = 360  # of the picture, without the value that a slider shows [px]

# Controls that a screen reader could say nothing of.
NAMELESS = """() => [...document.querySelectorAll("input, button, select, textarea, [role=slider]")]
    .filter(one => one.checkVisibility() && !(
        one.getAttribute("aria-label") || one.labels?.[0]?.textContent
        || one.textContent.trim() || one.title))
    .map(one => one.outerHTML.slice(0, 200))"""


BEFORE_THE_SESSION_IS_KNOWN = """async () => {
    const script = document.querySelector("script[src$='/dashboard.js']").src;
    const { state } = await import(script.replace("dashboard.js", "session_state.js"));
    state.session = "";
    document.querySelector("[aria-label=Pause]").click();
    return state.session;
}"""


def is_playing(page: Page) -> bool:
    return told(page)["playing"]


def test_what_is_done_before_the_session_is_known_is_not_lost(page: Page) -> None:
    page.get_by_role("button", name="Play", exact=True).click()
    page.get_by_role("button", name="Pause", exact=True).wait_for()
    assert page.evaluate(BEFORE_THE_SESSION_IS_KNOWN) == ""
    page.get_by_role("button", name="Play", exact=True).wait_for()
    assert not is_playing(page)


def test_space_plays_after_a_click_and_presses_the_button_that_the_keyboard_has_reached(
    page: Page,
) -> None:
    pushes = page.get_by_role("button", name="Remove this", exact=True)
    push = page.get_by_role("button", name="push", exact=True)
    pause_at(page, 0.08)
    unfold_changes(page)
    push.click()
    expect(pushes).to_have_count(1)
    page.keyboard.press("Space")
    wait_until(lambda: is_playing(page), "Space did not play")
    page.keyboard.press("Space")
    wait_until(lambda: not is_playing(page), "Space did not pause")
    expect(pushes).to_have_count(1)
    page.keyboard.press("Shift+Tab")
    page.keyboard.press("Tab")
    page.keyboard.press("Space")
    expect(pushes).to_have_count(2)
    assert not is_playing(page)
    page.evaluate("document.activeElement.blur()")
    for _ in range(2):
        page.keyboard.press("Control+z")
    expect(pushes).to_have_count(0)


def test_space_plays_after_a_scenario_was_chosen(page: Page) -> None:
    choose_case_2(page)
    expect(page.get_by_role("combobox", name="scenario", exact=True)).to_be_focused()
    was_playing = is_playing(page)
    page.keyboard.press("Space")
    wait_until(lambda: is_playing(page) != was_playing, "Space did not play or pause")


def test_a_lecture_has_one_chart_in_large_type_and_work_at_a_desk_comes_back(
    page: Page,
) -> None:
    charts, controls = page.locator(".uplot:visible"), page.get_by_label("scenario", exact=True)
    at_a_desk = charts.count()
    strip = page.locator(".sg-strip")
    size = "strip => parseFloat(getComputedStyle(strip).fontSize)"
    before = strip.evaluate(size)
    page.get_by_role("tab", name="Study", exact=True).click()
    page.keyboard.press("l")
    expect(charts).to_have_count(1)
    expect(controls.first).not_to_be_in_viewport()
    wait_until(lambda: strip.evaluate(size) > 1.3 * before, "the type did not become large")
    page.keyboard.press("l")
    expect(charts).to_have_count(at_a_desk)
    expect(controls.first).to_be_in_viewport()
    assert at_a_desk > 1

    def fits() -> bool:
        scene, lanes = page.locator("canvas[data-engine]").bounding_box(), strip.bounding_box()
        assert scene is not None and lanes is not None
        return lanes["x"] + lanes["width"] <= scene["x"] + scene["width"]

    wait_until(fits, "the strip does not fit below the picture any more")


def test_a_panel_that_was_torn_off_comes_back(page: Page) -> None:
    study, run = (page.get_by_role("tab", name=name, exact=True) for name in ("Study", "Run"))

    def above_run() -> float | None:
        torn, other = study.bounding_box(), run.bounding_box()
        # The client takes a panel away and makes it anew when it moves.
        return None if torn is None or other is None else other["y"] - torn["y"]

    torn, other = study.bounding_box(), run.bounding_box()
    assert torn is not None and other is not None and above_run() == 0.0
    page.mouse.move(torn["x"] + 20.0, torn["y"] + 10.0)
    page.mouse.down()
    for k in range(1, 11):
        page.mouse.move(torn["x"] + 40.0 * k, torn["y"] + 20.0 * k)
    page.mouse.up()
    wait_until(lambda: above_run() not in (None, 0.0), "the panel stayed")
    transport = page.locator(".sg-transport")
    before = transport.bounding_box()
    page.keyboard.press("r")
    # viser puts what comes back behind the other tabs.
    wait_until(lambda: above_run() == 0.0, "the panel does not come back")
    assert run.bounding_box() == other
    assert before is not None
    wait_until(
        lambda: (transport.bounding_box() or {}).get("y") == before["y"],
        "the playback panel moves",
    )


def test_arrows_on_a_control_leave_the_camera_where_it_is(page: Page) -> None:
    choose_case_2(page)
    pause_at(page, 0.08)
    select_part(page, "left")
    friction = control(page, "estimated friction")
    assert friction.get_attribute("aria-valuenow") == friction.get_attribute("aria-valuemax")
    friction.focus()
    before = picture(page)[:, :NARROW]
    page.keyboard.press("ArrowUp", delay=300)
    assert np.array_equal(picture(page)[:, :NARROW], before)


def test_every_control_has_a_name_and_the_tab_is_ours(page: Page) -> None:
    wait_until(lambda: page.evaluate(NAMELESS) == [], "controls without a name")
    select_part(page, "left")
    masses = page.get_by_role("slider", name="link mass 1 [kg], Left finger", exact=True)
    expect(masses).to_have_count(1)
    expect(page).to_have_title("slipgrasp")


def test_a_number_that_was_emptied_comes_back_when_its_field_is_left(page: Page) -> None:
    select_part(page, "object")
    field = number_field(page, "mass [kg]")
    field.click()
    field.press("Control+a")
    field.press("Delete")
    expect(field).to_have_value("")
    field.press("Tab")
    expect(field).to_have_value("1")

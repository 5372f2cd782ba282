"""Edits in a real Chromium: time from a key press to the last message for it."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import urlencode

from playwright.sync_api import Page, expect

from benchmarks.browser import new_page, open_browser
from slipgrasp.web.charts.chosen import CHOSEN_TAB
from slipgrasp.web.model.charts_view import ChartsView

_QUIET = 450  # [ms]; a run is saved half a second after the last edit.
_BETWEEN = 700
_PATIENCE = 60_000
_SIGNALS = ("x", "normal_force_0", "joint_velocity_0_0", "kinetic_energy")
_LAYOUT = ChartsView(chosen=_SIGNALS).layout()
_MASS = "xpath=//label[normalize-space(.)='mass [kg]']/../../.."


def measure_edits(url: str, edits: int) -> list[tuple[float, float]]:
    """Presses an arrow key on the slider of the mass repeatedly, during a pause of playback.

    Four charts are open, with both cursors in them.

    Args:
        url: Address of the dashboard.
        edits: Number of key presses.

    Returns:
        Of each, the time at which the page's socket received the last scene or chart message, and
        at which the page has processed it, between two drawings [s].
    """
    with open_browser() as browser:
        page = new_page(browser)
        page.add_init_script(path=Path(__file__).with_suffix(".js"))
        page.goto(f"{url}?{urlencode({'fixedDpr': 0.5, 'charts': _LAYOUT})}")
        page.get_by_text("Saved as").wait_for()
        page.get_by_role("button", name="Pause", exact=True).click()
        page.get_by_role("button", name="Play", exact=True).wait_for()
        _open_charts(page)
        return [_edit(page) for _ in range(edits)]


def _open_charts(page: Page) -> None:
    page.get_by_role("tab", name=CHOSEN_TAB, exact=True).click()
    areas = page.locator(".u-over:visible")
    expect(areas).to_have_count(len(_SIGNALS), timeout=_PATIENCE)
    areas.first.click(modifiers=["Shift"])
    expect(page.locator(".sg-second:visible")).to_have_count(len(_SIGNALS), timeout=_PATIENCE)


def _edit(page: Page) -> tuple[float, float]:
    slider = page.locator(_MASS).get_by_role("slider")
    slider.focus()
    page.wait_for_timeout(_BETWEEN)
    slider.press("ArrowRight")  # always to another value: runs that the page still has are kept
    page.wait_for_timeout(_QUIET)
    page.wait_for_function("window.drawn.length > 0")
    arrived, handled = page.evaluate("window.drawn.at(-1)")
    return 1e-3 * arrived, 1e-3 * handled

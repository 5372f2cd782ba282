"""What axe-core finds wrong with the page, for whoever cannot see it well."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import Outcome
from slipgrasp.web.model.intents.picture import ToggleDark
from tests.server.serving import RunningServer
from tests.waiting import wait_until
from tests.web.conftest import LARGE, PATIENCE, hide_warning
from tests.web.driving import pause, told

AXE = Path(__file__).parent / "axe" / "axe.min.js"
VIOLATIONS = """(rules) => axe.run(document, {
    resultTypes: ["violations"], ...(rules.length && {runOnly: rules}),
}).then(({violations}) => violations.flatMap(({id, nodes}) =>
    nodes.map(({html}) => `${id}: ${html.slice(0, 200)}`)))"""

SHOWS = {"Signals": ".sg-search", "XY": ".sg-xy", "Laws": ".sg-law"}
"""What has come once a tab of charts is drawn."""

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]


START_SCREEN = """() => {
    const named = getComputedStyle(document.documentElement, "::after").content;
    return named === '"slipgrasp"' ? "start screen" : document.documentElement.dataset
        .mantineColorScheme;
}"""


def violations(page: Page, rules: str = "") -> list[str]:
    """What is wrong by all rules, or by some of them."""
    return list(page.evaluate(VIOLATIONS, rules.split()))


def check_every_panel(page: Page, rules: str = "") -> None:
    """Finds nothing wrong by all rules, or by some of them, with one panel after the other."""
    # The other tabs of charts have the same parts as the one that is open first.
    for panel in ("Run", "Contact", "Signals", "XY", "Laws", "Recordings", "Compare", "Study"):
        page.get_by_role("tab", name=panel, exact=True).first.click()
        if panel in SHOWS:
            page.locator(SHOWS[panel]).first.wait_for()
        wait_until(lambda: violations(page, rules) == [], lambda: violations(page, rules))
    page.keyboard.press("?")
    page.get_by_role("dialog", name="Keys").wait_for()
    wait_until(lambda: violations(page, rules) == [], lambda: violations(page, rules))
    page.keyboard.press("Escape")


def test_axe_finds_nothing_wrong_with_any_panel(browser: Browser, dashboard: RunningServer) -> None:
    pushed = {"pulses.0.time": 0.08, "pulses.0.force.0": 35.0, "pulses.0.force.1": -19.0}
    failed = simulate(with_values(load_scenario("paper-case-2"), pushed))
    assert failed.outcome is Outcome.DIVERGED
    dashboard.app.state.run_service.store.save(failed)  # Its outcome is told in another colour.
    page = browser.new_page(viewport=LARGE, color_scheme="dark")
    page.set_default_timeout(PATIENCE)
    page.add_init_script(
        f"document.addEventListener('DOMContentLoaded', () => window.first = ({START_SCREEN})())"
    )
    page.goto(f"{dashboard.url}/?fixedDpr=0.3")
    assert page.evaluate("window.first") == "start screen"
    wait_until(lambda: page.evaluate(START_SCREEN) == "dark", "the start screen stays")
    page.locator(".sg-transport").wait_for()
    pause(page)
    hide_warning(page)
    page.add_script_tag(path=AXE)
    check_every_panel(page)
    dashboard.app.state.dashboard.directory.find(told(page)["session"])(ToggleDark())
    wait_until(lambda: page.evaluate(START_SCREEN) == "light", "it stays dark")
    # Nothing else depends on colours.
    check_every_panel(page, "color-contrast")
    page.close()

"""Edits in a real Chromium: time from a key press to the last message for it."""

from __future__ import annotations

from typing import NamedTuple
from urllib.parse import urlencode

from playwright.sync_api import Page, expect, sync_playwright

from slipgrasp.web.charts.chosen import CHOSEN_TAB
from slipgrasp.web.model.charts_view import ChartsView
from tests.ensure_programs import FLAGS, find_chromium

_QUIET = 450  # [ms]; a run is saved half a second after the last edit.
_BETWEEN = 700
_PATIENCE = 60_000
_SIGNALS = ("x", "normal_force_0", "joint_velocity_0_0", "kinetic_energy")
_LAYOUT = ChartsView(chosen=_SIGNALS).layout()
_MASS = "xpath=//label[normalize-space(.)='mass [kg]']/../../.."

# The page's websocket lives in a worker. Its messages are recorded there with their times, so that
# a page that is busy drawing does not count as a message on its way.
_LISTEN = """
const arrivals = []; let batches = 0; let pressed = 0; let cards = 0;
window.drawn = [];
// Scene, charts and card; notes on it, the list and the comparison come once the control rests.
const isCard = message => String(message.updates?.content).includes('sg-verdict');
const isDrawing = message => message.type === 'GuiUpdateMessage'
  ? 'data' in message.updates || (cards === 0 && isCard(message))
  : /^(Scene|Set)/.test(message.type);
const Plain = window.Worker;
window.Worker = class extends Plain {
  constructor(url, options) {
    const spy = `
      const Socket = self.WebSocket;
      self.WebSocket = class extends Socket {
        constructor(...a) {
          super(...a);
          this.addEventListener('message', () => self.postMessage(
            {type: 'arrival', at: performance.timeOrigin + performance.now()}));
        }
      };
      import(${JSON.stringify(String(url))});`;
    super(URL.createObjectURL(new Blob([spy], {type: 'text/javascript'})), {type: 'module'});
    this.addEventListener('message', event => {
      if (event.data.type === 'arrival') arrivals.push(event.data.at);
      if (event.data.type === 'message_batch') {
        const arrived = arrivals[batches++];
        if (event.data.messages.some(isDrawing)) window.drawn.push(
          [arrived - pressed, performance.timeOrigin + performance.now() - pressed]);
        cards += event.data.messages.filter(isCard).length;
      }
    });
  }
};
window.addEventListener('keydown', () => {
  pressed = performance.timeOrigin + performance.now();
  window.drawn.length = cards = 0;
}, true);
"""


class Edit(NamedTuple):
    """Effect of one key press on a slider.

    Attributes:
        arrived: Time at which the page's socket received the last scene or chart message [s].
        handled: Time at which the page has processed it, between two drawings [s].
    """

    arrived: float
    handled: float


def measure_edits(url: str, edits: int) -> list[Edit]:
    """Presses an arrow key on the slider of the mass repeatedly, during a pause of playback.

    Four charts are open, with both cursors in them.

    Args:
        url: Address of the dashboard.
        edits: Number of key presses.
    """
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=list(FLAGS))
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.set_default_timeout(_PATIENCE)
        page.add_init_script(_LISTEN)
        page.goto(f"{url}?{urlencode({'fixedDpr': 0.5, 'charts': _LAYOUT})}")
        page.get_by_text("Saved as").wait_for()
        page.get_by_role("button", name="Pause").click()
        page.get_by_role("button", name="Play").wait_for()
        _open_charts(page)
        found = [_edit(page) for _ in range(edits)]
        browser.close()
    return found


def _open_charts(page: Page) -> None:
    page.get_by_role("tab", name=CHOSEN_TAB, exact=True).click()
    areas = page.locator(".u-over:visible")
    expect(areas).to_have_count(len(_SIGNALS), timeout=_PATIENCE)
    areas.first.click(modifiers=["Shift"])
    expect(page.locator(".sg-second:visible")).to_have_count(len(_SIGNALS), timeout=_PATIENCE)


def _edit(page: Page) -> Edit:
    slider = page.locator(_MASS).get_by_role("slider")
    slider.focus()
    page.wait_for_timeout(_BETWEEN)
    slider.press("ArrowRight")  # always to another value: runs that the page still has are kept
    page.wait_for_timeout(_QUIET)
    page.wait_for_function("window.drawn.length > 0")
    arrived, handled = page.evaluate("window.drawn.at(-1)")
    return Edit(1e-3 * arrived, 1e-3 * handled)

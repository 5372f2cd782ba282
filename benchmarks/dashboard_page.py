"""Edits in a real Chromium: time from a key press to the last message for it."""

from __future__ import annotations

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
        page.add_init_script(_LISTEN)
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

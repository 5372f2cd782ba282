"""`python -m benchmarks.dashboard_gestures`: pulling the object, and moving the play head.

Both are done in a real Chromium. The runs of random pulls are simulated without a browser.
"""

from __future__ import annotations

import math

import numpy as np
from playwright.sync_api import Page

from benchmarks.browser import new_page, open_browser, open_dashboard
from benchmarks.dashboard import IN_SPACE, serve_dashboard
from benchmarks.dashboard_viewers import come_and_go
from benchmarks.report import Table, format_text
from benchmarks.timing import MILLISECONDS
from slipgrasp import load_scenario, simulate, with_values
from slipgrasp.web.session import FIRST_PRESET

MOVES = 120
DRAGS = 200
_SCRUBS = 40
_FORCES = (0.1, 10.0)  # [N]
_AT_ONCE = 0.1  # [s]

_MOVE_MS = 25
_FAR = 90.0  # [px]
_SETTLE_MS = 1500

# The pixel of the object's centre, from what viser's page shows its own tests.
_PLACE = """async () => {
  const { project, multiply } = await import('/dashboard/static/projection.js');
  const { ContactRun } = await import('/dashboard/static/contact_run.js');
  const viser = window.__viserMutable;
  const { points } = window.__viserSceneTree.getState()['/close-ups'].message.props;
  const bytes = new Uint8Array(points.buffer, points.byteOffset, points.byteLength);
  const object = viser.nodeRefFromName[ContactRun.unpack(bytes).facts.object];
  const { projectionMatrix, matrixWorldInverse } = viser.camera;
  const clip = multiply(projectionMatrix.elements, matrixWorldInverse.elements);
  const { left, top, width, height } = viser.canvas.getBoundingClientRect();
  const toClip = multiply(clip, object.matrixWorld.elements);
  const [x, y] = project(toClip, [0, 0, 0], { width, height });
  return [left + x, top + y];
}"""
# Moves the mouse by itself, since the driver would wait for every answer of a busy page. Counts
# pictures, and those with another run than the one before.
_PULL = """async ([left, top, moves, pause, far]) => {
  const seen = { all: 0, runs: 0, last: null };
  let isPulled = true;
  const look = () => {
    const { points } = window.__viserSceneTree.getState()['/close-ups'].message.props;
    seen.all += 1;
    if (points !== seen.last) seen.runs += 1;
    seen.last = points;
    if (isPulled) requestAnimationFrame(look);
  };
  look();
  const start = performance.now();
  for (let k = 0; k < moves; k += 1) {
    const share = (k % 40) / 40;
    const place = { clientX: left + far * (0.2 + share), clientY: top - 0.3 * far * share };
    const more = { pointerId: 1, pointerType: 'mouse', buttons: 1, bubbles: true };
    const move = new PointerEvent('pointermove', { ...place, ...more });
    window.__viserMutable.canvas.dispatchEvent(move);
    await new Promise((passed) => setTimeout(passed, pause));
  }
  isPulled = false;
  return { ...seen, seconds: 1e-3 * (performance.now() - start) };
}"""
# Time from a move of the mouse to the next picture at another time of the run [ms].
_FOLLOW = """() => {
  const delays = [];
  window.sgDelays = delays;
  const shown = () => window.__viserMutable.nodePoseData['/clock'].position[0];
  let moved = null;
  addEventListener('pointermove', () => (moved = [performance.now(), shown()]), true);
  const look = () => {
    if (moved !== null && shown() !== moved[1]) {
      delays.push(performance.now() - moved[0]);
      moved = null;
    }
    requestAnimationFrame(look);
  };
  look();
}"""


def tabulate_gestures() -> Table:
    """Pictures while the object is pulled, and time from the timeline to the picture."""
    rows = []
    for preset in (FIRST_PRESET, IN_SPACE):
        with serve_dashboard(preset) as served:
            come_and_go(served.socket, 1)
            (rate, share), delays = _measure_page(served.url)
        times = (f"{MILLISECONDS * np.percentile(delays, q):.0f}" for q in (50, 95))
        rows.append((preset, f"{rate:.1f}", f"{100.0 * share:.0f}", *times))
    heads = (
        "preset",
        "pictures/s while pulling",
        "of all pictures [%]",
        "timeline to picture, median [ms]",
        "p95 [ms]",
    )
    note = (
        "Chromium, 1440 x 900, rendered without a graphics card, which lowers the resolution from "
        "0.5 to 0.4 pixels per pixel of the page while the mouse is pressed."
    )
    return Table("dashboard-gestures", heads, tuple(rows), (note,))


def _measure_page(url: str) -> tuple[tuple[float, float], list[float]]:
    """Pictures while pulling, and times from the timeline to the picture [s]."""
    with open_browser() as browser:
        page = new_page(browser)
        open_dashboard(page, f"{url}?fixedDpr=0.5")
        delays = measure_scrub(page, _SCRUBS)
        page.wait_for_timeout(_SETTLE_MS)
        return measure_pulling(page, MOVES), delays


def tabulate_drags(count: int = DRAGS, seed: int = 1) -> Table:
    """How the runs of random pulls of the first scene end.

    Args:
        count: Number of pulls, each with a random direction, force and instant.
        seed: Seed of the random numbers.
    """
    source, scenario = np.random.default_rng(seed), load_scenario(FIRST_PRESET)
    held = at_once = 0
    for _ in range(count):
        angle, time = source.uniform(0.0, [2.0 * math.pi, scenario.simulation.duration])
        newtons = math.exp(source.uniform(*np.log(_FORCES)))
        force = (newtons * math.cos(angle), newtons * math.sin(angle))
        run = simulate(with_values(scenario, {"pulses": [{"time": time, "force": force}]}))
        held += run.metrics.held is True
        at_once += run.end_time < min(time + _AT_ONCE, scenario.simulation.duration)
    row = (FIRST_PRESET, str(count), f"{100.0 * held / count:.1f}", str(at_once))
    heads = ("preset", "pulls", "end held [%]", f"end within {_AT_ONCE:g} s")
    note = f"Forces of {_FORCES[0]:g} to {_FORCES[1]:g} N, evenly distributed in their logarithm."
    return Table("dashboard-drags", heads, (row,), (note,))


def measure_pulling(page: Page, moves: int) -> tuple[float, float]:
    """Pictures of another run per second [1/s], and their share, while the object is pulled.

    Args:
        page: A page at rest.
        moves: Number of movements of the mouse.
    """
    x, y = page.evaluate(_PLACE)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 5.0, y)
    page.wait_for_timeout(_SETTLE_MS)
    seen = page.evaluate(_PULL, [x, y, moves, _MOVE_MS, _FAR])
    page.mouse.up()
    return seen["runs"] / seen["seconds"], seen["runs"] / seen["all"]


def measure_scrub(page: Page, moves: int) -> list[float]:
    """Times from a move of the mouse on the timeline to its picture [s].

    Args:
        page: A page at rest.
        moves: Number of movements.
    """
    box = page.locator(".sg-track").bounding_box()
    assert box is not None
    left, width, y = box["x"], box["width"], box["y"] + 0.5 * box["height"]
    page.mouse.move(left + 0.1 * width, y)
    page.mouse.down()
    page.wait_for_timeout(_SETTLE_MS)
    page.evaluate(_FOLLOW)
    for k in range(moves):
        page.mouse.move(left + width * (0.2 + 0.6 * k / moves), y)
        page.wait_for_timeout(8 * _MOVE_MS)
    delays = page.evaluate("window.sgDelays")
    page.mouse.up()
    return [1e-3 * each for each in delays]


if __name__ == "__main__":
    for table in (tabulate_drags(), tabulate_gestures()):
        print(f"{format_text(table)}\n", flush=True)

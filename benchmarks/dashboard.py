"""The dashboard in use: edits in a page, playback, many viewers, connecting and disconnecting."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from urllib.parse import urlencode

import numpy as np
from playwright.sync_api import Page, expect

from benchmarks.browser import new_page, open_browser, open_dashboard
from benchmarks.dashboard_viewers import come_and_go, watch
from benchmarks.processes import memory_of, processor_time_of
from benchmarks.report import Table, table_of_rows
from benchmarks.service import Service, serve
from benchmarks.timing import MILLISECONDS
from slipgrasp.server.memory import LOOK_SECONDS
from slipgrasp.web.charts.chosen import CHOSEN_TAB
from slipgrasp.web.model.charts_view import ChartsView

PRESET, IN_SPACE = "paper-case-2", "spatial-prism"
_WARM_UP = 60
_FIRST, _SETTLE, _WATCH = 3.0, 10.0, 15.0
_QUIET = 450  # [ms]; a run is saved half a second after the last edit.
_BETWEEN = 700
_PATIENCE = 60_000
_SIGNALS = ("x", "normal_force_0", "joint_velocity_0_0", "kinetic_energy")
_LAYOUT = ChartsView(chosen=_SIGNALS).layout()
_MASS = "xpath=//label[normalize-space(.)='mass [kg]']/../../.."


def run() -> list[Table]:
    """The tables ``dashboard-edits``, ``dashboard-viewers`` and ``dashboard-memory``."""
    return [tabulate_edits(), tabulate_viewers(), tabulate_memory()]


def tabulate_edits(edits: int = 50) -> Table:
    """Time from a key press on a slider to the last message of its run.

    Args:
        edits: Number of edits.
    """
    rows = []
    for preset in (PRESET, IN_SPACE):
        with serve_dashboard(preset) as served:
            come_and_go(served.socket, 1)
            times = MILLISECONDS * np.array(measure_edits(served.url, edits))
        for q in (50, 95):
            cells = (f"{time:.0f}" for time in np.percentile(times, q, axis=0))
            rows.append((f"{preset}, {q}th percentile", *cells))
    note = "Chromium, 1440 x 900, rendered without a graphics card."
    heads = (f"{edits} edits of the mass", "message in the page [ms]", "taken by the page [ms]")
    return Table("dashboard-edits", heads, tuple(rows), (note,))


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
        page.add_init_script(path=Path(__file__).with_name("dashboard_edits.js"))
        open_dashboard(page, f"{url}?{urlencode({'fixedDpr': 0.5, 'charts': _LAYOUT})}")
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


def tabulate_viewers(
    counts: tuple[int, ...] = (1, 5, 20), counts_in_space: tuple[int, ...] = (1, 5)
) -> Table:
    """Update rate, age and cost while viewers watch the playback of a run.

    Args:
        counts: Numbers of viewers, one row each.
        counts_in_space: Numbers of viewers of a spatial hand.
    """
    rows = {}
    for preset, numbers in ((PRESET, counts), (IN_SPACE, counts_in_space)):
        with serve_dashboard(preset) as served:
            # What the first viewer loads is not counted for any.
            watch(served.socket, 1, 1.0, _FIRST, lambda: 0.0)
            rows |= {f"{preset}, {n}": _watch_row(served, n) for n in numbers}
    return table_of_rows("dashboard-viewers", "viewers, each its own session", rows)


def _watch_row(served: Service, count: int) -> dict[str, str]:
    settle, clock = _SETTLE + 0.5 * count, partial(processor_time_of, served.process.pid)
    seen, worked = watch(served.socket, count, settle, _WATCH, clock)
    ages = np.concatenate([one.ages for one in seen])
    num_bytes = sum(one.num_bytes for one in seen)
    return {
        "updates/s of the slowest": f"{min(len(one.arrivals) for one in seen) / _WATCH:.1f}",
        "95th percentile of age [ms]": f"{MILLISECONDS * np.percentile(ages, 95):.0f}",
        "processor [% of a core]": f"{100.0 * worked / _WATCH:.0f}",
        "kB/s each": f"{num_bytes / count / _WATCH / 1e3:.0f}",
    }


def tabulate_memory(connects: int = 500) -> Table:
    """Memory after many viewers have connected and disconnected.

    Args:
        connects: Number of connections.
    """
    memory = []
    with serve_dashboard() as served:
        for times in (_WARM_UP, connects):
            come_and_go(served.socket, times)
            time.sleep(3.0 * LOOK_SECONDS)
            memory.append(memory_of(served.process.pid))
    before, after = memory
    rows = (
        (f"after {_WARM_UP} viewers that came and went", f"{before / 1e6:.0f}", ""),
        (f"after {connects} more", f"{after / 1e6:.0f}", f"{100 * (after / before - 1):+.1f} %"),
    )
    return Table("dashboard-memory", ("memory of the server", "MB", "change"), rows)


@contextmanager
def serve_dashboard(preset: str = PRESET) -> Iterator[Service]:
    """A context with a dashboard that has a separate data folder.

    Args:
        preset: Initial preset.
    """
    program = ("benchmarks.dashboard_server", preset)
    with tempfile.TemporaryDirectory() as folder, serve(Path(folder), program) as service:
        yield service

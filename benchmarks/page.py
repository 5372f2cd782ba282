"""Live pages in Chromium: size, time to the first image, sliders, and a map."""

from __future__ import annotations

import re
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from playwright.sync_api import Browser, Page, sync_playwright

from benchmarks.report import Table
from slipgrasp.core.executors import make_executor
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.study.definition import Study
from slipgrasp.core.study.loading import study_from_mapping
from slipgrasp.recordings.study.categories import categorize
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.recordings.study.scheduler import schedule_runs
from slipgrasp.recordings.study.writer import StudyWriter
from slipgrasp.web.standalone.controls import Control, controls_of, usual_controls
from slipgrasp.web.standalone.page_file import write_page
from tests.ensure_programs import FLAGS, find_chromium

SCENARIOS = ("paper-case-1", "paper-case-2", "spatial-prism")
MAPPED = "paper-case-1"
SIDE = 50
ROUNDS = 3
MOVES = 20
PAGE = "page.md"
FIRST_TARGET, SLIDER_TARGET, SIZE_TARGET = 3.0, 100.0, 1.4
_STARTED = "document.documentElement.dataset.sgStarted !== undefined"
_PATIENCE = 300_000  # [ms]

# Time in the page from a key press on the slider of the mass until its run is drawn.
_MOVE = """async (key) => {
  const slider = document.querySelector("[role=slider]");
  const root = document.documentElement, before = root.dataset.sgSha256;
  slider.focus();
  // Observed, because a timer may notice the run only after the frame that shows it.
  const arrived = new Promise((next) => {
    const observer = new MutationObserver(() => {
      if (root.dataset.sgSha256 === before) return;
      observer.disconnect();
      next();
    });
    observer.observe(root, { attributeFilter: ["data-sg-sha256"] });
  });
  const start = performance.now();
  slider.dispatchEvent(new KeyboardEvent("keydown", { key, code: key, bubbles: true }));
  await arrived;
  await new Promise((next) => requestAnimationFrame(() => setTimeout(next)));
  return performance.now() - start;
}"""
# Content of the map: the category of each cell.
CELLS_OF_MAP = r"""() => {
  const found = [];
  for (const rect of document.querySelectorAll("rect[data-sg-intent]")) {
    const category = rect.parentElement.getAttribute("fill").match(/sg-way-(\d+)/)[1];
    found[JSON.parse(rect.dataset.sgIntent).cell] = Number(category);
  }
  return found;
}"""


class Opened(NamedTuple):
    """Measurements of one page.

    Attributes:
        megabytes: Its size.
        first: Time from opening its address to the first image of the hand [s].
        moves: Times from a key press on a slider to the image of its run [ms].
        computing: Computing time of the first run, as the page shows it [ms].
    """

    megabytes: float
    first: float
    moves: list[float]
    computing: float


def run(_docs: Path | None = None) -> list[Table]:
    """The tables ``page`` and ``page-map``."""
    return [measure_pages(), measure_map()]


def measure_pages(rounds: int = ROUNDS, moves: int = MOVES) -> Table:
    """Sizes and times of the pages of some presets; each has the hash of its native run."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=list(FLAGS))
        rows = []
        for name in SCENARIOS:
            opened = [_measure(browser, Path(folder), name, moves) for _ in range(rounds)]
            latencies = np.concatenate([each.moves for each in opened])
            middle, most = np.percentile(latencies, (50, 95))
            first = np.median([each.first for each in opened])
            computing = np.median([each.computing for each in opened])
            cells = (f"{opened[0].megabytes:.2f}", f"{first:.1f}", f"{computing:.1f}")
            rows.append((name, *cells, f"{middle:.0f}", f"{most:.0f}"))
        browser.close()
    note = (
        "1440 x 900 at half resolution, without a graphics card, hashes equal to those of native "
        f"runs. Targets: {SIZE_TARGET} MB, {FIRST_TARGET:g} s, planar hands {SLIDER_TARGET:g} ms."
    )
    heads = ("page", "MB", "first picture [s]", "run [ms]", "slider, median [ms]", "p95 [ms]")
    return Table("page", heads, tuple(rows), (note,), PAGE)


def _measure(browser: Browser, folder: Path, name: str, moves: int) -> Opened:
    scenario = load_scenario(name)
    result, file = simulate(scenario), folder / f"{name}.html"
    with file.open("wb") as stream:
        write_page(result, stream, usual_controls(scenario))
    start = time.perf_counter()
    page = _open(browser, file)
    first = time.perf_counter() - start
    assert page.evaluate("document.documentElement.dataset.sgSha256") == result.sha256
    (computing,) = re.findall(r"in ([\d.]+) ms", page.locator(".sg-check").inner_text())
    found = []
    for index in range(moves):
        page.wait_for_timeout(250)
        key = "ArrowRight" if index % 8 < 4 else "ArrowLeft"
        found.append(page.evaluate(_MOVE, key))
    page.context.close()
    return Opened(file.stat().st_size / 1e6, first, found, float(computing))


def _open(browser: Browser, file: Path) -> Page:
    context = browser.new_context(viewport={"width": 1440, "height": 900}, offline=True)
    page = context.new_page()
    page.set_default_timeout(_PATIENCE)
    page.goto(f"{file.as_uri()}?fixedDpr=0.5#t=0.05")
    page.wait_for_function(_STARTED)
    return page


def measure_map(side: int = SIDE) -> Table:
    """Seconds of a map in the page and of the same native study, whose cells must be equal."""
    scenario = load_scenario(MAPPED)
    keys = usual_controls(scenario)[:2]
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        folder = Path(name)
        with (folder / "map.html").open("wb") as stream:
            write_page(simulate(scenario), stream, keys)
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=list(FLAGS))
        page = _open(browser, folder / "map.html")
        page.get_by_role("tab", name="Map").click()
        page.get_by_label("cells").select_option(str(side))
        page.get_by_role("button", name="Compute").click()
        words = page.get_by_text(f"{side**2} of {side**2} runs")
        words.wait_for()
        (seconds,) = re.findall(r"in ([\d.]+) s", words.inner_text())
        found = page.evaluate(CELLS_OF_MAP)
        browser.close()
        native, results = _run_study(
            folder, _study_of(scenario, side, *controls_of(scenario, keys))
        )
    assert found == categorize(results).tolist(), "the page and the study differ"
    rows = (
        ("page, a worker per processor", seconds),
        ("study, a process per processor", f"{native:.1f}"),
    )
    heads = (f"{side**2} runs of {MAPPED}", "s")
    note = "All cells are equal. Wall time, one after the other on the same machine."
    return Table("page-map", heads, rows, (note,), PAGE)


def _study_of(scenario: Scenario, side: int, across: Control, up: Control) -> Study:
    """The runs of the cells of a map, in the order of the cells."""

    def middle(control: Control, k: int) -> float:
        return control.low + (k + 0.5) * (control.high - control.low) / side

    runs = [
        {across.key: middle(across, k % side), up.key: middle(up, k // side)}
        for k in range(side**2)
    ]
    document = {"base": MAPPED, "recordings": "none", "sampling": {"method": "list"}, "runs": runs}
    return study_from_mapping(document, lambda _: scenario)


def _run_study(folder: Path, study: Study) -> tuple[float, StudyResults]:
    """Wall time of a study in processes that are already running [s], and its results."""
    results = StudyResults(study)
    with make_executor("processes") as executor:
        executor.prepare()
        start = time.perf_counter()
        with StudyWriter(folder / "study.mcap", study) as writer:
            end = schedule_runs(
                study,
                executor,
                writer,
                should_stop=lambda: False,
                watch=results.append,
                keep=lambda _: None,
            )
            writer.finish(end)
        return time.perf_counter() - start, results

"""Live pages in Chromium: size, time to the first image, sliders, and a map."""

from __future__ import annotations

import re
import tempfile
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import Browser, Page

from benchmarks.browser import STARTED, new_page, open_browser
from benchmarks.report import Table, table_of_rows
from benchmarks.study import write_study
from slipgrasp.core.executors import make_executor
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.study.definition import Study
from slipgrasp.core.study.loading import study_from_mapping
from slipgrasp.recordings.study.categories import categorize
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.web.standalone.controls import Control, controls_of, usual_controls
from slipgrasp.web.standalone.page_file import write_page

SCENARIOS = ("paper-case-1", "paper-case-2", "spatial-prism")
MAPPED = "paper-case-1"
PAGE = "page.md"
FIRST_TARGET, SLIDER_TARGET, SIZE_TARGET = 3.0, 100.0, 1.4

SLIDER, CELLS_OF_MAP = (
    Path(__file__).with_name(f"page_{name}.js").read_text(encoding="utf-8")
    for name in ("slider", "map")
)
"""Scripts that time a move of the slider, and read the cells of a map."""


def run() -> list[Table]:
    """The tables ``page`` and ``page-map``."""
    return [measure_pages(), measure_map()]


def measure_pages(rounds: int = 3, moves: int = 20) -> Table:
    """Sizes and times of the pages of some presets; each has the hash of its native run."""
    rows = {}
    with tempfile.TemporaryDirectory() as folder, open_browser() as browser:
        for name in SCENARIOS:
            scenario = load_scenario(name)
            result, file = simulate(scenario), Path(folder) / f"{name}.html"
            with file.open("wb") as stream:
                write_page(result, stream, usual_controls(scenario))
            opened = [_measure(browser, file, result.sha256, moves) for _ in range(rounds)]
            firsts, computing, latencies = zip(*opened, strict=True)
            rows[name] = {
                "MB": f"{file.stat().st_size / 1e6:.2f}",
                "first picture [s]": f"{np.median(firsts):.1f}",
                "run [ms]": f"{np.median(computing):.1f}",
                "slider, median [ms]": f"{np.median(latencies):.0f}",
                "p95 [ms]": f"{np.percentile(latencies, 95):.0f}",
            }
    note = (
        "1440 x 900 at half resolution, without a graphics card, hashes equal to those of native "
        f"runs. Targets: {SIZE_TARGET} MB, first picture {FIRST_TARGET:g} s, planar sliders "
        f"{SLIDER_TARGET:g} ms."
    )
    return table_of_rows("page", "page", rows, note, page=PAGE)


def _measure(
    browser: Browser, file: Path, sha256: str, moves: int
) -> tuple[float, float, list[float]]:
    """Time to the first picture [s], computing time of its run, and times of slider moves [ms]."""
    start = time.perf_counter()
    page = _open(browser, file)
    first = time.perf_counter() - start
    assert page.evaluate("document.documentElement.dataset.sgSha256") == sha256
    (computing,) = re.findall(r"in ([\d.]+) ms", page.locator(".sg-check").inner_text())
    found = []
    for index in range(moves):
        page.wait_for_timeout(250)
        found.append(page.evaluate(SLIDER, "ArrowRight" if index % 8 < 4 else "ArrowLeft"))
    page.context.close()
    return first, float(computing), found


def _open(browser: Browser, file: Path) -> Page:
    page = new_page(browser, offline=True)
    page.goto(f"{file.as_uri()}?fixedDpr=0.5#t=0.05")
    page.wait_for_function(STARTED)
    return page


def measure_map(side: int = 50) -> Table:
    """Seconds of a map in the page and of the same native study, whose cells must be equal."""
    scenario = load_scenario(MAPPED)
    keys = usual_controls(scenario)[:2]
    with tempfile.TemporaryDirectory() as name, open_browser() as browser:
        file = Path(name) / "map.html"
        with file.open("wb") as stream:
            write_page(simulate(scenario), stream, keys)
        page = _open(browser, file)
        page.get_by_role("tab", name="Map").click()
        page.get_by_label("cells").select_option(str(side))
        page.get_by_role("button", name="Compute").click()
        words = page.get_by_text(f"{side**2} of {side**2} runs")
        words.wait_for()
        (seconds,) = re.findall(r"in ([\d.]+) s", words.inner_text())
        found = page.evaluate(CELLS_OF_MAP)
        page.context.close()
        study = _study_of(scenario, side, *controls_of(scenario, keys))
        results = StudyResults(study)
        with make_executor("processes") as executor:
            executor.prepare()
            start = time.perf_counter()
            write_study(study, executor, Path(name) / "study.mcap", results.append)
            native = time.perf_counter() - start
    assert found == categorize(results).tolist(), "the page and the study differ"
    rows = (
        ("page, a worker per processor", seconds),
        ("study, a process per processor", f"{native:.1f}"),
    )
    heads = (f"{side**2} runs of {MAPPED}", "s")
    note = "All cells equal those of the study. Wall time, one after the other on the same machine."
    return Table("page-map", heads, rows, (note,), PAGE)


def _study_of(scenario: Scenario, side: int, across: Control, up: Control) -> Study:
    """The runs of the cells of a map, in the order of the cells."""
    middles = np.arange(side) + 0.5
    ys, xs = (c.low + middles * (c.high - c.low) / side for c in (up, across))
    runs = [{across.key: x, up.key: y} for y in ys.tolist() for x in xs.tolist()]
    document = {"base": MAPPED, "recordings": "none", "sampling": {"method": "list"}, "runs": runs}
    return study_from_mapping(document, lambda _: scenario)

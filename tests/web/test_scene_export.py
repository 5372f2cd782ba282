"""A run as one HTML file, opened from disk in a real Chromium without a network."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.verdict import headline_of
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import PHASES
from slipgrasp.web.charts.replay_page import write_html
from tests.waiting import wait_until
from tests.web.conftest import PATIENCE, hide_warning
from tests.web.driving import picture_at_rest


def write(result: RunResult, path: Path) -> Path:
    with path.open("wb") as stream:
        write_html(result, stream)
    return path


@dataclass
class Opened:
    page: Page
    requests: list[str]

    @property
    def time(self) -> float:
        return float(self.page.locator("input:visible").first.input_value())

    def seek(self, seconds: float, shows: Callable[[np.ndarray], bool]) -> np.ndarray:
        """The picture at a time; a slow page may rest for a while before it gets there."""
        field = self.page.locator("input:visible").first
        field.fill(f"{seconds:g}")
        field.press("Enter")
        seen = [picture_at_rest(self.page, self.shoot)]

        def is_there() -> bool:
            seen.append(picture_at_rest(self.page, self.shoot))
            return shows(seen[-1])

        wait_until(is_there, f"it does not show {seconds} s")
        return seen[-1]

    def shoot(self) -> np.ndarray:
        picture = Image.open(io.BytesIO(self.page.screenshot()))
        return np.asarray(picture.convert("RGB"), int)


@pytest.fixture
def opened(browser: Browser, case_2: RunResult, tmp_path: Path) -> Iterator[Opened]:
    path = write(case_2, tmp_path / "run.html")
    context = browser.new_context(viewport={"width": 800, "height": 600}, offline=True)
    page, requests = context.new_page(), []
    page.set_default_timeout(PATIENCE)
    page.on("request", lambda request: requests.append(request.url))
    page.goto(f"{path.as_uri()}?fixedDpr=0.5")
    page.locator("canvas").first.wait_for()
    page.locator("input:visible").first.wait_for()
    hide_warning(page)
    yield Opened(page, requests)
    context.close()


def pixels_of(picture: np.ndarray, phase: ContactPhase) -> int:
    return int((np.abs(picture - PHASES[phase]).max(axis=2) < 30).sum())


def shows_slip(seen: np.ndarray) -> bool:
    slips = pixels_of(seen, ContactPhase.SLIP_FORWARD) > 300
    return slips and pixels_of(seen, ContactPhase.STICK) < 20


@pytest.mark.browser
def test_the_page_plays_the_run_offline(opened: Opened, case_2: RunResult) -> None:
    assert opened.page.title() == f"{case_2.name} – {headline_of(case_2)}"
    opened.page.wait_for_function(
        "() => Number(document.querySelector('input').value) > 0.3", timeout=PATIENCE
    )
    # While it plays, it writes into the field itself.
    opened.page.keyboard.press("Space")
    picture_at_rest(opened.page, opened.shoot)
    slipping = opened.seek(0.08, shows_slip)
    opened.seek(6.5, lambda seen: pixels_of(seen, ContactPhase.STICK) > 300)
    opened.seek(0.08, lambda seen: np.array_equal(seen, slipping))
    assert [url for url in opened.requests if not url.startswith(("file:", "data:", "blob:"))] == []


def test_the_file_is_small(case_2: RunResult, tmp_path: Path) -> None:
    assert write(case_2, tmp_path / "run.html").stat().st_size < 3_000_000


def test_progress_is_told_up_to_the_end(tmp_path: Path) -> None:
    short = simulate(with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.2}))
    told: list[float] = []
    write_html(short, io.BytesIO(), told.append, fps=20.0)
    assert told == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])


def test_the_title_of_a_scenario_is_never_markup(case_1: RunResult, tmp_path: Path) -> None:
    hostile = replace(case_1, scenario=replace(case_1.scenario, title="</title><script>x"))
    page = write(hostile, tmp_path / "run.html").read_text()
    assert "<script>x" not in page
    assert "&lt;/title&gt;&lt;script&gt;x" in page

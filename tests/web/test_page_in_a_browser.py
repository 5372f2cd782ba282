"""The page that simulates, opened from a file in a Chromium without a network."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect

import slipgrasp
from benchmarks.page import CELLS_OF_MAP
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.study.categories import categorize
from slipgrasp.web.standalone.controls import Control, controls_of, usual_controls
from slipgrasp.web.standalone.kernel_data import run_data
from slipgrasp.web.standalone.page_file import share_in, write_page
from tests.recordings.studying import make_study, run_study
from tests.waiting import wait_until
from tests.web.conftest import LARGE, PATIENCE, hide_warning
from tests.web.test_accessibility import AXE, violations
from tests.web.test_standalone_page import MOST_BYTES

pytestmark = [pytest.mark.browser, pytest.mark.slow]

STARTED = "document.documentElement.dataset.sgStarted !== undefined"
SIZES = {"desk": (1440, 900), "tablet": (800, 800), "phone": (360, 740)}

Open = Callable[..., Page]


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "case-1.html"
    with path.open("wb") as stream:
        case = simulate(load_scenario("paper-case-1"))
        write_page(case, stream, usual_controls(case.scenario), "slipgrasp run paper-case-1")
    return path


@pytest.fixture
def open_page(browser: Browser, file: Path) -> Iterator[Open]:
    """Opens the page without a network; at the end nobody has complained."""
    complaints: list[str] = []
    contexts = []

    def open_it(
        address: str = "", size: str = "desk", scheme: str = "light", path: Path = file
    ) -> Page:
        width, height = SIZES[size]
        context = browser.new_context(
            viewport={"width": width, "height": height}, color_scheme=scheme, offline=True
        )
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
        page.goto(path.as_uri() + "?fixedDpr=0.3" + address)
        page.wait_for_function(STARTED)
        return page

    yield open_it
    for context in contexts:
        context.close()
    assert complaints == []


def sha256_of(page: Page) -> str:
    return str(page.evaluate("document.documentElement.dataset.sgSha256"))


def native_sha256(**values: float) -> str:
    keys = {key.replace("__", "."): value for key, value in values.items()}
    return simulate(with_values(load_scenario("paper-case-1"), keys)).sha256


def picture(page: Page) -> np.ndarray:
    box = page.locator("canvas[data-engine]").bounding_box()
    assert box is not None
    return np.asarray(Image.open(io.BytesIO(page.screenshot(clip=box))).convert("RGB"), float)


def test_the_page_shows_the_run_and_its_hash_and_simulates_at_a_slider(
    open_page: Open, tmp_path: Path
) -> None:
    page = open_page("#t=0.05")
    first = sha256_of(page)
    assert first == native_sha256() == page.locator("#sg-sha256").text_content()
    card = page.locator(".sg-outcome").first.inner_text()
    assert "Held" in card.splitlines() and "Completed at 7 s." in card.splitlines()
    check_forces(card, simulate(load_scenario("paper-case-1")))
    assert page.locator(".sg-lane rect").count() == 4
    close_up = page.locator(".sg-close-up").first
    assert "Left SLIPS" in (close_up.text_content() or "")
    assert "slip 1.46 mm" in (close_up.text_content() or "")
    hide_warning(page)
    # Fingertips that slip are orange and pink.
    wait_until(lambda: shows(page, (230, 100, 0)) and shows(page, (225, 120, 190)), "no hand")
    before = picture(page)
    page.get_by_role("button", name="End", exact=True).click()
    wait_until(lambda: np.abs(picture(page) - before).max() > 100.0, "nothing has moved")
    check_axe(page, "desk")
    page.get_by_role("slider", name="object mass [kg]").focus()
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    expected = native_sha256(object__mass=1.05)
    wait_until(lambda: sha256_of(page) == expected != first, "the page computes another run")
    page.locator(".sg-ghost-lane").first.wait_for()
    assert "--set 'object.mass=1.05' --json" in page.locator(".sg-check").inner_text()
    assert page.url.endswith("object.mass=1.05")
    check_recordings(page, tmp_path)


def check_axe(page: Page, size: str) -> None:
    """Nothing is wrong for whoever cannot see it well, and nothing wider than the page."""
    page.add_script_tag(path=AXE)
    wait_until(lambda: violations(page) == [], lambda: violations(page))
    assert page.evaluate("document.documentElement.scrollWidth") <= SIZES[size][0]


def check_forces(card: str, result: RunResult) -> None:
    """The largest forces are those of the run, also between its samples."""
    for name, force in zip(
        result.scenario.finger_names, result.metrics.peak_normal_force, strict=True
    ):
        assert re.search(rf"{name}\s[^N]*\s{force:.1f} N", card), card


def shows(page: Page, colour: tuple[int, int, int]) -> bool:
    return int((np.abs(picture(page) - colour).max(axis=2) < 40).sum()) > 20


def test_a_run_that_ends_early_says_how_also_in_the_dark(open_page: Open, tmp_path: Path) -> None:
    scenario = with_values(load_scenario("paper-case-1"), {"simulation.max_steps": 50})
    path = tmp_path / "limited.html"
    result = simulate(scenario)
    with path.open("wb") as stream:
        write_page(result, stream, ["object.mass"])
    page = open_page("#t=0", "tablet", "dark", path)
    assert sha256_of(page) == result.sha256
    check_axe(page, "tablet")
    card = page.locator(".sg-outcome").first.inner_text()
    assert f"Cut short: a limit was reached at {result.end_time:.4g} s" in card
    assert "the limit of 50 steps was reached" in card


def test_a_spatial_hand_is_simulated_too_by_pages_that_share_files(
    open_page: Open, tmp_path: Path
) -> None:
    scenario, alone = load_scenario("spatial-prism"), tmp_path / "alone.html"
    result = simulate(scenario)
    with alone.open("wb") as stream:
        write_page(result, stream, usual_controls(scenario))
    assert alone.stat().st_size <= MOST_BYTES
    for run in (simulate(load_scenario("paper-case-2")), result):
        path = tmp_path / "sharing.html"
        with path.open("wb") as stream:
            controls = usual_controls(run.scenario)
            write_page(run, stream, controls, share=share_in(tmp_path))
        assert path.stat().st_size < 1e5
    # One kernel per kind of hand; styles; all other code.
    assert len(list(tmp_path.glob("shared-*.js"))) == 4
    page = open_page("#t=0", path=path)
    assert sha256_of(page) == result.sha256
    check_forces(page.locator(".sg-outcome").first.inner_text(), result)
    page.get_by_role("slider", name="object mass [kg]").focus()
    page.keyboard.press("ArrowRight")
    wait_until(lambda: sha256_of(page) != result.sha256, "the page computes another run")
    (value,) = re.findall(r"object\.mass=([\d.]+)", page.url)
    heavier = with_values(scenario, {"object.mass": float(value)})
    assert sha256_of(page) == simulate(heavier).sha256


def test_on_a_phone_the_sliders_of_the_address_lie_between_the_strip_and_the_outcome(
    open_page: Open,
) -> None:
    page = open_page("#t=0.05&fingers.*.friction=0.6", "phone")
    assert sha256_of(page) == native_sha256(fingers__0__friction=0.6, fingers__1__friction=0.6)
    expect(page.get_by_text("slipgrasp: move a slider")).to_be_visible()
    shown = (".sg-transport", "[role=slider]", ".sg-outcome:not(.sg-check)", ".sg-check")

    def tops() -> list[float]:
        boxes = [page.locator(each).first.bounding_box() for each in shown]
        return [box["y"] for box in boxes if box is not None]

    wait_until(lambda: len(tops()) == 4 and tops() == sorted(tops()), tops)
    assert tops()[1] < SIZES["phone"][1]
    check_axe(page, "phone")


def test_an_exported_notebook_still_simulates(browser: Browser, tmp_path: Path) -> None:
    result = simulate(load_scenario("paper-case-1"))
    path = tmp_path / "notebook.html"
    path.write_text(f"<!doctype html>{slipgrasp.show(result)._repr_html_()}", encoding="utf-8")
    context = browser.new_context(viewport=LARGE, offline=True)
    context.set_default_timeout(PATIENCE)
    page = context.new_page()
    page.goto(path.as_uri())
    inside = page.frame_locator("iframe")
    expect(inside.locator("#sg-sha256")).to_have_text(result.sha256, timeout=PATIENCE)
    inside.get_by_role("slider", name="object mass [kg]").focus()
    page.keyboard.press("ArrowRight")
    expected = native_sha256(object__mass=1.01)
    expect(inside.locator("#sg-sha256")).to_have_text(expected, timeout=PATIENCE)
    context.close()


def compared(page: Page, path: Path) -> str:
    """What the page says of a recording."""
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Check a recording").click()
    chooser.value.set_files(path)
    words = page.locator("#sg-compared")
    expect(words).to_contain_text(path.name, timeout=PATIENCE)
    return words.text_content() or ""


def check_recordings(page: Page, tmp_path: Path) -> None:
    """A recording is simulated again and compared bit by bit."""
    heavy = {"object.mass": 1.07}
    result = simulate(with_values(load_scenario("paper-case-1"), heavy))
    rows = result.trace.to_rows()
    slip = run_data(result)["columns"]["slip"][0]
    rows.view(np.int64)[400, slip + 1] ^= 1
    altered = replace(result, trace=Trace.from_rows(result.trace.shape, rows))
    other = simulate(with_values(load_scenario("paper-case-1"), {"simulation.duration": 1.0}))
    for name, run in {"same": result, "altered": altered, "other": other}.items():
        write_recording(run, tmp_path / f"{name}.mcap")
    (tmp_path / "text.mcap").write_text("no recording" * 10)
    cut = (tmp_path / "same.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(cut[: len(cut) // 2])

    words = compared(page, tmp_path / "same.mcap")
    assert words == f"same.mcap is equal to this run bit by bit: SHA-256 {result.sha256}"
    assert sha256_of(page) == result.sha256
    assert page.url.endswith("object.mass=1.07")
    time = np.format_float_positional(result.trace.times[400], trim="-")
    assert f"differs first in slip_1 at {time} s: " in compared(page, tmp_path / "altered.mcap")
    assert "simulation.duration is 1, here 7" in compared(page, tmp_path / "other.mcap")
    assert "it is no MCAP file" in compared(page, tmp_path / "text.mcap")
    assert "it ends within a record" in compared(page, tmp_path / "cut.mcap")


def test_a_map_has_the_cells_of_a_study_and_each_opens_its_run(
    open_page: Open, tmp_path: Path
) -> None:
    base = with_values(
        load_scenario("paper-case-1"),
        {"controller.grasp_force": "none", "simulation.duration": 0.62},
    )
    path, keys = tmp_path / "map.html", ("object.mass", "fingers.*.friction")
    with path.open("wb") as stream:
        write_page(simulate(base), stream, keys)
    page = open_page("#t=0.05", path=path)
    page.get_by_role("tab", name="Map").click()
    page.get_by_label("cells").select_option("10")
    page.get_by_role("button", name="Compute").click()
    page.get_by_text("100 of 100 runs").wait_for()
    found = page.evaluate(CELLS_OF_MAP)

    mass, friction = controls_of(base, keys)
    cells = [(middle(mass, k % 10), middle(friction, k // 10)) for k in range(100)]
    runs = [
        {"object.mass": m, "fingers.0.friction": mu, "fingers.1.friction": mu} for m, mu in cells
    ]
    study = make_study(base=base.to_mapping(), sampling={"method": "list"}, runs=runs)
    results = run_study(study, tmp_path / "study.mcap")
    assert found == categorize(results).tolist()
    assert len(set(found)) > 1

    page.locator("rect[data-sg-intent*='\"cell\":73}']").click()
    expected = simulate(with_values(base, runs[73])).sha256
    wait_until(lambda: sha256_of(page) == expected, "the page opens the run of the cell")


def middle(control: Control, k: int) -> float:
    return control.low + (k + 0.5) * (control.high - control.low) / 10

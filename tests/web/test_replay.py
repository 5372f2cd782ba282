"""A recording in the dashboard: shown bit for bit, without simulating anything."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from slipgrasp.core.kernel.planar import advance
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.core.words.display_name import name_run
from slipgrasp.recordings.file.atomic_file import part_of
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.palette import PHASES
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.web.app import create_dashboard_app
from slipgrasp.web.model.replay import moment_words, open_replay
from tests.server.serving import RunningServer, patient_settings, serve
from tests.web.conftest import LARGE, Visitors, visitors_of
from tests.web.driving import fill, number_field, pause, pause_at, picture, set_number, told

# The playback panel says whether it shows a live run; above it there is nothing but the scene.
ABOVE_PLAYBACK = 355
CHARTS = "Object.values(window.__viserTestpoints.uplots).map(u => u.chart)"


def refuse_to_simulate(*_: object, **__: object) -> None:
    raise AssertionError("the kernel was called")


@pytest.fixture
def no_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    """From here on nothing can be simulated."""
    monkeypatch.setattr(advance, "advance_run", refuse_to_simulate)


@pytest.fixture
def recording(case_1: RunResult, tmp_path: Path) -> Path:
    path = tmp_path / "evidence.mcap"
    write_recording(case_1, path)
    return path


@pytest.fixture(scope="module")
def opened(case_1: RunResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The recording that the dashboard opens on."""
    path = tmp_path_factory.mktemp("opened") / "evidence.mcap"
    write_recording(case_1, path)
    return path


@pytest.fixture(scope="module")
def replaying(opened: Path) -> Iterator[RunningServer]:
    """A dashboard that opens on a recording."""
    settings = patient_settings(opened.parent / "data")
    with serve(settings, create_dashboard_app(settings, opened)) as running:
        yield running


@pytest.fixture(scope="module")
def replay_page(browser: Browser, replaying: RunningServer) -> Iterator[Page]:
    """A page that shows the recording, for which nothing may be simulated."""
    with visitors_of(browser, replaying) as visitors:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(advance, "advance_run", refuse_to_simulate)
            page = visitors.open(size=LARGE)
            page.get_by_text("Replay of evidence.mcap").wait_for()
        yield page


def chart_values(page: Page) -> list[list[list[float]]]:
    """What the charts of the page draw, as the browser holds it."""
    return page.evaluate(f"{CHARTS}.map(c => c.data.map(column => Array.from(column)))")


def chart_pictures(page: Page) -> list[bytes]:
    urls = page.evaluate(f"{CHARTS}.slice(0, 3).map(c => c.ctx.canvas.toDataURL())")
    return [base64.b64decode(url.partition(",")[2]) for url in urls]


@pytest.mark.browser
@pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")
def test_the_pictures_of_a_live_run_and_of_its_replay_are_equal(
    visitors: Visitors, dashboard: RunningServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = visitors.open(size=LARGE)
    page.get_by_text("Saved as").wait_for()
    run = told(page)["run"]
    dashboard.app.state.run_service.store.annotate(run, name="as it was")
    pause_at(page, 0.08)
    live = picture(page, ABOVE_PLAYBACK)
    live_charts, live_values = chart_pictures(page), chart_values(page)
    slipping = np.abs(live - PHASES[ContactPhase.SLIP_FORWARD]).max(axis=2) < 30
    assert slipping.sum() > 150
    monkeypatch.setattr(advance, "advance_run", refuse_to_simulate)
    page.get_by_role("tab", name="Recordings").click()
    fill(number_field(page, "find"), "as it was")
    page.get_by_label(f"Open {run}", exact=True).click()
    page.locator(".sg-origin", has_text="Replay").wait_for()
    page.get_by_role("tab", name="Run").click()
    pause_at(page, 0.08)
    assert np.array_equal(picture(page, ABOVE_PLAYBACK), live)
    assert chart_pictures(page) == live_charts
    assert chart_values(page) == live_values


@pytest.mark.browser
@pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")
def test_a_dashboard_that_opens_on_a_recording_plays_and_charts_the_file(
    no_kernel: None, replay_page: Page, replaying: RunningServer, opened: Path
) -> None:
    page, store = replay_page, replaying.app.state.run_service.store
    num_runs = store.count()
    page.get_by_role("tab", name="Run").click()
    page.get_by_text("left: 2.59 mm").wait_for()
    pause_at(page, 0.02)
    page.get_by_role("button", name="Play", exact=True).click()
    page.locator(".sg-clock", has_text="20.0 ms").wait_for(state="detached")
    pause(page)

    page.get_by_role("button", name="whole run").click()
    page.wait_for_function(f"Math.abs({CHARTS}[0].scales.x.max - 7) < 1e-3")
    trace = read_recording(opened).trace
    times, _, left, right, *_ = chart_values(page)[0]
    rows = np.searchsorted(trace.times, times[1:-1], side="left")
    assert np.array_equal(trace.times[rows], times[1:-1])
    shown = np.array([left[1:-1], right[1:-1]]).T
    both_sides = 1e3 * trace.slip[rows], 1e3 * trace.slip[np.minimum(rows + 1, len(trace) - 1)]
    assert ((shown == both_sides[0]) | (shown == both_sides[1])).all()
    assert store.count() == num_runs


@pytest.mark.browser
@pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")
def test_a_control_makes_a_live_run_of_a_recording_and_a_damaged_one_is_explained(
    replay_page: Page, replaying: RunningServer, case_2: RunResult
) -> None:
    page, store = replay_page, replaying.app.state.run_service.store
    page.get_by_role("tab", name="Run").click()
    assert number_field(page, "mass [kg]").input_value() == "1"
    set_number(page, "mass [kg]", "1.4")
    page.get_by_text("Live run").wait_for()
    page.get_by_text("Saved as").wait_for()
    (change,) = store.open(store.list()[0].id).scenario.changes
    assert (change.parameter, change.value) == ("object.mass", 1.4)
    page.get_by_role("button", name="reset").click()
    page.get_by_text("Replay of evidence.mcap").wait_for()
    page.get_by_text("left: 2.59 mm").wait_for()
    assert number_field(page, "mass [kg]").input_value() == "1"

    page.get_by_role("tab", name="Recordings").click()
    stored = store.save(case_2)
    opening = page.get_by_label(f"Open {stored.id}", exact=True)
    opening.wait_for()
    stored.path.write_bytes(stored.path.read_bytes()[:5000])
    opening.click()
    page.get_by_text("is damaged").wait_for()
    assert page.get_by_text("Replay", exact=True).count() == 1


def test_a_file_that_is_still_written_is_opened_as_far_as_it_goes(
    recording: Path, case_1: RunResult, tmp_path: Path
) -> None:
    part = part_of(recording)
    part.write_bytes(recording.read_bytes()[: recording.stat().st_size * 3 // 4])
    recording.unlink()
    replay = open_replay(RecordingStore(tmp_path), part)
    rows = len(replay.result.trace)
    assert replay.is_unfinished
    assert 10 < rows < len(case_1.trace)
    assert replay.result.trace.to_rows().tobytes() == case_1.trace[:rows].to_rows().tobytes()


def test_a_part_that_has_become_a_recording_meanwhile_is_found(
    recording: Path, tmp_path: Path
) -> None:
    replay = open_replay(RecordingStore(tmp_path), part_of(recording))
    assert (replay.name, replay.is_unfinished) == ("evidence.mcap", False)


def test_a_stored_run_is_called_as_its_user_called_it(case_1: RunResult, tmp_path: Path) -> None:
    store = RecordingStore(tmp_path)
    stored = store.save(case_1)
    assert open_replay(store, stored.id).name == name_run(case_1.scenario)
    store.annotate(stored.id, name="the one that held")
    replay = open_replay(store, stored.id)
    assert (replay.name, replay.run_id) == ("the one that held", stored.id)
    assert replay.recorded == moment_words(stored.created)


def test_moments_in_words() -> None:
    assert moment_words("2026-11-21T10:05:59.123+00:00") == "2026-11-21 10:05 UTC"
    assert moment_words("2026-11-21T10:05:59+05:00") == "2026-11-21 05:05 UTC"
    assert moment_words("x" * 100) == "x" * 40

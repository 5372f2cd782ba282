"""How much memory the recordings that pages show may take."""

from __future__ import annotations

import gc
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue

import pytest

from benchmarks.headless_viewer import HeadlessViewer
from slipgrasp.recordings.exceptions import RecordingError
from slipgrasp.recordings.file.size import read_size, size_of_run
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.server.budget import HELD_SHARE, Need
from slipgrasp.server.exceptions import MemoryLimitError, ServiceBusyError
from slipgrasp.web.app import create_dashboard_app
from slipgrasp.web.model.export import ExportFile
from slipgrasp.web.model.intents.export import ExportFailed
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.recordings import RecordingOpened, RecordingUnreadable
from slipgrasp.web.workers.export_worker import ExportWorker
from slipgrasp.web.workers.library_worker import LibraryWorker
from tests.server.serving import patient_settings, serve
from tests.waiting import PATIENCE, wait_until
from tests.web.opening import recordings_in

Ids = tuple[str, str]


@pytest.fixture
def ids(stored: tuple[StoredRun, StoredRun]) -> Ids:
    return stored[0].id, stored[1].id


def open_one(store: RecordingStore, run_id: str) -> int:
    recordings = recordings_in(store)
    replay = recordings.open(run_id)
    assert recordings.memory.held == size_of_run(replay.result) > 0
    return recordings.memory.held


def need_of(store: RecordingStore, run_id: str) -> int:
    return Need.to_open(read_size(store.get(run_id).path)).num_bytes


def limit_for(store: RecordingStore, ids: Ids) -> int:
    """Pages may hold the first and then read the second, but for one byte of their share."""
    most = size_of_run(store.open(ids[0])) + need_of(store, ids[1]) - 1
    return round(most / HELD_SHARE)


def test_pages_share_one_run_until_the_last_of_them_forgets_it(store, ids) -> None:
    recordings, one = recordings_in(store), open_one(store, ids[0])
    pages = [recordings.open(ids[0]) for _ in range(3)]
    assert len({id(page.result) for page in pages}) == 1
    assert len({id(page) for page in pages}) == 3
    while pages:
        assert recordings.memory.held == one
        pages.pop()
    assert recordings.memory.held == 0


@pytest.mark.parametrize("small_bytes", [0, 1_000_000_000])
def test_recordings_are_read_once_though_many_ask_at_once(
    store, ids, small_bytes, monkeypatch
) -> None:
    monkeypatch.setattr("slipgrasp.web.workers.open_recordings.SMALL_BYTES", small_bytes)
    recordings = recordings_in(store)
    with ThreadPoolExecutor(8) as threads:
        pages = list(threads.map(recordings.open, 8 * ids))
    runs = {id(page.result): page.result for page in pages}
    assert len(runs) == 2
    assert recordings.memory.held == sum(map(size_of_run, runs.values()))
    del pages, runs
    assert recordings.memory.held == 0


def test_a_recording_that_was_written_anew_is_read_anew(store, ids, case_1, sluggish) -> None:
    recordings = recordings_in(store)
    before = recordings.open(ids[0])
    write_recording(sluggish, store.get(ids[0]).path, overwrite=True)
    after = recordings.open(ids[0])
    assert before.result.scenario == case_1.scenario
    assert after.result.scenario == sluggish.scenario


def test_beyond_the_bound_the_sentence_says_how_much_is_taken_and_what_helps(store, ids) -> None:
    recordings = recordings_in(store, limit_for(store, ids))
    first = recordings.open(ids[0])
    with pytest.raises(ServiceBusyError) as refused:
        recordings.open(ids[1])
    assert re.fullmatch(
        r"no memory available: it needs \d+ MB, and open pages use \d+ of \d+ MB; close "
        r"another page, end a comparison or choose a short run; try again in 5 s",
        str(refused.value),
    )
    assert recordings.open(ids[0]).result is first.result
    del first
    assert recordings.open(ids[1]).run_id == ids[1]


def test_a_page_may_show_another_run_instead_of_its_own(store, ids) -> None:
    recordings = recordings_in(store, limit_for(store, ids))
    mine = recordings.open(ids[0])
    assert recordings.open(ids[1], [mine]).run_id == ids[1]


def test_what_needs_more_than_there_is_is_refused_with_the_number(store, ids) -> None:
    need = need_of(store, ids[0])
    with pytest.raises(MemoryLimitError) as refused:
        recordings_in(store, need - 1).open(ids[0])
    told = f"this recording needs {-(-need // 10**6)} MB of memory, and there are "
    assert str(refused.value).startswith(told)
    assert "--memory" in str(refused.value)
    assert recordings_in(store, need).open(ids[0]).run_id == ids[0]


def test_runs_that_wait_in_a_cycle_are_collected_before_a_page_is_refused(store, ids) -> None:
    recordings = recordings_in(store, limit_for(store, ids))
    cycle: list[object] = [recordings.open(ids[0])]
    cycle.append(cycle)
    del cycle
    assert recordings.open(ids[1]).run_id == ids[1]


def test_nothing_is_read_for_a_page_that_has_ended(store, ids) -> None:
    with pytest.raises(RecordingError, match="was stopped"):
        recordings_in(store).open(ids[0], should_stop=lambda: True)


def test_a_worker_tells_its_page_and_keeps_no_run_itself(store, ids) -> None:
    answers: SimpleQueue[Intent] = SimpleQueue()
    recordings = recordings_in(store, limit_for(store, ids))
    worker = LibraryWorker(store, recordings, answers.put)
    worker.open(1, ids[0])
    first = answers.get(timeout=PATIENCE)
    assert isinstance(first, RecordingOpened)
    worker.open(2, ids[1])
    refused = answers.get(timeout=PATIENCE)
    assert isinstance(refused, RecordingUnreadable)
    assert "no memory available" in refused.message
    worker.open(3, ids[1], (first.replay,))
    second = answers.get(timeout=PATIENCE)
    assert isinstance(second, RecordingOpened)
    alone = size_of_run(second.replay.result)
    del first
    wait_until(lambda: recordings.memory.held == alone, "the first is still held")
    worker.close()
    worker.join(PATIENCE)


def test_without_memory_no_file_is_made_and_the_page_says_so(store, ids, monkeypatch) -> None:
    answers: SimpleQueue[Intent] = SimpleQueue()
    recordings = recordings_in(store)
    run = recordings.open(ids[0]).result
    worker = ExportWorker(answers.put)

    def make(_: object) -> ExportFile:
        with recordings.reserve_for(run):
            raise AssertionError

    monkeypatch.setattr("slipgrasp.server.budget.SMALL_BYTES", 0)
    with recordings.memory.reserve(Need(recordings.memory.left, "others")):
        worker.start(1, make)
        answer = answers.get(timeout=PATIENCE)
    assert isinstance(answer, ExportFailed)
    assert "wait for memory" in answer.message
    worker.close()
    worker.join(PATIENCE)


@pytest.mark.slow
def test_pages_of_a_server_hold_one_run_which_ends_with_them(case_1, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    write_recording(case_1, path)
    settings = patient_settings(tmp_path / "data")
    with serve(settings, create_dashboard_app(settings, path)) as running:
        recordings = running.app.state.dashboard.recordings
        url = f"ws://127.0.0.1:{running.port}/"
        with HeadlessViewer(url), HeadlessViewer(url):
            wait_until(lambda: recordings.memory.held > 0)
            wait_until(lambda: running.app.state.dashboard.num_sessions == 2)
            assert recordings.memory.held == size_of_run(case_1)
        wait_until(lambda: running.app.state.dashboard.num_sessions == 0)
        # A page that has ended is freed by the collector, which runs before anybody is refused.
        wait_until(
            lambda: gc.collect() >= 0 and recordings.memory.held == 0, "the run is still held"
        )

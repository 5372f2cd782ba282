"""What a session makes of intents about stored runs."""

from __future__ import annotations

import queue
from collections.abc import Iterator, Sequence

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.recordings import (
    AnnotateRecording,
    ChooseRecording,
    DeleteRecording,
    FilterRecordings,
    ListRecordings,
    OpenRecording,
    RecordingOpened,
    RecordingsListed,
    RecordingUnreadable,
)
from slipgrasp.web.model.run_list import ROWS_PER_PAGE, Notice, RunList
from slipgrasp.web.model.view import RunStage
from slipgrasp.web.reducers.recordings import RecordingsReducer, relist_interval
from tests.waiting import PATIENCE
from tests.web.opening import recordings_in
from tests.web.reducing import first_view


def ids_of(runs: Sequence[StoredRun]) -> list[str]:
    return [run.id for run in runs]


def test_the_list_is_looked_up_again_in_a_small_part_of_the_time() -> None:
    assert relist_interval(0.001) == relist_interval(0.0) > 1.0
    assert relist_interval(0.2) == 40.0


class Sitting:
    """A reducer of the stored runs, its view, and what its worker answered."""

    def __init__(self, store: RecordingStore) -> None:
        self.answers: queue.SimpleQueue[Intent] = queue.SimpleQueue()
        self.reducer = RecordingsReducer(store, recordings_in(store), self.answers.put, None)
        self.view = self.reducer.start(first_view())

    def ask(self, intent: Intent, until: type[Intent] = RecordingsListed) -> None:
        """Takes an intent, and every answer until one of a kind."""
        self.view = self.reducer.reduce(intent, self.view)
        self.hear(until)

    def hear(self, until: type[Intent]) -> None:
        answer: Intent | None = None
        while not isinstance(answer, until):
            answer = self.answers.get(timeout=PATIENCE)
            self.view = self.reducer.reduce(answer, self.view)

    @property
    def run_list(self) -> RunList:
        return self.view.run_list


@pytest.fixture
def sitting(store: RecordingStore, case_1: RunResult) -> Iterator[Sitting]:
    """With ten runs, the newest of which is called so."""
    ids = [store.save(case_1).id for _ in range(ROWS_PER_PAGE + 2)]
    store.annotate(ids[-1], name="newest")
    sitting = Sitting(store)
    sitting.hear(RecordingsListed)
    yield sitting
    for worker in sitting.reducer.workers:
        worker.close()
        worker.join(30.0)


def test_the_reducer_turns_pages_filters_and_chooses(sitting: Sitting) -> None:
    newest, *_, last = sitting.run_list.runs
    assert (sitting.run_list.count, newest.name) == (ROWS_PER_PAGE + 2, "newest")
    sitting.ask(ChooseRecording(newest.id))
    assert sitting.run_list.chosen == newest
    sitting.ask(ListRecordings(1))
    assert (sitting.run_list.page, len(sitting.run_list.runs)) == (1, 2)
    assert sitting.run_list.chosen == newest
    sitting.ask(FilterRecordings("newest", "held"))
    assert (sitting.run_list.page, ids_of(sitting.run_list.runs)) == (0, [newest.id])
    sitting.ask(ChooseRecording(last.id))
    assert sitting.run_list.chosen == last
    assert last.id not in ids_of(sitting.run_list.runs)


def test_a_run_that_someone_else_deletes_is_told_of_and_no_longer_chosen(
    sitting: Sitting, store: RecordingStore
) -> None:
    newest = sitting.run_list.runs[0]
    sitting.ask(ChooseRecording(newest.id))
    store.delete(newest.id)
    sitting.view = sitting.reducer.pass_time(0.0, sitting.view)
    # The interval grows with the time that a list takes.
    wait = sitting.reducer.wait(0.0, sitting.view)
    assert wait is not None and wait > 0.0
    sitting.view = sitting.reducer.pass_time(wait + 1.0, sitting.view)
    sitting.hear(RecordingsListed)
    assert (sitting.run_list.chosen, sitting.run_list.count) == (None, ROWS_PER_PAGE + 1)
    notice = sitting.run_list.notice
    assert notice == Notice("Gone", f"run {newest.id} is no longer stored")


def test_the_reducer_renames_and_deletes_and_says_why_it_did_not(
    sitting: Sitting, store: RecordingStore
) -> None:
    run = sitting.run_list.runs[0]
    sitting.ask(ChooseRecording(run.id))
    sitting.ask(AnnotateRecording(run.id, run.revision, "other", "", ""))
    assert sitting.run_list.chosen is not None
    assert sitting.run_list.chosen.name == sitting.run_list.runs[0].name == "other"
    sitting.ask(DeleteRecording(run.id, run.revision))
    assert sitting.run_list.notice is not None
    assert sitting.run_list.notice.title == "Not deleted"
    assert "changed meanwhile" in sitting.run_list.notice.message
    sitting.ask(DeleteRecording(run.id, sitting.run_list.chosen.revision))
    assert (sitting.run_list.chosen, sitting.run_list.notice) == (None, None)
    assert run.id not in ids_of(sitting.run_list.runs)
    assert store.count() == ROWS_PER_PAGE + 1


def test_a_run_is_opened_and_one_that_is_gone_is_explained(
    sitting: Sitting, store: RecordingStore
) -> None:
    run, other = sitting.run_list.runs[:2]
    store.delete(other.id)
    sitting.ask(OpenRecording(other.id), RecordingUnreadable)
    assert sitting.run_list.notice == Notice("Not opened", f"there is no recording '{other.id}'")
    assert sitting.view.status.stage is RunStage.UNREADABLE
    sitting.ask(OpenRecording(run.id), RecordingOpened)
    assert sitting.run_list.notice is None
    assert sitting.view.shown is not None
    assert sitting.view.shown.replay is not None
    assert sitting.view.shown.replay.run_id == run.id

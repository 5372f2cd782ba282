"""The thread that lists, opens and changes stored runs."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator, Sequence

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.recordings import (
    AnnotateRecording,
    DeleteRecording,
    RecordingChanged,
    RecordingRefused,
    RecordingsListed,
    RecordingUnreadable,
)
from slipgrasp.web.model.run_list import OUTCOME_CHOICES, ROWS_PER_PAGE, RunFilter
from slipgrasp.web.workers.library_worker import LibraryWorker
from slipgrasp.web.workers.worker import QueueWorker
from tests.waiting import PATIENCE
from tests.web.opening import recordings_in

ALL = RunFilter()
HOSTILE = "<img src=x onerror=alert(1)>"


def ids_of(runs: Sequence[StoredRun]) -> list[str]:
    return [run.id for run in runs]


class Library:
    """A worker and its answers."""

    def __init__(self, store: RecordingStore) -> None:
        self.answers: queue.SimpleQueue[Intent] = queue.SimpleQueue()
        self.worker = LibraryWorker(store, recordings_in(store), self.answers.put)

    def answer(self) -> Intent:
        return self.answers.get(timeout=PATIENCE)

    def listed(self, page: int = 0, wanted: RunFilter = ALL, chosen: str = "") -> RecordingsListed:
        self.worker.list(page, wanted, chosen)
        answer = self.answer()
        assert isinstance(answer, RecordingsListed)
        return answer


@pytest.fixture
def library(store: RecordingStore) -> Iterator[Library]:
    library = Library(store)
    yield library
    library.worker.close()
    library.worker.join(10.0)
    assert "library-worker" not in {thread.name for thread in threading.enumerate()}


def test_of_tasks_that_wait_only_the_latest_of_a_subject_is_run() -> None:
    worker, done = QueueWorker("tasks"), []
    begun, go_on = threading.Event(), threading.Event()

    def wait() -> None:
        begun.set()
        go_on.wait(PATIENCE)

    worker.ask(wait)
    assert begun.wait(PATIENCE)
    for number in range(3):
        worker.ask(lambda number=number: done.append(("list", number)), "list")
        worker.ask(lambda number=number: done.append(("delete", number)))
    finished = threading.Event()
    worker.ask(finished.set)
    go_on.set()
    assert finished.wait(PATIENCE)
    worker.close()
    worker.join(30.0)
    assert done == [("delete", 0), ("delete", 1), ("list", 2), ("delete", 2)]


def test_pages_have_the_newest_first_and_end_with_the_last(
    library: Library, store: RecordingStore, case_1: RunResult
) -> None:
    ids = [store.save(case_1).id for _ in range(ROWS_PER_PAGE + 2)][::-1]
    for asked, page, expected in ((0, 0, ids[:ROWS_PER_PAGE]), (99, 1, ids[ROWS_PER_PAGE:])):
        answer = library.listed(asked)
        assert (answer.page, answer.count) == (page, len(ids))
        assert ids_of(answer.runs) == expected
        assert ids_of(answer.recent) == ids


def test_runs_are_found_by_their_words_and_by_how_they_went(
    library: Library, store: RecordingStore, case_1: RunResult, case_2: RunResult
) -> None:
    first, second = store.save(case_1), store.save(case_2)
    store.annotate(second.id, name="Slippery one")
    assert ids_of(library.listed(0, RunFilter("slippery")).runs) == [second.id]
    assert ids_of(library.listed(0, RunFilter(outcome="held")).runs) == [second.id, first.id]
    for outcome in OUTCOME_CHOICES[2:]:
        assert library.listed(0, RunFilter(outcome=outcome)).runs == ()
    assert library.listed(5, RunFilter("x" * 1000)).count == 0
    assert library.listed(0, RunFilter(outcome=HOSTILE)).count == 2


@pytest.mark.parametrize("hostile", ["abcdefghijkl", "../../etc", "", "x" * 500])
def test_what_is_not_in_the_store_is_answered_with_a_sentence(
    library: Library, hostile: str
) -> None:
    library.worker.open(1, hostile)
    answer = library.answer()
    assert isinstance(answer, RecordingUnreadable)
    assert "no recording" in answer.message
    library.worker.delete(DeleteRecording(hostile, "revision"))
    answer = library.answer()
    assert isinstance(answer, RecordingRefused)
    assert answer.what == "Not deleted"
    assert "no recording" in answer.message


def test_a_run_is_named_tagged_and_deleted_as_it_was_seen_and_not_otherwise(
    library: Library, store: RecordingStore, case_1: RunResult
) -> None:
    stored = store.save(case_1)
    request = AnnotateRecording(stored.id, stored.revision, " mine ", "a, b , ,a", "two\nlines")
    library.worker.annotate(request)
    answer = library.answer()
    assert isinstance(answer, RecordingChanged)
    assert answer.stored == store.get(stored.id)
    told = store.get(stored.id)
    assert (told.name, told.tags, told.notes) == ("mine", ("a", "b"), "two\nlines")
    for refused, what in (
        (library.worker.annotate, "Not changed"),
        (
            lambda _: library.worker.delete(DeleteRecording(stored.id, stored.revision)),
            "Not del",
        ),
    ):
        refused(request)
        answer = library.answer()
        assert isinstance(answer, RecordingRefused)
        assert answer.what.startswith(what)
        assert "changed meanwhile" in answer.message
    library.worker.annotate(AnnotateRecording(stored.id, told.revision, "n" * 201, "", ""))
    answer = library.answer()
    assert isinstance(answer, RecordingRefused)
    assert answer.message.startswith("name: ")
    library.worker.delete(DeleteRecording(stored.id, told.revision))
    assert library.answer() == RecordingChanged(stored.id, None)
    assert store.count() == 0

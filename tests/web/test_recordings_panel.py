"""The list of stored runs, and the thread that reads it."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from core.loading import load_scenario
from core.result import RunResult
from recordings.store import RecordingStore, StoredRun
from server.viewer_server import ViewerServer
from web.intents.intent import Intent
from web.intents.recordings import RecordingOpened, RecordingsListed, RecordingUnreadable
from web.librarian import ROWS_PER_PAGE, Librarian
from web.panels.recordings_panel import RecordingsPanel, row_words
from web.playback import WindowChoice
from web.replay import open_replay
from web.view import Draft, RunStage, RunStatus, Shelf, Shown, ViewState


@pytest.fixture
def store(tmp_path: Path) -> Iterator[RecordingStore]:
    store = RecordingStore(tmp_path / "data")
    yield store
    store.close()


class Desk:
    """A librarian and its answers."""

    def __init__(self, store: RecordingStore) -> None:
        self.answers: queue.SimpleQueue[Intent] = queue.SimpleQueue()
        self.librarian = Librarian(store, self.answers.put)

    def answer(self) -> Intent:
        return self.answers.get(timeout=30.0)


@pytest.fixture
def desk(store: RecordingStore) -> Iterator[Desk]:
    desk = Desk(store)
    yield desk
    desk.librarian.close()
    desk.librarian.join(10.0)
    assert "librarian" not in {thread.name for thread in threading.enumerate()}


def test_pages_have_the_newest_first_and_end_with_the_last(
    desk: Desk, store: RecordingStore, case_1: RunResult
) -> None:
    ids = [store.save(case_1).id for _ in range(ROWS_PER_PAGE + 2)][::-1]
    for asked, page, expected in ((0, 0, ids[:ROWS_PER_PAGE]), (99, 1, ids[ROWS_PER_PAGE:])):
        desk.librarian.list(asked)
        answer = desk.answer()
        assert isinstance(answer, RecordingsListed)
        assert (answer.page, answer.count) == (page, len(ids))
        assert [run.id for run in answer.runs] == expected


def test_an_empty_store_has_one_empty_page(desk: Desk) -> None:
    desk.librarian.list(3)
    assert desk.answer() == RecordingsListed(0, 0, ())


def test_a_stored_run_is_opened_as_it_was_saved(
    desk: Desk, store: RecordingStore, case_1: RunResult
) -> None:
    stored = store.save(case_1)
    desk.librarian.open(7, stored.id)
    answer = desk.answer()
    assert isinstance(answer, RecordingOpened)
    assert (answer.number, answer.replay.run_id) == (7, stored.id)
    assert answer.replay.result.trace.to_rows().tobytes() == case_1.trace.to_rows().tobytes()


@pytest.mark.parametrize("hostile", ["abcdefghijkl", "../../etc", "", "x" * 500])
def test_what_is_not_in_the_store_is_answered_with_a_sentence(desk: Desk, hostile: str) -> None:
    desk.librarian.open(1, hostile)
    answer = desk.answer()
    assert isinstance(answer, RecordingUnreadable)
    assert "no recording" in answer.message


def test_a_row_says_how_a_run_went(store: RecordingStore, case_1: RunResult) -> None:
    stored = store.save(case_1)
    words = row_words(stored)
    assert (words.label, words.outcome, words.tone) == ("paper-case-1", "held", "good")
    assert words.details.startswith("7 s · slip 2.6 mm · 20")
    ended = {**stored.summary, "outcome": "left_face"}
    assert row_words(replace(stored, summary=ended)).outcome == "left face"
    slipping = {**stored.summary, "metrics": {**stored.summary["metrics"], "held": False}}
    assert row_words(replace(stored, summary=slipping)).outcome == "not held"
    assert row_words(replace(stored, name="n" * 100)).label == f"{'n' * 29}…"


@pytest.mark.parametrize(
    "summary", [{}, {"outcome": "completed"}, {"outcome": "completed", "metrics": None}]
)
def test_a_summary_that_makes_no_sense_is_called_unreadable(
    store: RecordingStore, case_1: RunResult, summary: dict
) -> None:
    words = row_words(replace(store.save(case_1), summary=summary))
    assert (words.outcome, words.tone) == ("unreadable", "bad")


def test_the_panel_marks_the_run_on_the_screen_and_hides_what_it_does_not_need(
    viewer_server: ViewerServer, store: RecordingStore, case_1: RunResult
) -> None:
    runs = tuple(store.save(case_1) for _ in range(2))
    panel = RecordingsPanel(viewer_server.gui, lambda _: None)
    shown = Shown(1, case_1, 0.0, open_replay(store, runs[1].id))
    panel.update(view_of(Shelf(0, 2, runs), shown))
    buttons = [row.button for row in panel.rows]
    assert [button.visible for button in buttons] == [True] * 2 + [False] * (ROWS_PER_PAGE - 2)
    assert (buttons[0].color, buttons[1].color) == ("gray", None)
    panel.remove()


def test_nothing_that_is_stored_becomes_markup(
    viewer_server: ViewerServer, store: RecordingStore, case_1: RunResult
) -> None:
    hostile = "<img src=x onerror=alert(1)>"
    run: StoredRun = replace(store.save(case_1), summary={}, title=hostile)
    panel = RecordingsPanel(viewer_server.gui, lambda _: None)
    panel.update(view_of(Shelf(0, 1, (run,), hostile), None))
    assert "<img" not in panel.head.content + panel.rows[0].line.content
    assert "&lt;img" in panel.head.content
    assert "&lt;img" in panel.rows[0].line.content
    panel.remove()


def view_of(shelf: Shelf, shown: Shown | None) -> ViewState:
    return ViewState(
        draft=Draft("paper-case-1", load_scenario("paper-case-1")),
        status=RunStatus(RunStage.REPLAY),
        choice=WindowChoice.SLIP,
        shown=shown,
        shelf=shelf,
    )

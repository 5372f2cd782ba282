"""The desk of the stored runs."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.intents.recordings import (
    AnnotateRecording,
    ChooseRecording,
    DeleteRecording,
    FilterRecordings,
    ListRecordings,
    OpenRecording,
    RecordingChanged,
    RecordingOpened,
    RecordingRefused,
    RecordingsListed,
    RecordingUnreadable,
)
from slipgrasp.web.model.intents.runs import RunSaved
from slipgrasp.web.model.replay import Source
from slipgrasp.web.model.shelf import Notice, Shelf, ShelfFilter
from slipgrasp.web.model.showing import show_replay, with_status
from slipgrasp.web.model.view import RunStage, RunStatus, ViewState
from slipgrasp.web.reducers.reducer import Desk
from slipgrasp.web.workers.librarian import Librarian

_LEAST_INTERVAL = 4.0
_SHARE = 0.005


def relist_interval(elapsed: float) -> float:
    """How long to leave the list alone, so that looking stays a small part of the time [s].

    Args:
        elapsed: How long the last look took [s].
    """
    return max(_LEAST_INTERVAL, elapsed / _SHARE)


class RecordingsDesk(Desk):
    """Lists stored runs and opens them; what is on the screen stays until one is there.

    The list is looked up again every few seconds, since others save and delete runs too.

    Args:
        store: The stored runs.
        send: Takes the librarian's answers.
        first: The recording to open first, if any.
    """

    takes: ClassVar[tuple[type[Intent], ...]] = (
        ListRecordings,
        FilterRecordings,
        ChooseRecording,
        OpenRecording,
        AnnotateRecording,
        DeleteRecording,
        RecordingsListed,
        RecordingChanged,
        RecordingRefused,
        RecordingOpened,
        RecordingUnreadable,
        RunSaved,
    )

    def __init__(self, store: RecordingStore, send: Send, first: Source | None) -> None:
        self._librarian = Librarian(store, send)
        self.workers = (self._librarian,)
        self._first = first
        self._listed_at: float | None = None
        self._interval = _LEAST_INTERVAL

    def start(self, view: ViewState) -> ViewState:
        """Asks for the first page of the list, and for the first recording."""
        self._list(view.shelf)
        return view if self._first is None else self._open(view, self._first)

    def take(self, intent: Intent, view: ViewState) -> ViewState:
        """Asks the librarian, or shows what it answers."""
        match intent:
            case OpenRecording(run_id):
                return self._open(view, run_id)
            case RecordingOpened(number, recording):
                if number != view.opening:
                    return view
                return show_replay(_with_notice(view, None), recording)
            case RecordingUnreadable(number, message):
                return view if number != view.opening else _refused(view, message)
            case RecordingRefused(what, message):
                self._list(view.shelf)
                return _with_notice(view, Notice(what, message))
            case _:
                return replace(view, shelf=self._changed(intent, view.shelf))

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Looks the list up again once in a while."""
        if self._listed_at is None:
            self._listed_at = now
        elif now - self._listed_at >= self._interval:
            self._listed_at = now
            self._list(view.shelf)
        return view

    def wait(self, now: float, view: ViewState) -> float | None:
        """Until the list is to be looked up again."""
        since = 0.0 if self._listed_at is None else now - self._listed_at
        return max(self._interval - since, 0.0)

    def _changed(self, intent: Intent, shelf: Shelf) -> Shelf:
        """What the list looks like now; a newer one is asked for where it has to be."""
        match intent:
            case ListRecordings(page):
                shelf = replace(shelf, page=page)
            case FilterRecordings(text, outcome):
                shelf = replace(shelf, page=0, wanted=ShelfFilter(text, outcome))
            case ChooseRecording(run_id):
                listed = {run.id: run for run in shelf.runs}
                shelf = _chosen(shelf, run_id, listed.get(run_id))
            case AnnotateRecording():
                self._librarian.annotate(intent)
                return shelf
            case DeleteRecording():
                self._librarian.delete(intent)
                return shelf
            case RecordingsListed():
                self._interval = relist_interval(intent.elapsed)
                return _listed(shelf, intent)
            case RecordingChanged(run_id, stored):
                if shelf.chosen_id == run_id:
                    shelf = _chosen(shelf, run_id if stored else "", stored)
        self._list(shelf)
        return shelf

    def _list(self, shelf: Shelf) -> None:
        self._librarian.list(shelf.page, shelf.wanted, shelf.chosen_id)

    def _open(self, view: ViewState, source: Source) -> ViewState:
        number = view.opening + 1
        self._librarian.open(number, source)
        return replace(view, opening=number)


def _listed(shelf: Shelf, found: RecordingsListed) -> Shelf:
    """The list as it is now; a run that was chosen and is gone is told of."""
    if shelf.chosen_id and shelf.chosen_id == found.chosen_id:
        is_gone = found.chosen is None
        notice = Notice("Gone", f"run {shelf.chosen_id} is not stored any more")
        shelf = replace(
            shelf,
            chosen_id="" if is_gone else shelf.chosen_id,
            chosen=found.chosen,
            notice=notice if is_gone else shelf.notice,
        )
    return replace(
        shelf,
        page=found.page,
        count=found.count,
        runs=found.runs,
        recent=found.recent,
    )


def _chosen(shelf: Shelf, run_id: str, run: StoredRun | None) -> Shelf:
    return replace(shelf, chosen_id=run_id, chosen=run, notice=None)


def _refused(view: ViewState, message: str) -> ViewState:
    """A recording could not be opened; it is told where one was asked for."""
    view = _with_notice(view, Notice("Not opened", message))
    if view.shown is None:
        return with_status(view, RunStatus(RunStage.UNREADABLE, (message,)))
    return view


def _with_notice(view: ViewState, notice: Notice | None) -> ViewState:
    return replace(view, shelf=replace(view.shelf, notice=notice))

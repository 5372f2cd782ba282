"""The reducer of the stored runs."""

from __future__ import annotations

from dataclasses import replace

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
from slipgrasp.web.model.run_list import Notice, RunFilter, RunList
from slipgrasp.web.model.view import (
    RunStage,
    RunStatus,
    ViewState,
    replays_of,
    show_replay,
)
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.workers.library_worker import LibraryWorker
from slipgrasp.web.workers.open_recordings import OpenRecordings

_LEAST_INTERVAL = 4.0
_SHARE = 0.005


def relist_interval(elapsed: float) -> float:
    """Interval between queries of the list, to limit their load [s].

    Args:
        elapsed: Duration of the last query [s].
    """
    return max(_LEAST_INTERVAL, elapsed / _SHARE)


class RecordingsReducer(Reducer):
    """Lists stored runs and opens them; the screen is unchanged until a run is loaded.

    The list is queried again every few seconds, because others save and delete runs too.

    Args:
        store: Store of the runs.
        recordings: Opens runs.
        send: Accepts the worker's answers.
        first: The recording to open first, if any.
    """

    def __init__(
        self,
        store: RecordingStore,
        recordings: OpenRecordings,
        send: Send,
        first: Source | None,
    ) -> None:
        self._worker = LibraryWorker(store, recordings, send)
        self.workers = (self._worker,)
        self._first = first
        self._listed_at: float | None = None
        self._interval = _LEAST_INTERVAL

    def start(self, view: ViewState) -> ViewState:
        """Requests the first page of the list, and the first recording."""
        self._list(view.run_list)
        return view if self._first is None else self._open(view, self._first)

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Starts the worker, or shows its answer."""
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
                self._list(view.run_list)
                return _with_notice(view, Notice(what, message))
            case _:
                run_list = self._changed(intent, view.run_list)
                return view if run_list is view.run_list else replace(view, run_list=run_list)

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Queries the list again when due."""
        if self._listed_at is None:
            self._listed_at = now
        elif now - self._listed_at >= self._interval:
            self._listed_at = now
            self._list(view.run_list)
        return view

    def wait(self, now: float, view: ViewState) -> float | None:
        """Time until the next query."""
        since = 0.0 if self._listed_at is None else now - self._listed_at
        return max(self._interval - since, 0.0)

    def _changed(self, intent: Intent, run_list: RunList) -> RunList:
        """The current list; a newer one is requested if necessary."""
        match intent:
            case ListRecordings(page):
                run_list = replace(run_list, page=page)
            case FilterRecordings(text, outcome):
                run_list = replace(run_list, page=0, wanted=RunFilter(text, outcome))
            case ChooseRecording(run_id):
                listed = {run.id: run for run in run_list.runs}
                run_list = _chosen(run_list, run_id, listed.get(run_id))
            case AnnotateRecording():
                self._worker.annotate(intent)
                return run_list
            case DeleteRecording():
                self._worker.delete(intent)
                return run_list
            case RecordingsListed():
                self._interval = relist_interval(intent.elapsed)
                return _listed(run_list, intent)
            case RecordingChanged(run_id, stored):
                if run_list.chosen_id == run_id:
                    run_list = _chosen(run_list, run_id if stored else "", stored)
            case RunSaved():
                pass
            case _:
                return run_list
        self._list(run_list)
        return run_list

    def _list(self, run_list: RunList) -> None:
        self._worker.list(run_list.page, run_list.wanted, run_list.chosen_id)

    def _open(self, view: ViewState, source: Source) -> ViewState:
        number = view.opening + 1
        self._worker.open(number, source, replays_of(view))
        return replace(view, opening=number)


def _listed(run_list: RunList, found: RecordingsListed) -> RunList:
    """The current list; reports if the selected run was deleted."""
    if run_list.chosen_id and run_list.chosen_id == found.chosen_id:
        is_gone = found.chosen is None
        notice = Notice("Gone", f"run {run_list.chosen_id} is no longer stored")
        run_list = replace(
            run_list,
            chosen_id="" if is_gone else run_list.chosen_id,
            chosen=found.chosen,
            notice=notice if is_gone else run_list.notice,
        )
    return replace(
        run_list,
        page=found.page,
        count=found.count,
        runs=found.runs,
        recent=found.recent,
    )


def _chosen(run_list: RunList, run_id: str, run: StoredRun | None) -> RunList:
    return replace(run_list, chosen_id=run_id, chosen=run, notice=None)


def _refused(view: ViewState, message: str) -> ViewState:
    """A recording could not be opened; the error is shown where it was requested."""
    view = _with_notice(view, Notice("Not opened", message))
    if view.shown is None:
        return replace(view, status=RunStatus(RunStage.UNREADABLE, (message,)))
    return view


def _with_notice(view: ViewState, notice: Notice | None) -> ViewState:
    return replace(view, run_list=replace(view.run_list, notice=notice))

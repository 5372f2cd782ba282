"""Thread that calls the study service for a session."""

from __future__ import annotations

import time
from functools import partial

from slipgrasp.core.exceptions import ScenarioError, SlipgraspError
from slipgrasp.core.scenario import Scenario
from slipgrasp.server.budget import MemoryBudget, Need
from slipgrasp.server.exceptions import ServiceBusyError
from slipgrasp.server.jobs.job import StudyState
from slipgrasp.server.studies.progress import StudyStatus
from slipgrasp.server.studies.service import StudyService
from slipgrasp.web.charts.study_map import draw_map
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.study import (
    StudiesListed,
    StudyMoved,
    StudyPriced,
    StudyRefused,
    StudyRunRecorded,
    StudyRunRefused,
    StudyStarted,
    StudyUnreadable,
)
from slipgrasp.web.model.study_draft import StudyDraft, study_of
from slipgrasp.web.model.study_map import MapPicture
from slipgrasp.web.workers.worker import QueueWorker

MOST_LISTED = 30
"""Larger than the queue limit, so that the list contains the running study."""

_REDRAW_EVERY = 1.0
_DRAWING_SHARE = 0.1


class StudyWorker(QueueWorker):
    """Estimates, starts, monitors and opens studies; each result is an intent.

    Args:
        service: Runs studies.
        memory: Memory budget.
        send: Receives the results.
    """

    def __init__(self, service: StudyService, memory: MemoryBudget, send: Send) -> None:
        super().__init__("study-worker")
        self._service, self._memory, self._send = service, memory, send
        self._told: tuple[int, StudyStatus, int] | None = None
        self._drawn: tuple[int, int] | None = None
        self._draw_again_at = 0.0

    def list(self) -> None:
        """Requests the newest studies."""
        self.ask(self._list, "list")

    def price(self, number: int, draft: StudyDraft, scenario: Scenario, origin: str) -> None:
        """Requests the computing time of a study; ``number`` is repeated in the result."""
        self.ask(partial(self._price, number, draft, scenario, origin), "price")

    def start(self, number: int, draft: StudyDraft, scenario: Scenario, origin: str) -> None:
        """Requests to start a study; ``number`` is repeated in the result."""
        self.ask(partial(self._start, number, draft, scenario, origin), "start", must=True)

    def poll(self, number: int, study_id: str) -> None:
        """Requests the progress of a study; ``number`` is that of the request to monitor it."""
        self.ask(partial(self._poll, number, study_id), "poll")

    def cancel(self, number: int, study_id: str) -> None:
        """Requests cancellation of a study."""
        self.ask(partial(self._cancel, number, study_id), "cancel", must=True)

    def resume(self, number: int, study_id: str) -> None:
        """Requests to resume a failed study."""
        self.ask(partial(self._resume, number, study_id), "resume", must=True)

    def record(self, study_id: str, index: int) -> None:
        """Requests the recording of a run of a study."""
        self.ask(partial(self._record, study_id, index), "record")

    def _list(self) -> None:
        studies, _ = self._service.list(0, MOST_LISTED)
        self._send(StudiesListed(tuple(studies)))

    def _price(self, number: int, draft: StudyDraft, scenario: Scenario, origin: str) -> None:
        try:
            cost, warnings = self._service.estimate(study_of(draft, scenario, origin))
        except ScenarioError as error:
            self._send(StudyRefused(number, _sentences(error)))
        else:
            self._send(StudyPriced(number, cost.seconds, warnings))

    def _start(self, number: int, draft: StudyDraft, scenario: Scenario, origin: str) -> None:
        try:
            status = self._service.create(partial(study_of, draft, scenario, origin))
        except ScenarioError as error:
            self._send(StudyRefused(number, _sentences(error)))
        except SlipgraspError as error:
            self._send(StudyRefused(number, (str(error),)))
        else:
            self._send(StudyStarted(number, status))
            self._list()

    def _cancel(self, number: int, study_id: str) -> None:
        try:
            self._service.cancel(study_id)
        except SlipgraspError as error:
            self._send(StudyUnreadable(number, str(error)))

    def _resume(self, number: int, study_id: str) -> None:
        try:
            self._service.resume(study_id)
        except SlipgraspError as error:
            self._send(StudyUnreadable(number, str(error)))

    def _record(self, study_id: str, index: int) -> None:
        try:
            stored, _ = self._service.record_run(study_id, index)
        except SlipgraspError as error:
            self._send(StudyRunRefused(study_id, index, str(error)))
        else:
            self._send(StudyRunRecorded(study_id, index, stored.id))

    def _poll(self, number: int, study_id: str) -> None:
        try:
            status = self._service.status(study_id)
            behind = self._num_before(status)
            picture, has_map = self._picture(number, status)
        except SlipgraspError as error:
            self._send(StudyUnreadable(number, str(error)))
            return
        told = (number, status, behind)
        if told != self._told or picture is not None:
            self._told = told
            self._send(StudyMoved(number, status, behind, picture, has_map))

    def _num_before(self, status: StudyStatus) -> int:
        """Number of studies and fits that are queued before this study."""
        if status.state is not StudyState.QUEUED:
            return 0
        return self._service.num_before(status.stored.id)

    def _picture(self, number: int, status: StudyStatus) -> tuple[MapPicture | None, bool]:
        """Returns a new map if it is due, and whether the study has a map.

        Raises:
            RecordingError: If the file of the study is damaged.
        """
        drawn = (number, status.finished)
        if drawn == self._drawn:
            return None, True
        is_new = self._drawn is None or self._drawn[0] != number
        started = time.monotonic()
        if not is_new and not status.state.has_ended and started < self._draw_again_at:
            return None, True
        try:
            with self._memory.reserve(Need.for_rows(status.finished)):
                picture = draw_map(self._service.results(status.stored.id))
        except ServiceBusyError:
            # The next poll tries again.
            return None, True
        self._drawn = drawn
        took = time.monotonic() - started
        self._draw_again_at = started + max(_REDRAW_EVERY, took / _DRAWING_SHARE)
        return picture, picture is not None


def _sentences(error: ScenarioError) -> tuple[str, ...]:
    return tuple(finding.message for finding in error.errors)

"""Thread that calls the fit service for a session."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.scenario import Scenario
from slipgrasp.recordings.fit.request import FitRequest, read_noise, split
from slipgrasp.server.fits.progress import FitStatus
from slipgrasp.server.fits.service import FitService
from slipgrasp.server.jobs.job import StudyState
from slipgrasp.web.model.fit import FitDraft
from slipgrasp.web.model.intents.fit import FitMoved, FitRefused, FitsListed
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.workers.worker import QueueWorker

MOST_LISTED = 30


class FitWorker(QueueWorker):
    """Starts, monitors and cancels fits; each result is an intent.

    Args:
        service: Runs fits.
        send: Receives the results.
    """

    def __init__(self, service: FitService, send: Send) -> None:
        super().__init__("fit-worker")
        self._service, self._send = service, send

    def list(self) -> None:
        """Requests the newest fits."""
        self.ask(self._list, "list")

    def start(self, draft: FitDraft, scenario: Scenario) -> None:
        """Requests a new fit."""
        self.ask(partial(self._start, draft, scenario), "start", must=True)

    def poll(self, fit_id: str) -> None:
        """Requests the progress of a fit."""
        self.ask(partial(self._tell, partial(self._service.status, fit_id)), "poll")

    def cancel(self, fit_id: str) -> None:
        """Requests cancellation of a fit."""
        self.ask(partial(self._tell, partial(self._service.cancel, fit_id)), "cancel", must=True)

    def _list(self) -> None:
        fits, _ = self._service.list(0, MOST_LISTED)
        self._send(FitsListed(tuple(fits)))

    def _start(self, draft: FitDraft, scenario: Scenario) -> None:
        self._tell(lambda: self._service.create(lambda: request_of(draft, scenario)))
        self._list()

    def _tell(self, ask: Callable[[], FitStatus]) -> None:
        try:
            status = ask()
            is_complete = status.state is StudyState.COMPLETED
            report = self._service.store.read_report(status.stored.id) if is_complete else None
        except SlipgraspError as error:
            self._send(FitRefused(str(error)))
        else:
            self._send(FitMoved(status, report))


def request_of(draft: FitDraft, scenario: Scenario) -> FitRequest:
    """Converts the entries of a user to a fit request.

    Raises:
        FitError: If the noise of a signal is not a number.
    """
    return FitRequest(
        recording=draft.recording,
        scenario=scenario.to_mapping(),
        free=tuple(split(draft.free)),
        signals=read_noise(draft.signals),
        starts=draft.starts,
    )

"""Reducer of fits: starts a fit, and monitors the displayed one."""

from __future__ import annotations

from dataclasses import replace

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.server.fits.service import FitService
from slipgrasp.web.model.fit import FitDraft, FitView
from slipgrasp.web.model.intents.fit import (
    CancelFit,
    FitMoved,
    FitRefused,
    FitsListed,
    OpenFit,
    StartFit,
)
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.workers.fit_worker import FitWorker

POLL_INTERVAL = 0.5


class FitReducer(Reducer):
    """Updates the displayed fit, which belongs to the server and outlives the session.

    Args:
        service: Runs fits.
        send: Receives the results of the worker.
    """

    def __init__(self, service: FitService, send: Send) -> None:
        self._worker = FitWorker(service, send)
        self.workers = (self._worker,)
        self._followed_id: str | None = None
        self._poll_at = 0.0

    def start(self, view: ViewState) -> ViewState:
        """Requests the list of fits."""
        self._worker.list()
        return view

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Sends a request to the worker, or shows its result."""
        fit = self._start(intent.draft, view) if isinstance(intent, StartFit) else None
        fit = fit or self._changed(intent, view.fit)
        return view if fit is view.fit else replace(view, fit=fit)

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Requests the progress of the fit until it has ended."""
        if self._followed_id is not None and now >= self._poll_at:
            self._poll_at = now + POLL_INTERVAL
            self._worker.poll(self._followed_id)
        return view

    def wait(self, now: float, view: ViewState) -> float | None:
        """Time until the next request while a fit is monitored."""
        return None if self._followed_id is None else max(self._poll_at - now, 0.0)

    def _start(self, draft: FitDraft, view: ViewState) -> FitView:
        if not draft.recording:
            return replace(view.fit, message="Choose the data to fit.")
        try:
            scenario = view.draft.scenario()
        except ScenarioError as error:
            return replace(view.fit, message=str(error))
        self._worker.start(draft, scenario)
        return replace(view.fit, is_starting=True, message="")

    def _changed(self, intent: Intent, fit: FitView) -> FitView:
        match intent:
            case CancelFit() if fit.status is not None:
                self._worker.cancel(fit.status.stored.id)
            case OpenFit(fit_id):
                self._followed_id, self._poll_at = fit_id, 0.0
            case FitsListed(fits):
                return replace(fit, listed=fits)
            case FitRefused(message):
                self._followed_id = None
                return replace(fit, message=message, is_starting=False)
            case FitMoved(status, report):
                has_ended = status.state.has_ended
                self._followed_id = None if has_ended else status.stored.id
                if has_ended:
                    self._worker.list()
                return replace(fit, status=status, report=report, message="", is_starting=False)
        return fit

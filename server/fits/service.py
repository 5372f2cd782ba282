"""Fits stored recordings one after the other, in the queue of studies; independent of HTTP."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.fit.problem import FitError
from slipgrasp.recordings.exceptions import RecordingNotFoundError
from slipgrasp.recordings.fit.fit_store import FitStore, StoredFit
from slipgrasp.recordings.fit.request import FitRequest
from slipgrasp.server.addresses import fit_path
from slipgrasp.server.budget import MemoryBudget
from slipgrasp.server.exceptions import InvalidRequestError, printable
from slipgrasp.server.fits.need import check_values, need_of
from slipgrasp.server.fits.progress import FitStatus, LiveFit
from slipgrasp.server.jobs.queue import JobQueue
from slipgrasp.server.jobs.service import JobService
from slipgrasp.server.request_keys import UNKEYED, KeyedRequest
from slipgrasp.server.settings import Settings


class FitService(JobService[StoredFit, FitStatus]):
    """Accepts fits, runs one at a time, and returns their reports.

    Args:
        store: The store of fits.
        settings: The limits.
        queue: Runs studies and fits in turn.
        memory: The memory budget.
        is_ending: Whether the service is about to end, so that long work stops.
    """

    noun = "fit"
    path_of = fit_path
    live_type = LiveFit
    ended_status = FitStatus.of

    def __init__(
        self,
        store: FitStore,
        settings: Settings,
        queue: JobQueue,
        memory: MemoryBudget,
        is_ending: Callable[[], bool] = lambda: False,
    ) -> None:
        super().__init__(store, queue, settings, is_ending)
        self.store = store
        self._memory = memory

    def create(
        self, make_request: Callable[[], FitRequest], request: KeyedRequest = UNKEYED
    ) -> FitStatus:
        """Accepts a fit, or finds the fit that the same request has already created.

        Args:
            make_request: Returns the request of the fit, or raises its errors.
            request: The request.

        Raises:
            InvalidRequestError: If the fit is not possible.
            ScenarioError: If the scenario is not valid.
            IdempotencyKeyReusedError: If another request had this key.
            ServiceBusyError: If too many fits are waiting, or being checked.
            RecordingError: If a recording is damaged, or nothing can be saved.
        """

        def store_new(checked: FitRequest) -> LiveFit:
            stored = self.store.create(
                checked, idempotency_key=request.key, request_digest=request.digest
            )
            return LiveFit(stored, self.store, self._memory)

        return self._accept(request, partial(self._check, make_request), store_new)

    def _check(self, make_request: Callable[[], FitRequest]) -> FitRequest:
        try:
            return self._checked_request(make_request())
        except FitError as error:
            finding = FieldError(field=error.field, value=None, limit=None, message=str(error))
            raise InvalidRequestError([finding]) from error

    def _checked_request(self, request: FitRequest) -> FitRequest:
        runs = self.store.runs
        for field, run_id in (
            ("recording", request.recording),
            *(("held_out", each) for each in request.held_out),
        ):
            _check_recording(field, run_id, runs.get)
        with self._memory.reserve(need_of(request, runs)):
            problem, _ = request.read(runs)
            check_values(problem)
        return request

    def _continued(self, stored: StoredFit) -> LiveFit:
        return LiveFit(stored, self.store, self._memory)


def _check_recording(field: str, run_id: str, get: Callable[[str], object]) -> None:
    try:
        get(run_id)
    except RecordingNotFoundError:
        shown = printable(run_id)
        message = f"{field}: there is no recording '{shown}'; GET /runs lists them"
        finding = FieldError(field=field, value=shown, limit=None, message=message)
        raise InvalidRequestError([finding]) from None

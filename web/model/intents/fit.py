"""Intents about fits, and the results of their worker."""

from __future__ import annotations

from typing import Any

from slipgrasp.server.fits.progress import FitStatus
from slipgrasp.web.model.fit import FitDraft
from slipgrasp.web.model.intents.intent import Intent, LatestIntent


class StartFit(LatestIntent):
    """Requests to fit a recording with the displayed scenario."""

    draft: FitDraft


class CancelFit(LatestIntent):
    """Requests to cancel the displayed fit."""


class OpenFit(LatestIntent):
    """Requests to show a fit of the store; its id is not validated yet."""

    fit_id: str


class FitMoved(Intent):
    """Progress of a fit.

    Attributes:
        status: The fit.
        report: Its report, once it is complete.
    """

    status: FitStatus
    report: dict[str, Any] | None


class FitRefused(Intent):
    """Reason why a fit cannot be started or shown."""

    message: str


class FitsListed(Intent):
    """The newest fits of the store."""

    fits: tuple[FitStatus, ...]

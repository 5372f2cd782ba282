"""Intents about fits, and what their worker answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from slipgrasp.server.fits.progress import FitStatus
from slipgrasp.web.model.fit import FitDraft
from slipgrasp.web.model.intents.intent import Intent, LatestIntent


@dataclass(frozen=True, slots=True)
class StartFit(LatestIntent):
    """The user wants a recording to be fitted with the scenario on the screen."""

    draft: FitDraft


@dataclass(frozen=True, slots=True)
class CancelFit(LatestIntent):
    """The user wants the fit on the screen to end."""


@dataclass(frozen=True, slots=True)
class OpenFit(LatestIntent):
    """The user wants to see a fit of the store; its id is not validated yet."""

    fit_id: str


@dataclass(frozen=True, slots=True)
class FitMoved(Intent):
    """How far a fit is.

    Attributes:
        status: The fit.
        report: Its report, once it is complete.
    """

    status: FitStatus
    report: dict[str, Any] | None


@dataclass(frozen=True, slots=True)
class FitRefused(Intent):
    """A fit cannot be made or shown, with the reason."""

    message: str


@dataclass(frozen=True, slots=True)
class FitsListed(Intent):
    """The newest fits of the store."""

    fits: tuple[FitStatus, ...]

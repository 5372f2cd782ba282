"""The profiles of a fit: preliminary while it runs, with estimates once it is complete."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from slipgrasp.core.words.fit_words import interval_words
from slipgrasp.core.words.parameter_words import unit_after
from slipgrasp.web.model.fit import FitView, ShownProfile


def profiles_of(fit: FitView) -> list[ShownProfile]:
    """The profiles of the fit on the screen."""
    if fit.report is not None:
        return [*_reported(fit.report)]
    progress = fit.status.progress if fit.status is not None else None
    if progress is None or not progress.profiles or progress.threshold is None:
        return []
    best = progress.best or {}
    return [
        ShownProfile(key, points, progress.threshold, f"so far {best[key]:.6g}")
        for key, points in progress.profiles.items()
    ]


def _reported(report: dict[str, Any]) -> Iterator[ShownProfile]:
    for key, found in report["parameters"].items():
        interval = found["value"], found["low"], found["high"]
        told = interval_words(found["class"], *interval, found["unit"], found["limits"])
        words = f"{found['class']}: {told}"
        points = tuple((value, rise) for value, rise in found["profile"])
        name = f"{key} [{unit}]" if (unit := unit_after(found["unit"]).strip()) else key
        note = f" ({found['note']})" if found["note"] else ""
        yield ShownProfile(name, points, report["threshold"], words + note)

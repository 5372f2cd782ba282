"""The ways in which runs end, as a map tells them apart: held, slips on, or how it failed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.trace.types import Outcome

if TYPE_CHECKING:
    from slipgrasp.recordings.study.results import StudyResults


class Way(NamedTuple):
    """One way in which a run ends.

    Attributes:
        words: What to call it.
        outcome: The outcome it belongs to.
        reason: Code of the reason, where an outcome has several that are told apart.
    """

    words: str
    outcome: Outcome
    reason: str = ""


WAYS: tuple[Way, ...] = (
    Way("held", Outcome.COMPLETED),
    Way("still slips, or did until just now", Outcome.COMPLETED),
    Way("a fingertip left its face", Outcome.LEFT_FACE),
    Way("separated: a fingertip lost contact", Outcome.SEPARATED),
    Way("chattering between stick and slip", Outcome.CHATTERING),
    Way("no consistent phase", Outcome.INCONSISTENT),
    Way("diverged: estimates became singular", Outcome.DIVERGED, "model_estimate_singular"),
    Way("diverged: Painlevé, friction too high", Outcome.DIVERGED, "painleve"),
    Way("diverged: no step small enough", Outcome.DIVERGED, "step_underflow"),
    Way("diverged: the loop is too stiff to follow", Outcome.DIVERGED, "stiff_loop"),
    Way("diverged: a quantity is not finite", Outcome.DIVERGED, "nonfinite_state"),
    Way("a finger became straight or folded", Outcome.SINGULAR),
    Way("limit of steps or time", Outcome.LIMIT),
    Way("an instant repeats without progress", Outcome.LIMIT, "event_stall"),
    Way("stopped", Outcome.STOPPED),
    Way("recovered from a killed run", Outcome.RECOVERED),
    Way("failed: not computed", Outcome.FAILED),
)
"""All of them, in the order in which a legend lists them."""

HELD = 0
_NOT_HELD = 1


def ways_of(results: StudyResults) -> NDArray[np.int8]:
    """How each run ended, as places in `WAYS`, shape ``(rows,)``."""
    count = results.num_rows
    words = results.values("outcome", 0, count)
    reasons = results.values("reason", 0, count)
    held = results.numbers("held", count) == 1.0
    known: dict[tuple[str, str | None], int] = {}
    for pair in set(zip(words, reasons, strict=True)):
        known[pair] = _place(WAYS, *pair)
    places = [known[pair] for pair in zip(words, reasons, strict=True)]
    ways = np.array(places, dtype=np.int8)
    return np.where(held, np.int8(HELD), ways)


def _place(ways: Sequence[Way], outcome: str, reason: str | None) -> int:
    """The way with the reason, else the first with the outcome."""
    if outcome == Outcome.COMPLETED:
        return _NOT_HELD
    of_outcome = [place for place, way in enumerate(ways) if way.outcome == outcome]
    return next((place for place in of_outcome if ways[place].reason == reason), of_outcome[0])

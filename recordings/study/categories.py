"""Categories of outcomes on a map: held, still slipping, or the kind of failure."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario.space import Space
from slipgrasp.core.study.limits import components
from slipgrasp.core.trace.types import Outcome

if TYPE_CHECKING:
    from slipgrasp.recordings.study.results import StudyResults


class Category(NamedTuple):
    """One category of outcomes.

    Attributes:
        words: Name of the category.
        outcome: Its outcome.
        reason: Code of the reason, if the reasons of an outcome have separate categories.
    """

    words: str
    outcome: Outcome
    reason: str = ""


CATEGORIES: tuple[Category, ...] = (
    Category("held", Outcome.COMPLETED),
    Category("still slips, or has only just stopped", Outcome.COMPLETED),
    Category("past a limit of the study", Outcome.COMPLETED, "past_limit"),
    Category("at rest, but too short to tell", Outcome.COMPLETED, "short_run"),
    Category("a fingertip left its face", Outcome.LEFT_FACE),
    Category("separated: a fingertip lost contact", Outcome.SEPARATED),
    Category("chattering between stick and slip", Outcome.CHATTERING),
    Category("no consistent phase", Outcome.INCONSISTENT),
    Category("diverged: singular estimates", Outcome.DIVERGED, "model_estimate_singular"),
    Category("diverged: torque is not finite", Outcome.DIVERGED, "nonfinite_torque"),
    Category("diverged: the object turned too far", Outcome.DIVERGED, "turned_too_far"),
    Category("Painlevé: friction is too high", Outcome.DIVERGED, "painleve"),
    Category("diverged: no step small enough", Outcome.DIVERGED, "step_underflow"),
    Category("diverged: unbounded grasp force", Outcome.DIVERGED, "unbounded_grasp_force"),
    Category("diverged: the loop is too stiff", Outcome.DIVERGED, "stiff_loop"),
    Category("diverged: a quantity is not finite", Outcome.DIVERGED, "nonfinite_state"),
    Category("a finger became straight or folded", Outcome.SINGULAR),
    Category("a joint reached its limit", Outcome.SINGULAR, "joint_limit"),
    Category("limit of steps or time", Outcome.LIMIT),
    Category("no progress past an instant", Outcome.LIMIT, "event_stall"),
    Category("stopped", Outcome.STOPPED),
    Category("recovered from a killed run", Outcome.RECOVERED),
    Category("failed: not computed", Outcome.FAILED),
)
"""All categories in the order of a legend."""

HELD = 0
NOT_HELD, PAST_LIMIT, TOO_SHORT = 1, 2, 3

_OF_SLIDES = {HELD: "at rest", NOT_HELD: "still slides, or has just stopped"}


def category_words(category: int, space: Space) -> str:
    """Name of a category in a study; without a hand nothing is held.

    Args:
        category: Index into `CATEGORIES`.
        space: Kind of scenario of the study.
    """
    words = CATEGORIES[category].words
    return words if space.has_hand else _OF_SLIDES.get(category, words)


def categorize(results: StudyResults) -> NDArray[np.int8]:
    """Categories of all runs as indices into `CATEGORIES`, shape ``(rows,)``.

    Args:
        results: The results, which do not grow.
    """
    ends = list(zip(results.values("outcome"), results.values("reason"), strict=True))
    known = {end: category_of(*end) for end in set(ends)}
    categories = np.array([known[end] for end in ends], dtype=np.int8)
    categories[results.numbers("held") == 1.0] = HELD
    categories[results.too_short()] = TOO_SHORT
    categories[(categories == NOT_HELD) & _past_limit(results)] = PAST_LIMIT
    return categories


def _past_limit(results: StudyResults) -> NDArray[np.bool_]:
    past = np.zeros(results.num_rows, dtype=bool)
    columns = {column.name: column for column in results.columns}
    for name, limit in results.study.limits.items():
        for one in components(name, columns):
            past |= np.abs(results.numbers(one)) > limit
    return past


def category_of(outcome: str, reason: str | None) -> int:
    """Category of a run that did not hold: that of the reason, else the first of the outcome."""
    if outcome == Outcome.COMPLETED:
        return NOT_HELD
    of_outcome = [place for place, each in enumerate(CATEGORIES) if each.outcome == outcome]
    return next((k for k in of_outcome if CATEGORIES[k].reason == reason), of_outcome[0])

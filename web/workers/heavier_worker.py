"""Thread that finds the largest object mass that is held, for a session."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.verdict import headline_of
from slipgrasp.core.trace.types import Outcome
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.intents.heavier import HowHeavyFound
from slipgrasp.web.workers.simulating_worker import SimulatingWorker

MASS = "object.mass"
_STEP = 1.1
_MOST = 100.0
"""Largest mass tried, relative to the current mass."""
_HALVINGS = 6
_PATIENCE = 20.0


class HeavierWorker(SimulatingWorker):
    """Increases the object mass until it is not held, then bisects the last step."""

    name = "heavier"

    def find(self, number: int, draft: Draft) -> None:
        """Requests the mass limit of a draft; cancels an older request."""
        self.ask_latest(number, partial(self._find, number, draft))

    def _find(self, number: int, draft: Draft) -> None:
        until = time.monotonic() + _PATIENCE

        def is_over() -> bool:
            return self.is_void(number) or time.monotonic() > until

        words = find_border(draft, partial(self._run, is_over=is_over))
        self.send(HowHeavyFound(number, words))

    def _run(self, draft: Draft, *, is_over: Callable[[], bool]) -> RunResult | None:
        """Simulates a draft; None if this is not possible or takes too long."""
        try:
            result = self.service.preview(draft.scenario(), is_over)
        except SlipgraspError:
            return None
        return None if result.outcome in (Outcome.STOPPED, Outcome.LIMIT) else result


def find_border(draft: Draft, run: Callable[[Draft], RunResult | None]) -> str:
    """Describes the largest mass that is held, in a sentence.

    Args:
        draft: Draft whose object is held.
        run: Simulates a draft; None if there is no run.
    """
    present = draft.value_at(0.0, MASS)
    assert isinstance(present, float)
    held_at, lost_at = present, present
    held: RunResult | None = None
    lost: RunResult | None = None
    while lost is None:
        lost_at = _STEP * held_at
        if lost_at > _MOST * present:
            return f"Held up to {held_at:.3g} kg{_offset_of(held)}; heavier was not tried."
        result = run(draft.edited(MASS, lost_at))
        if result is None:
            return f"Held up to {held_at:.3g} kg at least; heavier objects took too long."
        if result.metrics.held:
            held, held_at = result, lost_at
        else:
            lost = result
    for _ in range(_HALVINGS):
        middle = 0.5 * (held_at + lost_at)
        result = run(draft.edited(MASS, middle))
        if result is None:
            break
        if result.metrics.held:
            held, held_at = result, middle
        else:
            lost_at, lost = middle, result
    return (
        f"Held up to {held_at:.4g} kg, {held_at / present:.4g} times its mass{_offset_of(held)}. "
        f"With {lost_at:.4g} kg the result is “{headline_of(lost)}”."
    )


def _offset_of(held: RunResult | None) -> str:
    """Describes the distance of a held object from its target, if it is large."""
    offset = headline_of(held).partition(", ")[2] if held is not None else ""
    return f", there {offset}" if offset else ""

"""Thread that simulates a scenario with every control law, for a session."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from slipgrasp.core.exceptions import ScenarioError, SlipgraspError
from slipgrasp.core.scenario.custom_laws import law_names
from slipgrasp.core.trace.types import Outcome
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.intents.laws import LawRunFinished
from slipgrasp.web.model.laws import with_law
from slipgrasp.web.model.laws_view import LawRun
from slipgrasp.web.model.parameter_names import in_page_words
from slipgrasp.web.workers.simulating_worker import SimulatingWorker


class LawsWorker(SimulatingWorker):
    """Simulates the latest requested scenario with one law after the other."""

    name = "laws"

    def compare(self, number: int, draft: Draft) -> None:
        """Requests the runs of a draft with every law; cancels an older request."""
        self.ask_latest(number, partial(self._compare, number, draft))

    def _compare(self, number: int, draft: Draft) -> None:
        is_void = partial(self.is_void, number)
        for kind in law_names():
            if is_void():
                return
            run = self._run(draft, kind, is_void)
            if run is not None:
                self.send(LawRunFinished(number, run))

    def _run(self, draft: Draft, kind: str, is_void: Callable[[], bool]) -> LawRun | None:
        """Simulates the draft with one law; None if the request is outdated."""
        try:
            result = self.service.preview(with_law(draft, kind, None).scenario(), is_void)
        except ScenarioError as error:
            return LawRun(kind, None, in_page_words(error.errors[0].message, draft.base))
        except SlipgraspError as error:
            return LawRun(kind, None, str(error))
        return None if result.outcome is Outcome.STOPPED else LawRun(kind, result)

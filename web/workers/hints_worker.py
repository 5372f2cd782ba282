"""Thread that tries the suggestions after a run, for a session."""

from __future__ import annotations

import threading
from functools import partial
from typing import ClassVar

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.trying import try_hint
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.words.options import Option
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.hints import followed
from slipgrasp.web.model.intents.hints import HintTried
from slipgrasp.web.workers.simulating_worker import SimulatingWorker


class HintsWorker(SimulatingWorker):
    """Tries the hint of the latest run; one session at a time, so that rendering continues."""

    name = "hints"
    _turn: ClassVar[threading.Lock] = threading.Lock()

    def try_hint(self, number: int, draft: Draft, result: RunResult) -> None:
        """Requests trials of the hint of a run; cancels an older request.

        Args:
            number: Number of the request.
            draft: Draft of the run.
            result: The run.
        """
        self.ask_latest(number, partial(self._try, number, draft, result))

    def give_up(self) -> None:
        """Cancels the trials because their run is no longer displayed."""
        self.ask_latest(-1, lambda: None)

    def _try(self, number: int, draft: Draft, result: RunResult) -> None:
        def follow(option: Option) -> Scenario:
            return followed(draft, option).scenario()

        with self._turn:
            tried = try_hint(
                result,
                describe_run(result).hint,
                follow_option=follow,
                simulate=self.service.preview,
                should_stop=partial(self.is_void, number),
            )
        if not self.is_void(number):
            self.send(HintTried(number, tried))

"""The thread that tries what is suggested after a run, for one session."""

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
    """Tries the hint of the latest run; of all sessions one at a time, so that pictures go on."""

    name = "hints"
    _turn: ClassVar[threading.Lock] = threading.Lock()

    def try_hint(self, number: int, draft: Draft, result: RunResult) -> None:
        """Asks to try the hint of a run; an older one is given up for it.

        Args:
            number: Which request this is.
            draft: What the run is of.
            result: The run.
        """
        self.ask_latest(number, partial(self._try, number, draft, result))

    def give_up(self) -> None:
        """Lets go of what is tried: its run is not on the screen any more."""
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

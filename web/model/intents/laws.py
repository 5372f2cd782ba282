"""Results of running every law."""

from __future__ import annotations

from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.laws_view import LawRun


class LawRunFinished(Intent):
    """The run with one law, or the reason why there is none.

    Attributes:
        number: Number of the request.
        run: The run.
    """

    number: int
    run: LawRun

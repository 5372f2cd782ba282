"""Intents about links to a run and a time in it."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.web.model.intents.intent import LatestIntent


@dataclass(frozen=True, slots=True)
class OpenLink(LatestIntent):
    """The page was opened with a link; nothing of it is validated yet.

    Attributes:
        run_id: Which stored run.
        time: Which time [s], as it is written in the link; empty if it names none.
    """

    run_id: str
    time: str

"""Intents about the charts."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.web.model.intents.intent import Intent


@dataclass(frozen=True, slots=True)
class ToggleLine(Intent):
    """The user wants a line hidden, or back; the keys are not validated yet."""

    chart: str
    line: str
